"""`proof_page`: the sections in their order, failures first."""

from proof.outcome import Proof
from proof.page.baselines import baselines
from proof.page.channels import channels
from proof.page.confusion import confusion
from proof.page.failed import failed
from proof.page.probabilities import probabilities
from proof.page.protocol import protocol
from proof.page.sizes import sizes
from proof.page.summary import summary
from proof.page.trials import trials
from proof.tally import recorded, simulated
from reports.page import Page
from reports.quantity import minutes
from reports.section import Row, Section

PROGRAM = "drone-battery-health"  # among the versions


def proof_page(proof: Proof) -> Page:
    """The page of one run."""
    made = (
        summary(proof),
        failed(proof),
        protocol(proof),
        trials(proof),
        confusion(proof),
        probabilities(proof),
        baselines(proof),
        sizes(proof),
        channels(proof),
        provenance(proof),
    )
    return Page(
        title="Proof on concealed data",
        subtitle="Effects that are in the data and kept from the tool, and what it said of them",
        sections=tuple(section for section in made if section is not None),
        version=proof.versions.get(PROGRAM, ""),
    )


def provenance(proof: Proof) -> Section:
    """From what, and how."""
    return Section(
        id="provenance",
        title="Where this comes from",
        rows=(
            Row(label="Seed", value=str(proof.seed), note=_seed(proof)),
            Row(label="Command", value=proof.command),
            Row(label="Hash of the ledger", value=proof.head),
            Row(label="Whole run", value=minutes(proof.seconds), unit="min:s"),
            *(Row(label=name, value=version) for name, version in sorted(proof.versions.items())),
        ),
    )


def _seed(proof: Proof) -> str:
    """What was drawn from it."""
    drawn = "simulated effects and their sizes were drawn from it"
    ordered = "the list of recordings is fixed: the seed only orders its trials"
    groups = ((simulated, drawn), (recorded, ordered))
    return "; ".join(said for member, said in groups if any(map(member, proof.trials)))
