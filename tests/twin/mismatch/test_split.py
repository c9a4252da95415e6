"""What is fitted, what is judged and what is noise, of recordings long and short."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import NOISE_V, flown, pack
from twin.effects import SensorLag, SeriesResistance
from twin.load import Load
from twin.mismatch import Flight, MismatchError
from twin.mismatch.fit import fit
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.left import beyond_cut_offs, left_V
from twin.mismatch.split import ALONG_V, as_seen, counted, sharpened, split
from twin.simulate import simulate
from twin.solution import Status


def at_1_hz(seconds: int) -> Flight:
    """A steady discharge, logged once a second."""
    time_s = np.arange(float(seconds))
    load = Load(time_s=time_s, current_A=np.full(seconds, 8.0))
    noise_V = np.random.default_rng(1).normal(0.0, NOISE_V, seconds)
    voltage_V = simulate(pack(), load).voltage_V + noise_V
    return Flight(
        name="1 Hz", pack=pack(), load=load, voltage_V=voltage_V,
        judged=np.ones(seconds, dtype=bool), motion=np.full(seconds, ""),
    )  # fmt: skip


def test_the_noise_of_a_short_recording_is_that_of_all_of_it() -> None:
    """Its parts that are held out are 15 samples, which tell none."""
    data = split([at_1_hz(54)], [])
    fitted, ahead = (whiten.noise.white_V for _, whiten in (*data.fitted, *data.held_out))
    assert fitted == ahead == pytest.approx(NOISE_V, rel=0.3)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_resistance_within_the_error_of_numerics_is_no_evidence(share: float) -> None:
    """However long it is recorded: else 0.8 mV in 1201 samples would be 5.3 squares."""
    flight = flown(seed=1, noise_V=1e-3)
    current_A = flight.load.current_A
    drop_V = share * ALONG_V * pack().series * current_A / np.sqrt(np.mean(current_A**2))
    (_, whiten), *_ = split([flight], [flight]).fitted
    assert np.sum(whiten(drop_V[:, None]) ** 2) <= share**2


@pytest.mark.parametrize(("last_V", "noises"), [(8e-3, 1), (16e-3, 3)])
def test_recordings_of_one_pack_have_the_noise_of_its_sensor(last_V: float, noises: int) -> None:
    """By chance less in what is held out, what is left of noise there would be more than noise."""
    sizes_V = (8e-3, 8e-3, last_V)
    first, second, last = (flown(seed=k, noise_V=own) for k, own in enumerate(sizes_V))
    data = split([first, second], [last])
    whites_V = [w.noise.white_V for _, w in (*data.fitted, *data.held_out)]
    assert whites_V == pytest.approx(sizes_V, rel=0.25)
    assert len(set(whites_V)) == noises


def test_a_twin_that_is_empty_at_once_leaves_the_noise_that_is_there() -> None:
    flight = flown(seed=1)
    weak = SeriesResistance(resistance_ohm=2.0)
    empty = replace(flight, pack=replace(pack(), initial_soc=0.01, effects=(weak,)))
    assert simulate(empty.pack, empty.load).time_s.size < 10
    told_V, known_V = (as_seen(f, None)[1].white_V for f in (empty, flight))
    assert told_V == pytest.approx(known_V, rel=0.2)


def test_a_full_pack_is_not_at_its_end_where_noise_of_an_idle_current_charges_it() -> None:
    """Its twin was: then the noise of the current was not seen."""
    random, time_s = np.random.default_rng(5), np.arange(0.0, 200.0, 0.1)
    true = Load(time_s=time_s, current_A=np.where(time_s < 5.0, 0.1, 8.0))
    recorded_A = true.current_A + random.normal(0.0, 0.5, time_s.size)
    own_V = simulate(pack(), true).require().voltage_V
    flight = Flight(
        name="idle", pack=pack(), load=replace(true, current_A=recorded_A),
        voltage_V=own_V + random.normal(0.0, 2e-3, time_s.size),
        judged=np.ones(time_s.size, dtype=bool), motion=np.full(time_s.size, ""),
    )  # fmt: skip
    assert simulate(flight.pack, flight.load).time_s.size < 50
    seen, noise = as_seen(flight, None)
    assert noise.current_A == pytest.approx(0.5, rel=0.1)
    assert noise.white_V < 3e-3  # 0.5 A through the twin's 20 mOhm were 10e-3, the voltage has 2e-3
    assert np.std(seen.load.current_A - true.current_A) < 0.1


def test_a_recording_of_which_nothing_would_be_held_out_is_refused() -> None:
    flight = flown(seed=1)
    there = (flight.time_s < 15) | (flight.time_s > 105)
    with pytest.raises(MismatchError, match=r"of its 7 parts, .* one side has 0 samples"):
        split([replace(flight, judged=there)], [])


@pytest.mark.parametrize(("current_A", "status"), [(8.0, "LOWER"), (-8.0, "UPPER")])
def test_where_a_twin_has_ended_it_stands_at_its_cut_off(current_A: float, status: str) -> None:
    own = beyond_cut_offs(replace(pack(), initial_soc=0.03 if current_A > 0 else 0.99))
    load = Load(time_s=np.arange(1000.0), current_A=np.full(1000, current_A))
    flight = Flight(
        name="on and on", pack=own, load=load, voltage_V=np.full(1000, 16.0),
        judged=np.ones(1000, dtype=bool), motion=np.full(1000, ""),
    )  # fmt: skip
    solution = simulate(own, load)
    assert solution.status is Status[f"{status}_CUT_OFF"]
    end_V = getattr(own.cell, f"{status.lower()}_cut_off_V")
    assert left_V(flight, own, solution)[-1] == pytest.approx(16.0 - 4 * end_V)


def emptied(seed: int) -> Flight:
    """A pack that starts a thousandth emptier than its twin, flown beyond the cut-off of a cell."""
    time_s = np.arange(0.0, 180.0, 0.2)
    load = Load(time_s=time_s, current_A=8.0 + 2.0 * np.sin(time_s / 3.0))
    told = replace(pack(), initial_soc=0.20)
    there = beyond_cut_offs(replace(told, initial_soc=0.199))
    noise_V = np.random.default_rng(seed).normal(0.0, NOISE_V, time_s.size)
    n = (recorded_V := simulate(there, load).voltage_V).size
    return Flight(
        name=f"emptied {seed}", pack=told, motion=np.full(n, ""),
        load=Load(time_s=time_s[:n], current_A=load.current_A[:n]),
        voltage_V=recorded_V + noise_V[:n], judged=np.ones(n, dtype=bool),
    )  # fmt: skip


def test_samples_beyond_a_cut_off_do_not_count_where_they_are_few() -> None:
    data = split([emptied(1)], [emptied(2)])
    best = fit(data, ())
    flight, least_V = data.fitted[0][0], pack().cell.lower_cut_off_V
    beyond = best.problem.beyond(best.q, 0)
    cell_V = (flight.voltage_V - best.problem.residual_V(best.q, 0)) / 4
    assert np.array_equal(beyond, cell_V < least_V)
    assert 0 < np.count_nonzero(beyond) < 0.05 * beyond.size
    finer = sharpened(data, best, stated=False)
    assert finer is not None
    assert np.array_equal(finer.fitted[0][0].judged, ~beyond)
    assert counted(finer) < counted(data)
    assert sharpened(data, best, stated=True) is None


def test_noise_is_sharpened_of_each_recording_however_calm_the_one_that_is_held_out() -> None:
    """Of gusts a late sensor makes what looks like noise, until it is found to be late."""
    truth = [SensorLag(lag_s=0.1)]
    gusty, other = (flown(truth, seed=seed, noise_V=3e-3) for seed in (1, 2))
    steady_A = np.full_like(other.load.current_A, 8.0)
    calm_V = simulate(pack(), replace(other.load, current_A=steady_A)).require().voltage_V
    calm_V = calm_V + np.random.default_rng(3).normal(0.0, 3e-3, calm_V.size)
    calm = replace(other, load=replace(other.load, current_A=steady_A), voltage_V=calm_V)
    data = split([gusty], [calm])
    best = fit(data, [h for h in HYPOTHESES if h.id == "sensor_lag"])
    finer = sharpened(data, best, stated=False)
    assert finer is not None
    (was,), (told,) = ([w.noise.by_chance_V for _, w in own.fitted] for own in (data, finer))
    assert told < 0.5 * was


def test_samples_that_stand_alone_do_not_count_and_a_stretch_that_is_off_does() -> None:
    """As six of 50 to 300 mV in three flights, with which nothing was said of a weak cell."""
    flights = [flown(seed=seed, noise_V=4e-3) for seed in (1, 2)]
    random = np.random.default_rng(9)
    off_V = np.zeros(flights[0].voltage_V.size)
    at = random.choice(off_V.size // 20, 6, replace=False) * 20 + 5
    off_V[at] = random.choice([-0.1, 0.15, 0.3], 6)
    spoiled = replace(flights[0], voltage_V=flights[0].voltage_V + off_V)
    data = split([spoiled], [flights[1]])
    finer = sharpened(data, fit(data, []), stated=False)
    assert finer is not None
    assert set(np.flatnonzero(~finer.fitted[0][0].judged)) >= set(at.tolist())
    assert finer.alone - at.size <= 1
    assert finer.beyond == 0
    stated = sharpened(data, fit(data, []), stated=True)
    assert stated is None or stated.alone == 0
    off_V[at[0] : at[0] + 40] = 0.1
    stretch = replace(flights[0], voltage_V=flights[0].voltage_V + off_V)
    own = split([stretch], [flights[1]])
    kept = sharpened(own, fit(own, []), stated=False)
    assert kept is None or kept.fitted[0][0].judged[at[0] + 1 : at[0] + 39].all()
