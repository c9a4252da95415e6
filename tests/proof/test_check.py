"""Whoever changes anything of a proof afterwards is found out."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

pytest.importorskip("cryptography", reason="truths are sealed with `cryptography`")

from proof import run as protocol
from proof.check import OtherVersionError, check
from proof.judge import SAID, VERDICT, Verdict
from proof.ledger import (
    BEGUN,
    FIRST,
    LEFT,
    SHOWN,
    Entry,
    Ledger,
    LedgerError,
    read_ledger,
    sha256_of,
)
from proof.outcome import Proof
from proof.places import ASKED as ASKED_FILE
from proof.places import LEDGER, PAGE, PROOF, QUESTION, SEALED, TRIALS, TRUTH, WRITTEN
from proof.run import prove
from proof.shown import show
from proof.trial import Trial
from tests.proof import trials
from tests.proof.test_protocol import ASKED, says_resistance, watch

ONE = f"{TRIALS}/trial-001"


def says_it_on_a_page_too(options: Sequence[str], files: Path, out: Path) -> Verdict:
    verdict = says_resistance(options, files, out)
    (out / SAID).write_text("<p>A resistance was left out.</p>")
    return verdict


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trial and a control, named and shown, and one that cannot be made."""
    folder = tmp_path_factory.mktemp("shown")
    every = [trials.trial("trial-001", trials.OHM), trials.trial("trial-002", 0.0)]
    every.append(Trial(name="trial-003", source="nobody", make=trials.refused))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(protocol, "judge", says_it_on_a_page_too)
        done, left, ledger = prove(every, folder, jobs=1, watch=watch(), asked=ASKED)
    proof = Proof(**ASKED, trials=done, not_made=left, head=ledger.head, seconds=1.0)
    show(folder, proof, ledger)
    return folder


@pytest.fixture
def copy(shown: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(shown, tmp_path / "copy"))


def entries_of(out: Path) -> list[Entry]:
    return list(read_ledger((out / LEDGER).read_text()))


def forged(out: Path, change: Callable[[dict[str, object]], None]) -> None:
    """`proof.json` changed, and its hash in the last entry with it."""
    proof = json.loads((out / PROOF).read_text())
    change(proof)
    (out / PROOF).write_text(json.dumps(proof))
    *lines, last = (out / LEDGER).read_text().splitlines()
    entry = json.loads(last)
    entry["sha256"][PROOF] = sha256_of((out / PROOF).read_bytes())
    (out / LEDGER).write_text("\n".join((*lines, json.dumps(entry, sort_keys=True))) + "\n")


def test_what_was_shown_holds(shown: Path) -> None:
    found = check(shown)
    assert (found.opened, found.broken) == (2, ())
    events = [e.event for e in entries_of(shown)]
    assert events[-4:] == ["compared", "compared", LEFT, SHOWN]


def test_of_an_earlier_version_it_is_said_what_can_check_it(copy: Path) -> None:
    """And nothing else: what it did otherwise is no forgery."""
    forged(copy, lambda proof: proof.update(schema_version=1))
    (copy / LEDGER).write_text("written otherwise")
    with pytest.raises(OtherVersionError, match=r"version 1, .* with the program that made it"):
        check(copy)


@pytest.mark.parametrize(
    "file", [f"{WRITTEN}/{VERDICT}", f"{WRITTEN}/{SAID}", TRUTH, SEALED, f"{QUESTION}/pack.toml"]
)
def test_a_file_that_is_changed_afterwards_is_found(copy: Path, file: str) -> None:
    path = copy / ONE / file
    path.write_bytes(path.read_bytes().replace(b"0", b"1", 1) + b" ")
    found = check(copy).broken
    assert any(text.startswith("trial-001: ") and "is not what was" in text for text in found)
    path.unlink()
    assert any("missing" in text or QUESTION in text for text in check(copy).broken)


@pytest.mark.parametrize("file", [PROOF, PAGE])
def test_what_is_shown_and_changed_or_removed_is_found(copy: Path, file: str) -> None:
    (copy / file).write_text((copy / file).read_text().replace("wrong", "right"))
    assert f"{file} is not what was {SHOWN}" in check(copy).broken
    (copy / file).unlink()
    assert f"{file} is missing" in check(copy).broken


def outcome(proof: dict[str, object]) -> None:
    proof["trials"][1]["outcome"] = "right"  # type: ignore[index]


def effects(proof: dict[str, object]) -> None:
    proof["trials"][1]["named"] = []  # type: ignore[index]


def error(proof: dict[str, object]) -> None:
    proof["trials"][0]["held_out_after_mv"] *= 0.9  # type: ignore[index]


def share(proof: dict[str, object]) -> None:
    proof["classes"][0]["outcomes"]["right"] += 1  # type: ignore[index]


def left_out(proof: dict[str, object]) -> None:
    del proof["trials"][1]  # type: ignore[attr-defined]


def baseline(proof: dict[str, object]) -> None:
    proof["trials"][0]["baselines"][0]["held_out_mv"] *= 2  # type: ignore[index]


