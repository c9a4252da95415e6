"""Base twins that come with the program are those that the code makes."""

import json
from pathlib import Path

import pytest

from proof.recorded import shipped
from proof.recorded.heat_bases import CELLS
from proof.recorded.measured import NotHere
from twin.builtin import load_cell

SHARED = Path(__file__).parents[3] / "shared"


def test_what_a_run_left_is_there_for_another_and_replaces_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    for name in ("base-a/base.json", "base-a/cell.bpx.json", "base-a/cell.fit.json",
                 "base-half/cell.bpx.json", "cell-b.json"):  # fmt: skip
        (one / name).parent.mkdir(parents=True, exist_ok=True)
        (one / name).write_text(json.dumps({"of": name}))
    (tmp_path / shipped.FILE).write_text(json.dumps(shipped.collected(one)))
    monkeypatch.setattr(shipped.resources, "files", lambda _: tmp_path)
    (other / "base-a").mkdir(parents=True)
    (other / "base-a" / "cell.bpx.json").write_text("{}")
    assert shipped.put_into(other) == 2
    files = {p.relative_to(other).as_posix(): p for p in other.rglob("*.json")}
    assert set(files) == {"base-a/base.json", "base-a/cell.bpx.json", "cell-b.json"}
    assert files["base-a/cell.bpx.json"].read_text() == "{}"
    assert json.loads(files["cell-b.json"].read_text()) == {"of": "cell-b.json"}


def test_every_cell_of_it_can_be_read(tmp_path: Path) -> None:
    shipped.put_into(tmp_path)
    cells = list(tmp_path.rglob("*.bpx.json"))
    assert cells
    for cell in cells:
        assert load_cell(cell).nominal_capacity_C > 0.0


@pytest.mark.long
def test_one_that_is_made_anew_is_the_one_that_is_shipped(tmp_path: Path) -> None:
    """Of the Melasta, to what another machine rounds otherwise: a hundredth of a millivolt."""
    shipped.put_into(tmp_path / "shipped")
    try:
        base = CELLS["melasta"].base(SHARED, tmp_path / "anew", ("5C", "9.1C"))
    except NotHere as e:
        pytest.skip(str(e))
    theirs = CELLS["melasta"].base(SHARED, tmp_path / "shipped", ("5C", "9.1C"))
    made = {p.name for p in (tmp_path / "anew").iterdir()}
    assert made <= {p.name for p in (tmp_path / "shipped").iterdir()}
    assert base.fitted_V == pytest.approx(theirs.fitted_V, abs=1e-5)
    assert base.errors_V == pytest.approx(theirs.errors_V, abs=1e-4)
