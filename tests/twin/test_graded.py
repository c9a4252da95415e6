"""Long steps where nothing changes: as exact as those of a second, and far fewer."""

from dataclasses import replace

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.effects import ClockShift, SelfHeating, SensorLag
from twin.graded import graded
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

PACK = Pack(cell=load_cell("lg_m50"), effects=(SelfHeating(),), initial_soc=0.9)
NOISE_A = 0.01


def pulses(seed: int = 0) -> Load:
    """Rests, a pulse at 1C, C/3 for half an hour, each an hour apart; a sample a minute, noisy."""
    edges = [(600.0, 0.0), (630.0, 5.0), (4200.0, 0.0), (6000.0, 5 / 3), (9600.0, 0.0)]
    times, currents, start_s = [], [], 0.0
    for stop_s, current_A in edges:
        own = np.append(np.arange(start_s, stop_s - 1.0, 60.0), stop_s - 1e-3)
        times.append(own)
        currents.append(np.full(own.size, current_A))
        start_s = stop_s
    time_s, current_A = np.concatenate(times), np.concatenate(currents)
    noise_A = np.random.default_rng(seed).normal(0.0, NOISE_A, time_s.size)
    return Load(time_s=time_s, current_A=current_A + noise_A)


def at_samples(load: Load, cut: Load, pack: Pack = PACK) -> np.ndarray:
    """(n,) V at the samples of `load`, by steps between the samples of `cut`."""
    solution = simulate(pack, cut).require()
    return solution.voltage_V[np.searchsorted(cut.time_s, load.time_s)]


def test_pulses_and_rests_take_a_tenth_of_the_steps_at_the_same_error() -> None:
    load = pulses()
    uniform, own = load.refined(1.0), graded(load, PACK.rated_C)
    exact_V = at_samples(load, replace(load.refined(0.05), longest_step_s=0.05))
    error_V = [np.abs(at_samples(load, cut) - exact_V).max() for cut in (uniform, own)]
    assert own.time_s.size < 0.12 * uniform.time_s.size
    assert error_V[1] < 1.2 * error_V[0]
    assert error_V[0] < 1e-3


@pytest.mark.parametrize(
    "fault", [ClockShift(shift_s=-2.5), ClockShift(shift_s=2.5), SensorLag(lag_s=1.0)]
)
def test_a_sensor_that_is_late_moves_the_edges_as_with_steps_of_a_second(
    fault: ClockShift | SensorLag,
) -> None:
    """Also where it brings a change into what was a rest."""
    load, late = pulses(), replace(PACK, effects=(*PACK.effects, fault))
    cuts = (load.refined(1.0), graded(load, PACK.rated_C))
    uniform_V, own_V = (at_samples(load, cut, late) for cut in cuts)
    assert np.abs(own_V - uniform_V).max() < 1e-3
    assert np.abs(uniform_V - at_samples(load, cuts[0])).max() > 0.05


def test_samples_current_and_charge_are_kept() -> None:
    load = pulses()
    own = graded(load, PACK.rated_C)
    assert np.isin(load.time_s, own.time_s).all()
    assert own.current_A == pytest.approx(np.interp(own.time_s, load.time_s, load.current_A))
    assert own.charge_C() == pytest.approx(load.charge_C(), rel=1e-12)
    assert np.diff(own.time_s).max() <= own.longest_step_s


def test_a_current_that_changes_all_the_time_keeps_steps_of_a_second() -> None:
    time_s = np.arange(0.0, 600.0, 5.0)
    load = Load(time_s=time_s, current_A=np.where(np.arange(time_s.size) % 2, 4.0, 6.0))
    assert np.diff(graded(load, PACK.rated_C).time_s) == pytest.approx(1.0)


@pytest.mark.parametrize("between", list(Between))
def test_a_steady_current_moves_the_charge_by_little_a_step(between: Between) -> None:
    time_s = np.arange(0.0, 3000.0, 60.0)
    load = Load(time_s=time_s, current_A=np.full(time_s.size, 5.0), between=between)
    own = graded(load, PACK.rated_C)
    assert np.diff(own.time_s).max() * 5.0 < 1.01e-3 * PACK.rated_C
    assert own.time_s.size < 0.4 * load.refined(1.0).time_s.size


def test_a_single_sample_stays_one() -> None:
    load = Load(time_s=np.zeros(1), current_A=np.ones(1))
    assert graded(load, 3600.0).time_s.size == 1
