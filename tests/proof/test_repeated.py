"""`--check DIR --again N`: what the tool and the seed do not give again is broken."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cryptography", reason="truths are sealed with `cryptography`")

from proof import command, repeated
from proof import run as protocol
from proof.judge import STOPPED, VERDICT, Verdict
from proof.places import ASKED, JUDGED, PROOF, QUESTION, TRIALS, TRUTH, WRITTEN
from proof.simulated.draw import PYBAMM
from proof.trial import Trial
from tests.proof import trials
from tests.proof.test_command import call
from tests.proof.test_protocol import NAMED, says_resistance

OWN = f"{TRIALS}/trial-001"
Change = Callable[[dict[str, Any]], object]


def one(_seed: int, _count: int, _solves: Path) -> tuple[Trial, ...]:
    """In place of those by PyBaMM."""
    own = trials.trial("a", trials.OHM)
    return (Trial(name="a", source=PYBAMM, make=own.make),)


@pytest.fixture(scope="module")
def proven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("proven")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "NEEDED", ("cryptography",))
        patch.setattr(command, "simulated", one)
        patch.setattr(protocol, "judge", says_resistance)
        done = call("--out", folder, "--seed", 3, "--trials", 1, "--jobs", 1)
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def copy(proven: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Judged again as it was, and made again as it was."""
    monkeypatch.setattr(repeated, "simulated", one)
    monkeypatch.setattr(repeated, "can_make", lambda: True)
    says(monkeypatch, lambda _: None)
    return Path(shutil.copytree(proven, tmp_path / "copy"))


def says(monkeypatch: pytest.MonkeyPatch, change: Change) -> None:
    content = json.loads(json.dumps(NAMED))
    change(content)

    def judge(options: Sequence[str], files: Path, out: Path) -> Verdict:
        assert options == ["flight-1.csv", "--holdout", "held-out.csv", "--pack", "pack.toml",
                           "--between", "linear"]  # fmt: skip
        assert (files / "held-out.csv").is_file()
        assert not out.exists()
        return Verdict(content=content, seconds=0.1)

    monkeypatch.setattr(repeated, "judge", judge)


def again(out: Path) -> list[str]:
    return list(repeated.repeated(out, "trial-001"))


def changed(path: Path, change: Change) -> None:
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content, indent=1))


