"""A fault put into a real current: what undoes it, and that nothing of it is given away."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proof.recorded.blocks import Fitted, Part, Run, fitted, one_resistance
from proof.recorded.measured import RealTest
from proof.recorded.thinned import binned
from proof.recorded.trials_fault import (
    LABORATORY,
    LIST,
    PERIOD_S,
    Fault,
    _driven,
    fault_trials,
    faulty,
    number,
)
from proof.trial import NoTrial
from twin.builtin import load_cell
from twin.effects import (
    ClockShift,
    CurrentGain,
    CurrentOffset,
    SensorLag,
    SeriesResistance,
)
from twin.load import Load
from twin.mismatch import HYPOTHESES
from twin.pack import Pack
from twin.simulate import simulate

UNDO = {
    "current_gain": lambda v: CurrentGain(gain=v),
    "current_offset": lambda v: CurrentOffset(offset_A=v),
    "sensor_lag": lambda v: SensorLag(lag_s=v),
    "clock_shift": lambda v: ClockShift(shift_s=v),
}
SIZES = {"current_gain": 0.08, "current_offset": -1.5, "sensor_lag": 0.5, "clock_shift": 0.5}


def run(rounds: int = 2) -> Run:
    """A gusty flight; its voltage only says which sample it is."""
    time_s = np.arange(0.0, 80.0, 0.1)
    current_A = 15 + 4 * np.sin(time_s / 2) + 2 * np.sin(time_s / 0.9)
    return Run(
        pack=Pack(cell=load_cell("lipo_2200")), known=LABORATORY, time_s=time_s,
        current_A=current_A, voltage_V=np.arange(time_s.size, dtype=float),
        counted=(time_s > 5.0) & (time_s < 75.0), rounds=rounds,
    )  # fmt: skip


@pytest.mark.parametrize("effect", sorted(SIZES))
def test_the_true_number_gives_back_the_current(effect: str) -> None:
    flown, fault = run(), Fault(source="", effect=effect, size=SIZES[effect])
    wrong_A = faulty(flown, fault)
    undone_A = UNDO[effect](number(fault, flown.pack)[1]).flowed_A(flown.time_s, wrong_A)
    inside = slice(20, -20)  # at its ends a shifted current is not known
    left = np.std((undone_A - flown.current_A)[inside])
    assert left < 0.1 * np.sqrt(np.mean((wrong_A - flown.current_A)[inside] ** 2))


def test_a_clock_that_is_found_stands_for_the_one_that_the_pack_has_too() -> None:
    """As the engine puts it in: what it says of a clock is the whole of it."""
    bare, late = run(), Fault(source="", effect="clock_shift", size=0.5)
    base = replace(bare, pack=replace(bare.pack, effects=(ClockShift(shift_s=0.2),)))
    _, whole_s, _ = number(late, base.pack)
    (clock,) = (h for h in HYPOTHESES if h.id == "clock_shift")
    (told,) = clock.within(base.pack, [whole_s, 0.0][: len(clock.fitted)]).effects
    assert isinstance(told, ClockShift)
    seen_A = faulty(base, late)
    by_base_A = ClockShift(shift_s=0.2).flowed_A(base.time_s, base.current_A)
    inside = slice(20, -20)
    undone_A = told.flowed_A(base.time_s, seen_A)
    assert undone_A[inside] == pytest.approx(by_base_A[inside], abs=0.05)


def test_a_clock_moves_the_samples_that_means_are_of_and_smooths_nothing() -> None:
    """Of means over 2 s, 0.75 of those 2 s and 0.25 of those 4 s ago are no clock of 2.5 s."""
    time_s = np.arange(0.0, 400.0, 0.1)
    current_A = np.repeat(np.random.default_rng(3).normal(5.0, 3.0, time_s.size // 10), 10)
    cycle = RealTest(name="", time_s=time_s, current_A=current_A, voltage_V=4.0 - current_A / 50)
    driven = _driven(run().pack, cycle)
    late = Fault(source="", effect="clock_shift", size=2.5)
    earlier = replace(cycle, current_A=np.roll(current_A, 25))
    inside = slice(2, None)
    wrong_A, right_A = faulty(driven, late), binned(earlier, PERIOD_S).current_A
    assert wrong_A[inside] == pytest.approx(right_A[inside])


def test_every_sample_that_counts_is_in_one_part() -> None:
    flown = run()
    seen = np.array([np.isfinite(flown.part(part)) for part in Part])
    assert np.array_equal(seen.sum(axis=0), flown.counted.astype(int))
    shares = seen.mean(axis=1) / flown.counted.mean()
    assert shares == pytest.approx([0.25] * 4, abs=0.01)


def test_a_recording_has_the_voltage_of_its_own_part_alone() -> None:
    flown = run()
    given = flown.recording(Part.FITTED, "first", flown.current_A)
    other = np.isfinite(flown.part(Part.BASE)) | np.isfinite(flown.part(Part.FLOOR))
    assert np.isnan(given.voltage_V[other]).all()


def test_what_is_held_out_has_the_noise_of_its_samples_beside_the_error_of_the_twin() -> None:
    """The floor is of means over 2 s; an exact twin would miss samples by four times as much."""
    bare = run()
    load = Load(time_s=bare.time_s, current_A=bare.current_A)
    noise_V = 0.03 * np.random.default_rng(2).standard_normal(bare.time_s.size)
    voltage_V = simulate(bare.pack, load).require().voltage_V + noise_V
    exact = Fitted(run=replace(bare, voltage_V=voltage_V), pack=bare.pack, ambient_K=298.15)
    ahead_V = exact.error_V(Part.HELD_OUT, bare.current_A)
    told_V = exact.noise_V(Part.HELD_OUT)
    assert told_V == pytest.approx(0.03, rel=0.15)
    assert ahead_V > 2.0 * exact.floor_V()
    assert 0.8 < ahead_V / np.hypot(exact.floor_V(), told_V) < 1.0


def test_the_start_that_was_fitted_is_the_one_that_is_told() -> None:
    """A pack that is told its charge by its voltage at rest would be told another one."""
    bare = run()
    truth = replace(bare.pack, initial_soc=0.9)
    load = Load(time_s=bare.time_s, current_A=bare.current_A)
    told = replace(truth, initial_soc=0.93, soc_by_rest=True)
    own = replace(
        bare, pack=told, voltage_V=simulate(truth, load).require().voltage_V,
        known=replace(LABORATORY, soc=False),
    )  # fmt: skip
    base = fitted(own).pack
    assert not base.soc_by_rest
    assert base.initial_soc == pytest.approx(0.9, abs=2e-3)


def test_resistances_become_one() -> None:
    two = (SeriesResistance(resistance_ohm=0.01), SeriesResistance(resistance_ohm=0.02))
    pack = Pack(cell=load_cell("lipo_2200"))
    (one,) = one_resistance(replace(pack, effects=two)).effects
    assert one == SeriesResistance(resistance_ohm=pytest.approx(0.03))
    assert one_resistance(pack) is pack


def test_no_trial_without_its_recording(tmp_path: Path) -> None:
    trials = fault_trials(tmp_path, tmp_path)
    assert len(trials) == len(LIST)
    for trial in trials:
        with pytest.raises(NoTrial, match="no recording"):
            trial.make()


def test_each_recording_with_a_fault_is_asked_without_one_too() -> None:
    """Else what a question looks like, and not its voltage, would say that there is a fault."""
    assert {f.source for f in LIST if not f.effect} == {f.source for f in LIST if f.effect}
    flown = run()
    assert faulty(flown, Fault(source="")) is flown.current_A
