"""What is shown of a proof: `proof.json` and `proof.html`, entered in the ledger as they are."""

import json
from pathlib import Path

from proof.ledger import SHOWN, Ledger, sha256_of
from proof.out import proof_json
from proof.outcome import Proof
from proof.page import proof_page
from proof.places import PAGE, PROOF
from reports.render import render
from twin.whole_file import write_whole


def show(out: Path, proof: Proof, ledger: Ledger) -> None:
    """Both files, then the entry with their hashes, which is the ledger's last."""
    texts = {
        PROOF: json.dumps(proof_json(proof), indent=1) + "\n",
        PAGE: render(proof_page(proof)),
    }
    for name, text in texts.items():
        write_whole(out / name, text)
    ledger.append(SHOWN, "", {name: sha256_of(text.encode()) for name, text in texts.items()})
