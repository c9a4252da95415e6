"""Sealed, judged, opened: in that order, and whoever changes anything is found out."""

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from datetime import datetime
from functools import partial
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("cryptography", reason="truths are sealed with `cryptography`")

from proof import run as protocol
from proof.check import check
from proof.judge import FAILED, VERDICT, Verdict
from proof.ledger import BEGUN, EVENTS, Ledger, LedgerError, read_ledger
from proof.outcome import Judged, NotMade, Outcome, Proof
from proof.page.protocol import protocol as protocol_of
from proof.places import LEDGER, PAGE, PROOF, QUESTION, SEALED, TRUTH, WRITTEN
from proof.run import Watch, code, prove
from proof.seal import seal, truth_of, truth_text, unseal
from proof.shown import show
from proof.trial import Trial
from tests.proof import trials
from tests.proof.proof_example import proof, recorded, simulated

Results = tuple[tuple[Judged, ...], tuple[NotMade, ...], Ledger]
ASKED: Mapping[str, Any] = {
    "seed": 7, "command": "twin prove", "versions": {"twin": "0"}, "code": code(),
}  # fmt: skip
NAMED: Mapping[str, Any] = {
    "verdict": "named",
    "effects": [
        {
            "id": "series_resistance", "probability": 0.99, "equivalent": ["film_resistance"],
            "instead": {"film_resistance": []},
            "parameters": [
                {"name": "resistance_ohm", "value": 0.0202, "std": 1e-4, "unit": "Ohm"}
            ],
        }
    ],
    "rmse_mv": {
        "noise_floor": 8.0, "before": 100.0, "after": 8.0, "holdout_before": 100.0,
        "holdout_after": 8.1,
    },
}  # fmt: skip


def watch() -> Watch:
    return Watch(tell=lambda *_: None, stop=lambda: False)


def says_resistance(options: Sequence[str], files: Path, out: Path) -> Verdict:
    """In place of the judge: what it is given is looked at, what it writes is known."""
    assert "--floor-mv" not in options
    assert sorted(p.name for p in files.iterdir()) == ["flight-1.csv", "held-out.csv", "pack.toml"]
    trial = files.parent
    assert sorted(p.name for p in trial.iterdir()) == [QUESTION, SEALED]
    token = (trial / SEALED).read_bytes()
    assert b"series_resistance" not in token
    out.mkdir()
    (out / VERDICT).write_text(json.dumps(NAMED))
    return Verdict(content=NAMED, seconds=0.1)


def entered(folder: Path, *events: tuple[str, str]) -> str:
    """A ledger of them, after the first entry."""
    ledger = Ledger(folder / LEDGER)
    for event, trial in ((BEGUN, ""), *events):
        ledger.append(event, trial, {"file": "0" * 64})
    return (folder / LEDGER).read_text()