def channel(proof: dict[str, object]) -> None:
    proof["trials"][0]["channels"][0]["rms_named_k"] *= 0.5  # type: ignore[index]


def capacity(proof: dict[str, object]) -> None:
    proof["trials"][0]["capacity_ah"] = 2.0  # type: ignore[index]


def not_made(proof: dict[str, object]) -> None:
    proof["not_made"] = []


def code(proof: dict[str, object]) -> None:
    proof["code"] = "0" * 64


def seed(proof: dict[str, object]) -> None:
    proof["seed"] = 8


def source(proof: dict[str, object]) -> None:
    proof["trials"][1]["source"] = "another cell"  # type: ignore[index]


def seconds(proof: dict[str, object]) -> None:
    proof["trials"][1]["seconds"] = 1.0  # type: ignore[index]


@pytest.mark.parametrize(
    "change",
    [
        outcome,
        effects,
        error,
        share,
        left_out,
        baseline,
        channel,
        capacity,
        not_made,
        code,
        seed,
        source,
        seconds,
    ],
)
def test_a_proof_that_says_what_its_trials_do_not_is_found_though_its_hash_is_changed_too(
    copy: Path, change: Callable[[dict[str, object]], None]
) -> None:
    forged(copy, change)
    assert any(text.startswith(PROOF) for text in check(copy).broken)


def test_verdicts_of_two_engines_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever changes the code while trials are judged has no verdicts of one tool."""
    code = iter([ASKED["code"], "b"])
    monkeypatch.setattr(protocol, "code", lambda: next(code))
    monkeypatch.setattr(protocol, "judge", says_it_on_a_page_too)
    every = [trials.trial(f"trial-00{k}", 0.0) for k in (1, 2)]
    done, left, ledger = prove(every, tmp_path, jobs=1, watch=watch(), asked=ASKED)
    proof = Proof(**ASKED, trials=done, not_made=left, head=ledger.head, seconds=1.0)
    show(tmp_path, proof, ledger)
    (said,) = check(tmp_path).broken
    assert said.endswith(": judged by other code than the run began with")


def test_trials_and_files_that_the_ledger_does_not_know_are_found(copy: Path) -> None:
    shutil.copytree(copy / ONE, copy / TRIALS / "trial-009")
    (copy / ONE / WRITTEN / "more.html").write_text("")
    assert set(check(copy).broken) == {
        "trial-009: the ledger knows no such trial",
        f"trial-001: the ledger knows no {WRITTEN}/more.html",
    }


@pytest.mark.parametrize("left", [0, 1, 3, 5, 6, 7, 9, 10])
def test_a_ledger_that_was_cut_is_found_whatever_else_is_gone(copy: Path, left: int) -> None:
    lines = (copy / LEDGER).read_text().splitlines(keepends=True)
    (copy / LEDGER).write_text("".join(lines[:left]))
    assert check(copy).broken
    for file in (PROOF, PAGE):
        (copy / file).unlink()
    found = check(copy).broken
    assert f"{PROOF} is missing" in found
    assert ("no trial was opened" in found) == (left < 6)


@pytest.mark.parametrize("text", ["{", "{}", "[]", "7", '{"trials": 3}', '{"trials": [{}]}'])
def test_a_proof_that_is_none_is_found(copy: Path, text: str) -> None:
    (copy / PROOF).write_text(text)
    assert any(t.startswith(f"{PROOF} is not made") for t in check(copy).broken)


def test_a_first_entry_without_the_hash_of_what_was_asked_for_is_found(copy: Path) -> None:
    ledger = Ledger(copy / LEDGER)
    ledger.append(BEGUN, "", {})
    assert f"{LEDGER}: its first entry, of {ASKED_FILE}, has no hash of it" in check(copy).broken


def test_damaged_files_are_broken_and_no_fault_of_ours(copy: Path) -> None:
    (copy / ONE / QUESTION / "more").mkdir()
    (copy / ONE / TRUTH).unlink()
    (copy / ONE / TRUTH).mkdir()
    found = check(copy).broken
    assert any(t.startswith(f"trial-001: {QUESTION} cannot be read") for t in found)
    assert any(t.startswith(f"trial-001: {TRUTH} cannot be read") for t in found)
    (copy / LEDGER).write_bytes(b"\xff\xfe" + (copy / LEDGER).read_bytes())
    with pytest.raises(LedgerError, match="no text"):
        check(copy)
    (copy / LEDGER).write_text(
        json.dumps(
            {"number": 0, "utc": 1, "event": "sealed", "trial": "a", "sha256": [], "key": "",
             "before": FIRST}
        )
    )  # fmt: skip
    with pytest.raises(LedgerError, match="entry 0"):
        check(copy)


def test_the_hashes_of_what_is_shown_are_those_of_the_files(shown: Path) -> None:
    last = entries_of(shown)[-1]
    assert last.sha256 == {f: sha256_of((shown / f).read_bytes()) for f in (PROOF, PAGE)}
