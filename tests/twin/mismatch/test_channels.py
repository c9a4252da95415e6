"""Temperature and cells count in the verdict: to mend the voltage and spoil them is no better."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown, pack
from twin.effects import AnyEffect, SelfHeating, SeriesResistance, WeakCell
from twin.mismatch import Flight, MismatchError, Verdict, explain
from twin.mismatch.channels import THERMOMETER_K, channels, whitening
from twin.mismatch.fit import fit
from twin.mismatch.hypothesis import HYPOTHESES, Hypothesis
from twin.mismatch.problem import Problem
from twin.mismatch.split import split
from twin.simulate import simulate


def measured(truth: Sequence[AnyEffect], seed: int, *, seconds: float = 60.0) -> Flight:
    """A flight with thermometer (0.1 K steps) and voltmeters of the cells (2 mV)."""
    own = flown(truth, seed=seed, seconds=seconds)
    true = simulate(replace(pack(), effects=tuple(truth)), own.load).require()
    noise_V = np.random.default_rng(seed).normal(0.0, 2e-3, (own.time_s.size, 4))
    return replace(
        own,
        temperature_K=np.round(true.temperature_K, 1),
        cell_voltage_V=true.cell_voltage_V.T + noise_V,
    )


def chosen(*ids: str) -> list[Hypothesis]:
    return [h for h in HYPOTHESES if h.id in ids]


def against(flight: Flight, *ids: str) -> tuple[float, float]:
    """Residuals squared that each of two effects at its best leaves in a recording."""
    data = split([flight], [flight])
    left = [fit(data, chosen(name)).there.residuals for name in ids]
    return float(left[0] @ left[0]), float(left[1] @ left[1])


def test_a_thermometer_speaks_for_heat_and_against_what_looks_like_it_to_the_voltage() -> None:
    flight = measured([SelfHeating(heat_transfer_W_m2_K=0.1)], 1, seconds=120.0)
    blind = replace(flight, temperature_K=None, cell_voltage_V=None)
    names = "self_heating", "series_resistance"
    seen, unseen = against(flight, *names), against(blind, *names)
    rise_K = float(np.ptp(flight.temperature_K))
    assert rise_K > 4
    assert seen[0] - unseen[0] < 1.0  # heat says it all
    # a rise so soon is more than the tolerance of a thermometer, which wanders slowly
    assert seen[1] - unseen[1] > (rise_K / THERMOMETER_K) ** 2


def test_what_the_twin_does_not_warm_is_a_residual() -> None:
    flight = measured([SelfHeating(heat_transfer_W_m2_K=0.1)], 1)
    warmth, _ = channels(flight)
    missed_K = warmth.residual(simulate(pack(), flight.load))
    assert missed_K == pytest.approx(flight.temperature_K - 298.15)
    ended = simulate(replace(pack(), initial_soc=0.0), flight.load)  # empty: as at its end
    assert warmth.residual(ended).size == flight.time_s.size


def test_the_temperature_counts_as_much_as_its_tolerance_says() -> None:
    """A constant miss of d is worth (d / THERMOMETER_K)**2: its samples repeat each other."""
    flight = replace(measured([], 1), cell_voltage_V=None)
    data = split([flight], [flight])
    cost = []
    for off_K in (0.0, 2 * THERMOMETER_K):
        own = replace(flight, temperature_K=flight.temperature_K + off_K)
        cost.append(Problem([(own, data.fitted[0][1])], ()).cost(np.zeros(1)))
    assert 2 * (cost[1] - cost[0]) == pytest.approx(4.0, rel=0.25)


def test_a_weak_cell_is_told_by_its_own_voltage_and_a_resistance_is_not() -> None:
    both = chosen("weak_cell", "series_resistance")
    weak = WeakCell(resistance_ohm=0.004, cell=3)
    for truth in (weak, SeriesResistance(resistance_ohm=0.004)):
        finding = explain([measured([truth], 1)], [measured([truth], 2)], hypotheses=both)
        assert finding.verdict is Verdict.NAMED
        assert [e.id for e in finding.effects] == [truth.id]
        assert not finding.effects[0].equivalent


def test_cells_in_order_are_not_called_weak_for_a_few_millivolts() -> None:
    flights = [measured([], seed) for seed in (1, 2)]
    unlike = [
        replace(f, cell_voltage_V=f.cell_voltage_V + np.array([0.0, 4e-3, -5e-3, 2e-3]))
        for f in flights
    ]
    finding = explain(unlike[:1], unlike[1:], hypotheses=chosen("weak_cell"))
    assert finding.verdict is Verdict.NONE


def test_slopes_of_channels_are_those_of_their_residuals() -> None:
    flight = measured([], 1, seconds=30.0)
    data = split([flight], [flight])
    problem = Problem(data.fitted, chosen("weak_cell", "cold_pack"))
    q = problem.starts()[0]
    there = problem.evidence(q)
    assert there.residuals == pytest.approx(problem.whitened([q])[0][0])
    assert there.rms_V == problem.rms_V(q)
    step = np.zeros(problem.size)
    step[0] = 1e-3
    far = (problem.whitened([q + step])[0][0] - there.residuals) / 1e-3
    assert there.slopes[:, 0] == pytest.approx(far, rel=0.02, abs=1e-2 * np.abs(far).max())


@pytest.mark.parametrize("every_s", [4.0, 10.0])
def test_cells_that_are_logged_now_and_then_are_compared_all_the_same(every_s: float) -> None:
    own = measured([WeakCell(resistance_ohm=0.01, cell=3)], 1, seconds=40.0)
    cells_V, every = np.full_like(own.cell_voltage_V, np.nan), round(every_s / 0.1)
    cells_V[::every] = own.cell_voltage_V[::every]
    dense = replace(own, temperature_K=None)
    twin, off = simulate(pack(), own.load), []
    for flight in (replace(dense, cell_voltage_V=cells_V), dense):
        (cells,) = channels(flight)
        off.append(np.abs(cells.whiten(cells.residual(twin)[:, None])).max())
    assert off[0] > 1.0
    assert off[1] > off[0]  # the more samples, the less doubt


def test_channels_that_do_not_fit_are_refused_or_passed_over() -> None:
    own = measured([], 1, seconds=30.0)
    with pytest.raises(MismatchError, match="temperature_K"):
        replace(own, temperature_K=np.zeros(3))
    empty = np.full(own.time_s.size, np.nan)
    assert (
        channels(replace(own, temperature_K=empty, cell_voltage_V=own.cell_voltage_V[:, :2])) == ()
    )


def test_whitened_chance_is_white_from_the_first_mean_on_and_over_a_gap() -> None:
    t = np.delete(np.arange(0.0, 400.0, 10.0), slice(10, 20))
    whiten = whitening(t, np.ones(t.size, dtype=bool), 0.5, (3.0, 100.0))
    random = np.random.default_rng(0)
    covariance = 9.0 * np.exp(-np.abs(t[:, None] - t) / 100.0)
    slow = np.linalg.cholesky(covariance) @ random.standard_normal((t.size, 4000))
    white = whiten(slow + 0.5 * random.standard_normal(slow.shape))
    assert white @ white.T / 4000 == pytest.approx(np.eye(t.size), abs=0.1)  # 6 / sqrt(4000)
