"""Trials of heat and transport: the list, the recordings as they are given, the cells they need."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proof.recorded import leaf_cell, lg_m50, melasta, panasonic
from proof.recorded.base import Base, charged_to
from proof.recorded.heat_bases import CELLS
from proof.recorded.heat_list import ENTRIES, Kind
from proof.recorded.measured import NotHere, RealTest, matlab, recording
from proof.recorded.thinned import binned, every, spaced, until
from proof.recorded.trials_heat import EFFECTS, KINDS, _question, heat_trials
from proof.trial import NoTrial
from proof.truth import RECORDED
from twin.at_rest import open_circuit_V, soc_at_rest
from twin.builtin import load_cell
from twin.effects import SelfHeating
from twin.mismatch import HYPOTHESES
from twin.pack import Pack

SHARED = Path(__file__).parents[3] / "shared"  # recordings on the machine of who works on this


def steady() -> RealTest:
    """1 Hz, at rest for the first sample."""
    t = np.arange(601.0)
    i = np.where(t == 0, 0.0, 2.0)
    return RealTest(name="steady", time_s=t, current_A=i, voltage_V=4.0 - 0.1 * i - 1e-4 * t)


def test_every_trial_has_its_recordings() -> None:
    for e in ENTRIES:
        assert e.fitted in CELLS[e.cell].recordings
        assert not e.held_out or e.held_out in CELLS[e.cell].recordings


def test_what_is_right_is_known_to_the_engine_and_to_the_proof() -> None:
    known = {h.id for h in HYPOTHESES}
    assert {i for slots in EFFECTS.values() for ids in slots for i in ids} <= known
    assert set(KINDS.values()) <= set(RECORDED)


def test_without_recordings_there_is_no_trial(tmp_path: Path) -> None:
    for trial in heat_trials(tmp_path, tmp_path):
        with pytest.raises(NoTrial, match="no recording"):
            trial.make()


def test_a_thinned_discharge_begins_under_load_and_ends_where_it_did() -> None:
    thin = every(steady(), 5.0)
    assert thin.current_A.min() == 2.0
    assert thin.time_s[0] == 0.0
    assert thin.time_s[-1] == 599.0 - 599.0 % 5.0
    assert np.diff(thin.time_s).max() == 5.0


def test_a_discharge_that_is_cut_has_drawn_that_share_of_its_charge() -> None:
    whole = steady()
    cut = until(whole, 0.9)
    assert cut.drawn_C[-1] == pytest.approx(0.9 * whole.drawn_C[-1], abs=2.0)
    assert cut.drawn_C[-1] >= 0.9 * whole.drawn_C[-1]
    assert cut.voltage_V.tolist() == whole.voltage_V[: cut.time_s.size].tolist()


def test_means_keep_the_charge() -> None:
    rng = np.random.default_rng(1)
    t = 0.1 * np.arange(4000)
    i = rng.normal(2.0, 3.0, t.size)
    test = RealTest(name="drive", time_s=t, current_A=i, voltage_V=4.0 - 0.01 * i)
    mean = binned(test, 2.0)
    assert np.diff(mean.time_s) == pytest.approx(2.0)
    assert mean.current_A.sum() * 2.0 == pytest.approx(i.sum() * 0.1)
    assert mean.voltage_V == pytest.approx(4.0 - 0.01 * mean.current_A)


def test_spaced_samples_keep_both_sides_of_a_jump() -> None:
    t = np.arange(200.0)
    i = np.where((t >= 53) & (t < 84), 30.0, 0.0)
    thin = spaced(RealTest(name="pulse", time_s=t, current_A=i, voltage_V=4.0 - 0.01 * i), 10.0)
    assert {52.0, 53.0, 83.0, 84.0} <= set(thin.time_s.tolist())
    assert thin.time_s.size < 35
    assert np.diff(thin.time_s).max() == 10.0
    assert thin.drawn_C[-1] == pytest.approx(30.0 * 31)


def test_what_tells_of_a_jump_is_kept_and_what_is_of_neither_side_is_not() -> None:
    """A logger that filters: its first row of a pulse has half of what is lost, all after 0.3 s."""
    t = np.round(0.1 * np.arange(600), 3)
    i = np.where((t >= 20.0) & (t < 30.0), 3.0, 0.0)
    filtered_A = np.convolve(i, [0.5, 0.3, 0.2])[: t.size]
    volts = 4.0 - 0.05 * filtered_A
    thin = spaced(RealTest(name="pulse", time_s=t, current_A=i, voltage_V=volts), 10.0)
    told = np.isfinite(thin.voltage_V)
    lost_V = (4.0 - thin.voltage_V)[told]
    assert lost_V == pytest.approx(0.05 * thin.current_A[told])
    for begins in (20.0, 30.0):
        after = (thin.time_s >= begins) & (thin.time_s < begins + 2.9)
        assert after.sum() == 29
        assert (after & told).sum() == 27
    assert thin.time_s.size < 75
    assert thin.drawn_C[-1] == pytest.approx(30.0)


def test_current_and_voltage_of_a_drive_cycle_move_together() -> None:
    """The change of the voltage is that of the current of the same sample, not of the one before.

    The battery's own time constants are longer than a sample.
    """
    try:
        test = panasonic.cycle(SHARED, "US06 25 degC")
    except NotHere as e:
        pytest.skip(str(e))
    rise_A, rise_V = np.diff(test.current_A), np.diff(test.voltage_V)
    inner = slice(3, -3)
    by_lag = [np.corrcoef(rise_A[inner], np.roll(rise_V, -k)[inner])[0, 1] for k in range(-3, 4)]
    assert np.argmin(by_lag) == 3
    assert by_lag[3] < 1.5 * min(by_lag[2], by_lag[4])


def test_the_other_lg_cells_start_at_rest_and_end_empty() -> None:
    try:
        test = lg_m50.other(SHARED, 786, "0.5C", 0, 1)
    except NotHere as e:
        pytest.skip(str(e))
    assert test.current_A[0] == 0.0
    assert test.current_A[1:].min() > 2.4
    assert test.voltage_V[-1] == pytest.approx(2.5, abs=0.01)
    assert test.drawn_C[-1] / 3600 == pytest.approx(4.29, abs=0.01)


def test_no_voltage_is_told_beside_another_current() -> None:
    """The logger of the LG reads one after the other; its pulses are 10 s of 7.5 A."""
    try:
        rates, pulses = (matlab(recording(SHARED, f)) for f in (lg_m50.RATES, lg_m50.PULSES))
        whole = melasta.tests(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    slow = lg_m50.rate(rates, 25, "0.1C")
    for tenths in lg_m50.PULSED:
        test = lg_m50.pulse(pulses, tenths, slow)
        assert test.current_A[0] == pytest.approx(0.0, abs=1e-3)
        assert test.current_A[1:] == pytest.approx(7.5, abs=0.02)
        assert test.time_s[-1] - test.time_s[1] == pytest.approx(10.0, abs=0.1)
        lost_ohm = (test.voltage_V[0] - test.voltage_V[1:]) / 7.5
        assert 0.03 < lost_ohm.min() < lost_ohm.max() < 0.05
    for name in ("2C", "5C", "9.1C"):
        test = whole[name]
        lost_ohm = (test.voltage_V[0] - test.voltage_V[1]) / test.current_A[1]
        assert test.current_A[0] == 0.0
        assert 0.0027 < lost_ohm < 0.0033  # the row in mid switch: 0.0014


@pytest.mark.parametrize("soc", [0.05, 0.5, 1.0])
def test_the_charge_at_rest_is_found_back(soc: float) -> None:
    cell = load_cell("lg_m50")
    assert soc_at_rest(cell, open_circuit_V(cell, soc)) == pytest.approx(soc, abs=1e-5)


def test_a_cell_charged_higher_rests_there() -> None:
    cell = charged_to(load_cell("lipo_2200"), 4.35, 3.0)
    assert open_circuit_V(cell, 1.0) == pytest.approx(4.35, abs=1e-6)
    assert cell.upper_cut_off_V == 4.35


def test_the_potential_of_the_leaf_falls_as_the_electrode_fills() -> None:
    try:
        pulses = leaf_cell.pulses(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    drawn_C, rest_V = leaf_cell.open_circuit(pulses)
    assert (np.diff(drawn_C) >= 0).all()
    assert (np.diff(rest_V) <= 0).all()
    assert drawn_C[-1] / 3600 == pytest.approx(30.5, abs=0.1)  # of 33 Ah, as the file's counter
    pack = leaf_cell.start_cell(pulses)
    assert open_circuit_V(pack.cell, 1.0) == pytest.approx(leaf_cell.MOST_V, abs=2e-3)
    at_rest = soc_at_rest(pack.cell, float(rest_V[0]))  # 4.182 V: not quite full
    assert 0.98 < at_rest < 0.995
    told_C = (at_rest - soc_at_rest(pack.cell, float(rest_V[2]))) * pack.capacity_C
    assert told_C == pytest.approx(drawn_C[2], rel=0.05)


def test_heat_is_asked_of_one_mount() -> None:
    rates = [e for e in ENTRIES if e.cell in ("lg_m50", "lg_m50_slow")]
    assert len(rates) == 13
    assert not any(e.held_out for e in rates), "of its file each rate is another cell's"


def test_tests_of_one_mount_cool_alike() -> None:
    """By what is measured of them at rest afterwards; those at 45 degC are three more cells."""
    try:
        raw = matlab(recording(SHARED, lg_m50.RATES))
    except NotHere as e:
        pytest.skip(str(e))
    by_mount: dict[str, list[float]] = {}
    for name in ("0.5C", "1C"):
        for degrees in (0, 10, 25, 45):
            mount = lg_m50.rate(raw, degrees, name).mount
            by_mount.setdefault(mount, []).append(lg_m50.cools_s(raw, degrees, name))
    assert all(max(s) < 1.05 * min(s) for s in by_mount.values())


def test_a_twin_that_is_told_right_has_all_else_of_one_that_is_not() -> None:
    told = [e for e in ENTRIES if e.kind is Kind.TOLD]
    misstated = [e for e in ENTRIES if e.kind is Kind.MISSTATED]
    start_C = 10.0
    pack = Pack(
        cell=load_cell("lg_m50"),
        heat_transfer_W_m2_K=12.0,
        effects=(SelfHeating(heat_transfer_W_m2_K=12.0),),
    )
    base = Base(
        pack=pack, series_resistance_ohm=0.0, cooling={}, warming_K=0.0, full_soc=1.0,
        errors_V={}, fitted_V={"slow": 0.01},
    )  # fmt: skip
    cold = replace(steady(), temperature_K=np.full(601, start_C + 273.15))
    assert told
    assert all(e.told_C is None for e in told)
    right, wrong = (_question(own[0], base, 1.0, [cold]) for own in (told, misstated))
    assert right.pack.initial_K == right.ambient_K == start_C + 273.15
    assert wrong.pack == replace(right.pack, initial_K=wrong.ambient_K)
    assert wrong.ambient_K == 298.15
