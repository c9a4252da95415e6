"""Whoever changes anything of a proof afterwards is found out."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("cryptography", reason="truths are sealed with `cryptography`")

from proof import run as protocol
from proof.check import check
from proof.judge import SAID, VERDICT, Verdict
from proof.ledger import FIRST, SHOWN, Entry, Ledger, LedgerError, read_ledger, sha256_of
from proof.outcome import Proof
from proof.places import LEDGER, PAGE, PROOF, QUESTION, SEALED, TRIALS, TRUTH, WRITTEN
from proof.question import Question
from proof.run import prove
from proof.shown import show
from tests.proof import trials
from tests.proof.test_protocol import says_resistance, watch

ONE = f"{TRIALS}/trial-001"


def says_it_on_a_page_too(question: Question, files: Path, out: Path) -> Verdict:
    verdict = says_resistance(question, files, out)
    (out / SAID).write_text("<p>A resistance was left out.</p>")
    return verdict


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trial and a control, named and shown."""
    folder = tmp_path_factory.mktemp("shown")
    every = [trials.trial("trial-001", trials.OHM), trials.trial("trial-002", 0.0)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(protocol, "judge", says_it_on_a_page_too)
        done, left, ledger = prove(every, folder, jobs=1, watch=watch())
    proof = Proof(
        seed=7, command="twin prove", trials=done, not_made=left, versions={}, head=ledger.head,
        seconds=1.0,
    )  # fmt: skip
    show(folder, proof, ledger)
    return folder


@pytest.fixture
def copy(shown: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(shown, tmp_path / "copy"))


def entries_of(out: Path) -> list[Entry]:
    return list(read_ledger((out / LEDGER).read_text()))


def as_by_an_earlier_version(out: Path) -> None:
    """Its ledger has neither what is shown nor the pages of the verdicts."""
    old, before = entries_of(out)[:-1], FIRST
    ledger = Ledger(out / LEDGER)
    for e in old:
        hashes = {name: h for name, h in e.sha256.items() if name != SAID}
        ledger.append(e.event, e.trial, hashes, key=e.key)
        assert before != (before := ledger.head)
    by_event = {(e.trial, e.event): e for e in entries_of(out)}
    proof = json.loads((out / PROOF).read_text())
    for trial in proof["trials"]:
        for event, file in (("sealed", SEALED), ("judged", VERDICT), ("opened", TRUTH)):
            stamp = by_event[trial["name"], event].stamp(file)
            trial[event] = {"utc": stamp.utc, "sha256": stamp.sha256, "entry": stamp.entry}
    (out / PROOF).write_text(json.dumps(proof | {"ledger_head": ledger.head}))


def test_what_was_shown_holds(shown: Path) -> None:
    found = check(shown)
    assert (found.opened, found.broken, found.unchecked) == (2, (), ())
    assert entries_of(shown)[-1].event == SHOWN


def test_of_an_earlier_version_it_is_said_what_is_not_checked(copy: Path) -> None:
    as_by_an_earlier_version(copy)
    found = check(copy)
    assert (found.opened, found.broken) == (2, ())
    assert found.unchecked == (PAGE, f"{WRITTEN}/{SAID} of each trial")


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


@pytest.mark.parametrize("change", [outcome, effects, error, share, left_out])
def test_a_proof_that_says_what_its_trials_do_not_is_found_without_its_hash(
    copy: Path, change: Callable[[dict[str, object]], None]
) -> None:
    as_by_an_earlier_version(copy)
    proof = json.loads((copy / PROOF).read_text())
    change(proof)
    (copy / PROOF).write_text(json.dumps(proof))
    assert any(text.startswith(PROOF) for text in check(copy).broken)


def test_trials_and_files_that_the_ledger_does_not_know_are_found(copy: Path) -> None:
    shutil.copytree(copy / ONE, copy / TRIALS / "trial-009")
    (copy / ONE / WRITTEN / "more.html").write_text("")
    assert set(check(copy).broken) == {
        "trial-009: the ledger knows no such trial",
        f"trial-001: the ledger knows no {WRITTEN}/more.html",
    }


@pytest.mark.parametrize("left", [0, 2, 4, 5, 6])
def test_a_ledger_that_was_cut_is_found_whatever_else_is_gone(copy: Path, left: int) -> None:
    lines = (copy / LEDGER).read_text().splitlines(keepends=True)
    (copy / LEDGER).write_text("".join(lines[:left]))
    assert check(copy).broken
    for file in (PROOF, PAGE):
        (copy / file).unlink()
    found = check(copy).broken
    assert f"{PROOF} is missing" in found
    assert ("no trial was opened" in found) == (left < 5)


@pytest.mark.parametrize("text", ["{", "{}", "[]", "7", '{"trials": 3}', '{"trials": [{}]}'])
def test_a_proof_that_is_none_is_found(copy: Path, text: str) -> None:
    (copy / PROOF).write_text(text)
    assert any(t.startswith(f"{PROOF} is not made") for t in check(copy).broken)


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