def test_what_comes_out_again_is_told_and_what_does_not_is_exit_1(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = call("--check", copy, "--again", 5)
    assert held.exit_code == 0, held.output
    assert "code     what judged is what is installed" in held.output
    assert "again    1 of 1 trials as written (probabilities to 0.02" in held.output
    says(monkeypatch, lambda v: v.update(verdict="none", effects=[]))
    monkeypatch.setattr(command, "code", lambda: "f" * 64)
    other = call("--check", copy, "--again", 1)
    assert other.exit_code == 1
    assert "is not what is installed (ffffffffff), which may say otherwise" in other.output
    assert "broken   trial-001: named: series_resistance or film_resistance is" in other.output
    assert "judged again it is none" in other.output
    assert "0 of 1 trials as written" in other.output


def test_it_needs_a_proof_and_says_what_it_cannot_make(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "give --check DIR" in call("--again", 1).output
    monkeypatch.setattr(command, "can_make", lambda: False)
    monkeypatch.setattr(repeated, "can_make", lambda: False)
    monkeypatch.setattr(repeated, "simulated", lambda *_: ())
    held = call("--check", copy, "--again", 1)
    assert held.exit_code == 0, held.output
    assert "no truth is made again: pybamm not installed" in held.output
    (copy / PROOF).write_text((copy / PROOF).read_text() + " ")
    broken = call("--check", copy, "--again", 1)
    assert "again  " not in broken.output  # it does not hold
    assert "code     what judged is what is installed" in broken.output


def equivalent(v: dict[str, Any]) -> None:
    v["effects"][0]["equivalent"] = []


def probability(v: dict[str, Any]) -> None:
    v["effects"][0]["probability"] = 0.96


def value(v: dict[str, Any]) -> None:
    v["effects"][0]["parameters"][0]["value"] += 2e-5  # its standard error is 1e-4


def error(v: dict[str, Any]) -> None:
    v["effects"][0]["parameters"][0]["std"] *= 1.02


def parameter(v: dict[str, Any]) -> None:
    v["effects"][0]["instead"]["film_resistance"] = [
        {"name": "negative_ohm_m2", "value": 1.0, "std": None, "unit": "Ohm m2"}
    ]


def held_out(v: dict[str, Any]) -> None:
    v["rmse_mv"]["holdout_after"] = 8.3


@pytest.mark.parametrize("change", [equivalent, probability, value, error, parameter, held_out])
def test_names_and_numbers_are_compared(
    copy: Path, monkeypatch: pytest.MonkeyPatch, change: Change
) -> None:
    says(monkeypatch, change)
    assert len(again(copy)) == 1


def test_what_is_rounded_otherwise_is_the_same(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def rounded(v: dict[str, Any]) -> None:
        v["effects"][0]["probability"] -= 0.01
        v["effects"][0]["parameters"][0]["value"] += 5e-6
        v["rmse_mv"]["noise_floor"] *= 1.005

    says(monkeypatch, rounded)
    changed(copy / OWN / TRUTH, lambda t: t["numbers"][0].update(value=trials.OHM * (1 + 1e-6)))
    assert again(copy) == []


def test_a_written_error_makes_no_tolerance(copy: Path) -> None:
    """Whoever writes a value may write any error beside it."""

    def forge(v: dict[str, Any]) -> None:
        v["effects"][0]["parameters"][0].update(value=0.006, std=9.0)

    changed(copy / OWN / WRITTEN / VERDICT, forge)
    assert len(again(copy)) == 2


def test_a_truth_and_a_question_that_the_seed_does_not_give_are_broken(copy: Path) -> None:
    changed(copy / OWN / TRUTH, lambda t: t.update(effects=[["film_resistance"]]))
    path = copy / OWN / QUESTION / "flight-1.csv"
    *lines, last = path.read_text().splitlines()
    start, _, volts = last.rpartition(",")
    path.write_text("\n".join((*lines, f"{start},{float(volts) + 0.01}", "")))
    (copy / OWN / QUESTION / "more.csv").write_text("1")
    assert again(copy) == [
        f"trial-001: {TRUTH} is not what the seed gives",
        f"trial-001: {QUESTION}/flight-1.csv is not what the seed gives",
        f"trial-001: {QUESTION}/more.csv is not what the seed gives",
    ]


def test_what_the_seed_does_not_simulate_or_cannot_make_is_broken(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = Trial(name="a", source=PYBAMM, make=trials.refused)
    monkeypatch.setattr(repeated, "simulated", lambda *_: (refused,))
    (said,) = again(copy)
    assert said.endswith("by the seed it cannot be made: there is no recording of it")
    changed(copy / ASKED, lambda b: b["sources"].update({"trial-001": "a cell of ours"}))
    assert again(copy) == ["trial-001: by the seed it is no simulated trial"]


@pytest.mark.parametrize("option", ["--adopt", "/etc/passwd", "../truth.json", "--out=x"])
def test_an_option_that_no_question_has_is_not_given_to_the_tool(copy: Path, option: str) -> None:
    changed(copy / OWN / WRITTEN / JUDGED, lambda j: j["options"].append(option))
    assert again(copy) == [f"trial-001: {option!r} is no option of a question"]


def test_files_that_are_none_are_told(copy: Path) -> None:
    changed(copy / OWN / WRITTEN / JUDGED, lambda j: j.pop("options"))
    assert again(copy) == ["trial-001: cannot be done again: KeyError: 'options'"]


def test_trials_without_a_verdict_of_the_tool_are_not_drawn(tmp_path: Path) -> None:
    every = [{"name": f"trial-{k}", "verdict": "none"} for k in range(20)]
    every.append({"name": "stopped", "verdict": STOPPED})
    (tmp_path / PROOF).write_text(json.dumps({"trials": every}))
    assert set(repeated.drawn(tmp_path, 99)) == {t["name"] for t in every[:20]}
    assert len({tuple(repeated.drawn(tmp_path, 3)) for _ in range(20)}) > 1  # not always the same