@pytest.fixture(scope="module")
def proven(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Results]:
    """A trial, a control, two that cannot be made; the judge always names a resistance."""
    folder = tmp_path_factory.mktemp("proven")
    every = [
        trials.trial("trial-001", trials.OHM),
        trials.trial("trial-002", 0.0),
        Trial(name="trial-003", source="nobody", make=trials.refused),
        Trial(name="trial-004", source="nobody", make=trials.broken),
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(protocol, "judge", says_resistance)
        return folder, prove(every, folder, jobs=1, watch=watch())


def test_every_verdict_is_written_before_any_truth_is_opened(proven: tuple[Path, Results]) -> None:
    folder, _ = proven
    entries = read_ledger((folder / LEDGER).read_text())
    both = [event for event in EVENTS for _ in range(2)]
    assert [e.event for e in entries] == ["begun", *both, "left out"]
    assert list(entries[-1].sha256) == ["trial-003", "trial-004"]


def test_outcomes_numbers_and_channels_of_what_was_opened(proven: tuple[Path, Results]) -> None:
    done, left, _ = proven[1]
    assert [(j.name, j.outcome) for j in done] == [
        ("trial-001", Outcome.RIGHT),
        ("trial-002", Outcome.WRONG),  # named where nothing is: a false alarm
    ]
    (number,) = done[0].sized
    assert (number.true, number.found) == (trials.OHM, 0.0202)
    (channel,) = done[0].channels
    assert channel.rms_before == pytest.approx(1.0, abs=1e-9)  # it was made 1 K warmer
    refit, correction, other = done[0].baselines
    assert [b.id for b in (refit, correction, other)] == ["refit", "correction", "random"]
    assert refit.held_out_V < 2 * done[0].noise_V  # the refit has that resistance too
    assert [(n.name, n.reason) for n in left] == [
        ("trial-003", "not sealed: there is no recording of it"),
        ("trial-004", "not sealed: ZeroDivisionError: a fault of ours"),
    ]


def test_a_judge_that_fails_is_counted_and_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an effect and of a control: neither is right, and every truth is opened."""
    monkeypatch.setattr("proof.judge.sys", SimpleNamespace(executable="false"))
    every = [trials.trial("trial-001", trials.OHM), trials.trial("trial-002", 0.0)]
    done, left, ledger = prove(every, tmp_path, jobs=1, watch=watch(), asked=ASKED)
    assert not left
    assert [(j.verdict, j.outcome) for j in done] == [(FAILED, Outcome.MISSED)] * 2
    proof = Proof(**ASKED, trials=done, not_made=(), head=ledger.head, seconds=1.0)
    show(tmp_path, proof, ledger)
    assert not check(tmp_path).broken
    page = (tmp_path / PAGE).read_text()
    assert page.count("the tool failed") >= 2
    targets = {t["id"]: t for t in json.loads((tmp_path / PROOF).read_text())["targets"]}
    assert (targets["strong"]["within"], targets["strong"]["of"]) == (0, 1)
    assert targets["false alarms"]["measured_count"] == 1


def test_what_is_sealed_opens_by_its_key_alone() -> None:
    truth = trials.true_of(trials.OHM, trials.asked(trials.OHM))
    token, key = seal(truth)
    assert truth_text(unseal(token, key)) == truth_text(truth)
    assert truth_of(truth_text(truth)).effects == truth.effects
    _, other = seal(truth)
    with pytest.raises(ValueError, match="the key does not open"):
        unseal(token, other)


def test_a_ledger_with_a_line_changed_put_in_or_taken_out_is_broken(tmp_path: Path) -> None:
    lines = entered(tmp_path, *((event, "trial-001") for event in EVENTS)).splitlines()
    assert len(read_ledger("\n".join(lines))) == 1 + len(EVENTS)
    for bad in (
        [lines[0], lines[1].replace("trial-001", "trial-002"), *lines[2:]],
        [lines[0], lines[0], *lines[1:]],
        [lines[0], lines[2]],
        ["{}", *lines],
        [lines[1], lines[0], lines[2]],
    ):
        with pytest.raises(LedgerError, match="entry"):
            read_ledger("\n".join(bad))


def test_a_truth_that_is_opened_before_its_verdict_is_refused(tmp_path: Path) -> None:
    events = ("sealed", "opened", "judged")
    with pytest.raises(LedgerError, match="expected sealed, judged, opened"):
        read_ledger(entered(tmp_path, *((event, "trial-001") for event in events)))


@pytest.mark.parametrize("first", ["opened", "judged"])
def test_a_trial_that_is_sealed_when_another_was_judged_or_opened_is_refused(
    tmp_path: Path, first: str
) -> None:
    """Whoever makes trial after trial may write each truth to fit."""
    before = EVENTS.index(first)
    events = (
        *((event, trial) for event in EVENTS[:before] for trial in "ab"),
        *((event, "a") for event in EVENTS[before:]),
        *((event, "b") for event in EVENTS[before:]),
    )
    with pytest.raises(LedgerError, match=f"b is {first} when a was compared"):
        read_ledger(entered(tmp_path, *events))


def test_a_ledger_that_does_not_begin_with_what_was_asked_for_is_refused(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / LEDGER)
    for event in EVENTS:
        ledger.append(event, "trial-001", {})
    with pytest.raises(LedgerError, match="entry 0: sealed: expected begun"):
        read_ledger((tmp_path / LEDGER).read_text())


def test_times_that_go_back_are_refused_and_a_clock_that_is_set_back_stands_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Clock(datetime):
        seconds = iter([5, 5, 4, 6])

        @classmethod
        def now(cls, tz: Any = None) -> "Clock":
            return cls(2026, 1, 1, 0, 0, next(cls.seconds), tzinfo=tz)

    monkeypatch.setattr("proof.ledger.datetime", Clock)
    text = entered(tmp_path, *((event, "trial-001") for event in EVENTS[:3]))
    assert [e.at.second for e in read_ledger(text)] == [5, 5, 5, 6]
    for bad, said in (("2025-12-31T00:00:00+00:00", "but the one before it"), ("noon", "no time")):
        *lines, last = text.splitlines()
        last = json.dumps(json.loads(last) | {"utc": bad}, sort_keys=True)
        with pytest.raises(LedgerError, match=f"entry 3: .*{said}"):
            read_ledger("\n".join((*lines, last)))


@pytest.mark.parametrize(("jobs", "at_work"), [(1, 1), (2, 2)])
def test_after_a_stop_only_the_trials_at_work_are_finished(
    tmp_path: Path, jobs: int, at_work: int
) -> None:
    """The pool would begin with more; what it holds ahead cannot be cancelled."""
    begun: list[str] = []
    seen: list[tuple[int, int]] = []
    told = Watch(tell=lambda _, n, of, __: seen.append((n, of)), stop=lambda: bool(begun[1:]))
    run = protocol._Run(tmp_path, jobs, told)

    def work(name: str) -> str:
        begun.append(name)
        return name.upper()

    with ThreadPoolExecutor(jobs) as pool:
        asked = {name: partial(pool.submit, work, name) for name in "abcdef"}
        found = run._gathered("sealed", asked)
    assert 2 <= len(found) <= 1 + at_work
    assert begun == list("abcdef")[: len(found)]
    assert seen == [(k, 6) for k in range(1, len(found) + 1)]
    assert run._gathered("judged", asked) == {}
    assert run.reasons == {}


def test_a_stop_while_truths_are_made_begins_no_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(protocol, "judge", says_resistance)
    seen: list[str] = []
    told = Watch(tell=lambda phase, *_: seen.append(phase), stop=lambda: bool(seen))
    every = [trials.trial(f"trial-{k:03d}", 0.0) for k in (1, 2, 3)]
    done, left, _ = prove(every, tmp_path, jobs=1, watch=told)
    assert seen == ["sealed"]
    assert not done
    assert [n.reason for n in left] == ["stopped before"] * 3
    assert [e.event for e in read_ledger((tmp_path / LEDGER).read_text())] == [
        "begun",
        "sealed",
        "left out",
    ]


def test_a_pool_that_broke_costs_its_trials_and_is_told(tmp_path: Path) -> None:
    def broken() -> Future[int]:
        raise BrokenProcessPool("a worker died")

    run = protocol._Run(tmp_path, 1, watch())
    assert run._gathered("sealed", {"a": broken, "b": broken}) == {}
    assert run.reasons == dict.fromkeys("ab", "not sealed: BrokenProcessPool: a worker died")


def test_of_an_earlier_run_in_the_same_folder_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(protocol, "judge", says_resistance)
    names = ("trial-001", "trial-002", "trial-003")
    for name, part in product(names, (f"{QUESTION}/flight-2.csv", f"{WRITTEN}/{VERDICT}", TRUTH)):
        path = tmp_path / "trials" / name / part
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("{}")
    (tmp_path / "trials" / "trial-notes.txt").write_text("mine")
    refused = Trial(name=names[1], source="nobody", make=trials.refused)
    done, left, _ = prove([trials.trial(names[0], 0.0), refused], tmp_path, jobs=1, watch=watch())
    assert [j.name for j in done] == [names[0]]  # `says_resistance` looks at its files
    assert [n.reason for n in left] == ["not sealed: there is no recording of it"]
    assert {p.name for p in (tmp_path / "trials").iterdir()} == {names[0], "trial-notes.txt"}


def test_after_a_stop_what_was_judged_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(protocol, "judge", says_resistance)
    seen: list[str] = []
    told = Watch(tell=lambda phase, *_: seen.append(phase), stop=lambda: seen.count("judged") == 1)
    every = [trials.trial(f"trial-{k:03d}", 0.0) for k in (1, 2, 3)]
    done, left, _ = prove(every, tmp_path, jobs=1, watch=told)
    assert len(done) == 1
    assert [n.reason for n in left] == ["stopped before"] * 2
    events = [e.event for e in read_ledger((tmp_path / LEDGER).read_text())]
    assert events.count("opened") == len(done)


def test_a_comparison_that_fails_takes_no_verdict_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It counts, what there is to compare it with is not there, and why is shown."""

    def broken(*_: object) -> dict[str, Any]:
        raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(protocol, "judge", says_resistance)
    monkeypatch.setattr(protocol, "_compared", broken)
    monkeypatch.setattr(protocol, "_processes", ThreadPoolExecutor)
    one = [trials.trial("trial-001", 0.0)]
    done, left, ledger = prove(one, tmp_path, jobs=1, watch=watch(), asked=ASKED)
    assert not left
    assert [j.outcome for j in done] == [Outcome.WRONG]
    assert done[0].not_compared == "not compared: ZeroDivisionError: a fault of ours"
    proof = Proof(**ASKED, trials=done, not_made=(), head=ledger.head, seconds=1.0)
    show(tmp_path, proof, ledger)
    assert not check(tmp_path).broken
    assert "not compared: ZeroDivisionError" in (tmp_path / PAGE).read_text()


def test_a_damaged_truth_costs_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def damages(options: Sequence[str], files: Path, out: Path) -> Verdict:
        said = says_resistance(options, files, out)
        if files.parent.name == "trial-001":
            (files.parent / SEALED).write_bytes(b"no token")
        return said

    monkeypatch.setattr(protocol, "judge", damages)
    every = [trials.trial(f"trial-{k:03d}", 0.0) for k in (1, 2)]
    done, left, _ = prove(every, tmp_path, jobs=1, watch=watch())
    assert [j.name for j in done] == ["trial-002"]
    assert [n.reason for n in left] == [
        "not opened: ValueError: the key does not open what was sealed, or it was changed"
    ]


@pytest.mark.parametrize("text", ["{}", "[]", '{"kind": "control"}'])
def test_what_is_no_truth_is_told(text: str) -> None:
    from cryptography.fernet import Fernet

    key = Fernet.generate_key()
    with pytest.raises(ValueError, match="no truth of this version"):
        unseal(Fernet(key).encrypt(text.encode()), key.decode())


@pytest.mark.parametrize(
    ("of", "drawn", "fixed_list"),
    [(simulated(), True, False), (recorded(), False, True), (simulated() + recorded(), True, True)],
)
def test_another_seed_is_said_to_draw_what_it_draws(
    of: list[Judged], *, drawn: bool, fixed_list: bool
) -> None:
    (note,) = (r.note for r in protocol_of(proof(of)).rows if r.label == "To run it again")
    assert ("other effects, sizes and flights are drawn" in note) == drawn
    assert ("the list of recorded trials is fixed" in note) == fixed_list


def test_the_page_says_which_code_ran_and_what_files_that_agree_do_not_show() -> None:
    page = protocol_of(proof())
    assert proof().code in [row.value for row in page.rows]
    assert "came first is shown only by a hash that was published before" in " ".join(page.lead)
