"""An aged cell, weak cells: what is asked, and the capacity of a twin in a check-up."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proof.capacity import capacity_C
from proof.recorded import leaf_module, vtc6
from proof.recorded.bodies import LEAF
from proof.recorded.measured import NotHere, RealTest
from proof.recorded.trials_ageing import ageing_trials
from proof.recorded.trials_weak import _known, in_module, weak_trials
from proof.trial import NoTrial
from proof.truth import CONTROLS
from twin.builtin import load_cell
from twin.effects import LithiumInventoryLoss
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

SHARED = Path(__file__).parents[3] / "shared"


def test_less_lithium_is_as_much_less_capacity() -> None:
    cell = load_cell("lipo_2200")
    pack, rate_A = Pack(cell=cell), cell.nominal_capacity_C / 3600 / 5
    new_C = capacity_C(pack, rate_A, cell.lower_cut_off_V)
    aged = replace(pack, effects=(LithiumInventoryLoss(lost=0.05),))
    assert new_C == pytest.approx(cell.nominal_capacity_C, rel=0.1)
    # of all lithium, more than what cycles; some of it is made up for at the empty end
    assert 0.90 < capacity_C(aged, rate_A, cell.lower_cut_off_V) / new_C < 0.97


def test_how_fast_a_cell_cools() -> None:
    time_s = np.arange(0.0, 900.0, 30.0)
    above_K = 30 * np.exp(-np.maximum(time_s - 60, 0) / 430)
    current_A = np.where(time_s < 60, 15.0, 0.0)
    test = RealTest(
        name="", time_s=time_s, current_A=current_A, voltage_V=0 * time_s,
        temperature_K=295 + above_K,
    )  # fmt: skip
    expected = vtc6.HEAT_J_K / 430 / vtc6.SURFACE_m2
    assert vtc6.cooling_W_m2_K(test, 295.0) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("make", [ageing_trials, weak_trials])
def test_no_trial_without_its_recording(make, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    for trial in make(tmp_path, tmp_path):
        with pytest.raises(NoTrial, match="no recording"):
            trial.make()


def test_part_of_a_series_is_the_sum_of_its_cells() -> None:
    try:
        whole = leaf_module.module(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    part = whole.of(("A3", "A5", "A1"))
    assert part.voltage_V == pytest.approx(whole.cell_voltage_V[:, [2, 4, 0]].sum(axis=1))
    assert part.voltage_V[-1] == pytest.approx(3.478 + 3.435 + 3.0)
    assert part.current_A is whole.current_A


def test_the_life_of_the_cell() -> None:
    try:
        own = vtc6.life(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    assert len(own.missions) == 268
    drawn = {n: own.test("", rows, after=0).drawn_C[-1] / 3600 for n, rows in own.check_ups}
    assert list(drawn) == [0, 50, 100, 150, 200, 250, 251]
    # the catalogue; its figures leave out the two pauses, along which samples 30 s apart are joined
    assert drawn[0] == pytest.approx(3.019, abs=0.02)
    assert drawn[251] == pytest.approx(2.787, abs=0.02)


def test_the_voltage_of_the_leaf_modules_is_told_no_better_than_its_file_knows_it() -> None:
    """The sum of six inputs is not the cycler's own voltage, at rest and so without any leads."""
    try:
        cells = leaf_module.module(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    text = (SHARED / leaf_module.FILE).read_text(encoding="latin-1").splitlines()
    table = list(csv.reader(text))
    first = next(k for k, row in enumerate(table) if row and row[0] == "Total Time")
    rest = 10
    own = table[first].index("Voltage")
    own_V = np.array([float(row[own]) for row in table[first + 1 : first + 1 + rest]])
    assert cells.current_A[:rest].max() < 0.1
    off = 1 - float(np.mean(own_V / cells.voltage_V[:rest]))
    assert off == pytest.approx(0.0026, abs=1e-4)
    assert off < _known(Pack(cell=load_cell("lg_m50"))).standard_errors["voltage_gain"]["gain"]


def test_the_leaf_module_ends_with_its_first_pair() -> None:
    try:
        cells = leaf_module.module(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    assert cells.cell_voltage_V[-1].min() == pytest.approx(3.0, abs=0.01)
    assert np.trapezoid(cells.current_A, cells.time_s) / 3600 == pytest.approx(55.3, abs=0.2)


def test_the_twin_of_the_modules_is_as_warm_as_they_were() -> None:
    """Three thermocouples: 22, 22 and 22.5 degC at first, 27.5, 29 and 28 at the end."""
    try:
        cells = leaf_module.module(SHARED).every(60)
    except NotHere as e:
        pytest.skip(str(e))
    assert cells.temperature_K is not None
    assert cells.temperature_K[0] == pytest.approx(273.15 + 66.5 / 3)
    cell, times = load_cell("lg_m50"), 33 / 5
    body = replace(
        cell, heat_capacity_J_K=LEAF.heat_capacity_J_K / times,
        cooling_area_m2=LEAF.cooling_area_m2 / times ** (2 / 3),
    )  # fmt: skip
    pack = in_module(Pack(cell=body, capacity_C=times * cell.nominal_capacity_C), cells)
    assert pack.initial_K == cells.temperature_K[0]
    load = Load(
        time_s=cells.time_s, current_A=cells.current_A / 2, between=Between.LINEAR,
        ambient_K=pack.initial_K,
    )  # fmt: skip
    got_K = simulate(pack, load).temperature_K
    assert np.abs(got_K - cells.temperature_K[: got_K.size]).max() < 2.5


def test_cells_that_are_alike_are_a_control() -> None:
    (phantom,) = (t for t in weak_trials(SHARED, SHARED) if "Phantom" in t.source)
    try:
        _, truth = phantom.make()
    except NoTrial as e:
        pytest.skip(str(e))
    assert not truth.effects
    assert truth.kind in CONTROLS
