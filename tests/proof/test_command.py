"""`twin prove`: files, words and exit codes."""

import json
from importlib import resources
from pathlib import Path

import jsonschema
import pytest
from click.testing import CliRunner, Result

pytest.importorskip("cryptography", reason="truths are sealed with `cryptography`")

from analyze.checks import WrongUse
from analyze.workbench.__main__ import main
from proof import command
from proof import run as protocol
from proof.places import LEDGER
from proof.recorded import trials as lists
from proof.trial import Trial
from tests.proof import trials
from tests.proof.test_protocol import says_resistance


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["prove", *map(str, arguments)])


def few(_seed: int, _count: int, _solves: Path) -> tuple[Trial, ...]:
    """In place of those by PyBaMM."""
    return (
        trials.trial("a", trials.OHM),
        Trial(name="b", source="nobody", make=trials.refused),
    )


def test_files_a_line_a_trial_and_a_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "NEEDED", ("cryptography",))
    monkeypatch.setattr(command, "simulated", few)
    monkeypatch.setattr(protocol, "judge", says_resistance)
    done = call("--out", tmp_path, "--seed", 3, "--trials", 2, "--jobs", 1)
    assert done.exit_code == 1, done.output  # one could not be made
    assert "right    1 of 1, 1 not made" in done.output
    assert "there is no recording of it" in done.output
    written = json.loads((tmp_path / "proof.json").read_text())
    schema = (resources.files("proof") / "proof.schema.json").read_text(encoding="utf-8")
    jsonschema.validate(written, json.loads(schema))
    assert "--seed 3 --trials 2" in json.dumps(written)
    page = (tmp_path / "proof.html").read_text()
    assert "twin prove --seed 3" in page
    assert "there is no recording of it" in page
    checked = call("--check", tmp_path)
    assert checked.exit_code == 0, checked.output
    assert "holds    1 trials" in checked.output
    ledger = tmp_path / LEDGER
    ledger.write_text(ledger.read_text().replace("judged", "guessed"))
    assert call("--check", tmp_path).exit_code == 1


def test_wrong_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = call("--check", tmp_path)
    assert nothing.exit_code == 2
    assert f"{LEDGER} is missing; expected a folder that twin prove wrote" in nothing.output
    assert "Errno" not in nothing.output
    monkeypatch.setattr(command, "NEEDED", ("cryptography", "no_such_simulator"))
    missing = call("--out", tmp_path / "out")
    assert missing.exit_code == 2
    assert "no_such_simulator not installed" in missing.output
    assert "[proof]" in missing.output
    monkeypatch.setattr(command, "NEEDED", ())
    none = call("--out", tmp_path / "out", "--trials", 0)
    assert none.exit_code == 2
    assert "--trials or --recordings" in none.output
    assert not (tmp_path / "out").exists()  # nothing is left of what was refused
    file = tmp_path / "file"
    file.write_text("")
    assert call("--out", file / "out").exit_code == 2


@pytest.mark.parametrize("name", [LEDGER, "proof.json", "proof.html", "trials"])
def test_what_is_in_the_way_is_told_before_anything_is_touched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(command, "NEEDED", ())
    (tmp_path / LEDGER).write_text("of an earlier run")
    if name == "trials":
        (tmp_path / name).write_text("notes")
    else:
        (tmp_path / name).unlink(missing_ok=True)
        (tmp_path / name).mkdir()
    refused = call("--out", tmp_path, "--trials", 2)
    assert refused.exit_code == 2
    assert f"{name} is in the way" in refused.output
    assert name == LEDGER or (tmp_path / LEDGER).read_text() == "of an earlier run"


def test_a_seed_that_nobody_gave_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "NEEDED", ())
    seen: list[int] = []

    def one(seed: int, _count: int, _solves: Path) -> tuple[Trial, ...]:
        seen.append(seed)
        return few(seed, _count, _solves)[1:]

    def stops(*_: object, **_also: object) -> None:
        raise WrongUse("before a trial is made")

    monkeypatch.setattr(command, "simulated", one)
    monkeypatch.setattr(command, "prove", stops)
    for _ in range(2):
        told = call("--out", tmp_path)
        assert f"seed     {seen[-1]}: 1 trials" in told.output
    assert len(set(seen)) == 2  # from the system's randomness: equal once in 10^9


def test_the_command_of_a_proof_names_its_recordings_as_they_were_named(tmp_path: Path) -> None:
    request = command.Request(
        out=tmp_path, seed=3, trials=2, recordings=Path("../of ours"), jobs=1, check=None
    )
    said = "twin prove --seed 3 --trials 2 --recordings '../of ours'"
    assert command._again(request, 3) == said


def test_names_of_a_proof_tell_nothing_and_the_order_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "simulated", few)
    request = command.Request(
        out=tmp_path, seed=3, trials=2, recordings=tmp_path, jobs=1, check=None
    )
    listed = [*few(3, 2, tmp_path), *lists.recorded(tmp_path, tmp_path)]
    asked = command._trials(request, 3)
    assert [t.name for t in asked] == [f"trial-{k:03d}" for k in range(1, len(listed) + 1)]
    assert [t.source for t in asked] != [t.source for t in listed]
    assert sorted(t.source for t in asked) == sorted(t.source for t in listed)


def test_a_truth_says_what_its_trial_is_called_in_its_list(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [t.name for t in lists.recorded(tmp_path, tmp_path)]
    assert len(set(names)) == len(names)
    for each in ("heat_trials", "ageing_trials", "weak_trials"):
        monkeypatch.setattr(lists, each, lambda *_: ())
    monkeypatch.setattr(lists, "fault_trials", lambda *_: (trials.trial("trial-k09", trials.OHM),))
    ((_, truth),) = (t.make() for t in lists.recorded(tmp_path, tmp_path))
    assert truth.details == {lists.LISTED: "trial-k09"}
