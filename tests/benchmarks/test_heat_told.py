"""What share of the heat is told: what the docstring of `SelfHeating` says, and its limit."""

from dataclasses import replace

import pytest

from benchmarks.heat_told import share_told
from twin.builtin import load_cell
from twin.cell import Cell


@pytest.mark.parametrize(("name", "share"), [("lg_m50", 0.67), ("lipo_2200", 0.93)])
def test_so_much_is_told_at_1C_and_25_degrees(name: str, share: float) -> None:
    assert share_told(name, 1.0, 298.15) == pytest.approx(share, abs=0.005)  # as it is rounded


def test_all_is_told_where_particles_have_no_gradient(monkeypatch: pytest.MonkeyPatch) -> None:
    def fast(name: str) -> Cell:
        cell = load_cell(name)
        small = (replace(e, particle_radius_m=e.particle_radius_m / 100,
                         specific_area_m2_m3=e.specific_area_m2_m3 * 100)
                 for e in (cell.negative, cell.positive))  # fmt: skip
        negative, positive = small
        return replace(cell, negative=negative, positive=positive)

    monkeypatch.setattr("benchmarks.heat_told.load_cell", fast)
    assert share_told("lg_m50", 1.0, 298.15) == pytest.approx(1.0, abs=1e-3)
