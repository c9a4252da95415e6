"""What numbers of a twin that are off do to its voltage, where its error is stated."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.effects import AnyEffect, ReactionKinetics, SeriesResistance, SolidDiffusionPositive
from twin.mismatch.fit import fit
from twin.mismatch.flight import FloatArray
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.sizes import uncertainty
from twin.mismatch.split import split
from twin.mismatch.stated import loss_ways
from twin.simulate import simulate

FLIGHT = flown(seed=1)


def rms_V(voltage_V: FloatArray) -> float:
    return float(np.sqrt(np.mean(voltage_V**2)))


@pytest.mark.parametrize("most_V", [1e-3, 8e-3, 5.0])
def test_all_ways_together_make_no_more_than_is_stated(most_V: float) -> None:
    """And none more than it usually does, however much is stated."""
    ways_V = loss_ways(FLIGHT.pack, FLIGHT, most_V)
    together_V = float(np.linalg.norm([rms_V(way) for way in ways_V.T]))
    assert together_V <= most_V * (1 + 1e-9)
    assert (together_V > 0.999 * most_V) == (most_V < 1.0)


def test_no_way_depends_on_another_over_the_samples_that_count() -> None:
    flight = replace(FLIGHT, judged=FLIGHT.time_s > 30.0)
    own_V = loss_ways(flight.pack, flight, 8e-3)[flight.judged]
    products = own_V.T @ own_V
    assert np.abs(products - np.diag(np.diag(products))).max() < 1e-6 * products.max()


@pytest.mark.parametrize(
    "off",
    [ReactionKinetics(negative_factor=1.1, positive_factor=1.1),
     SolidDiffusionPositive(diffusivity_factor=0.9)],
    ids=["reactions", "particles"],
)  # fmt: skip
def test_what_a_number_that_is_a_little_off_does_is_among_them(off: AnyEffect) -> None:
    exact_V = simulate(replace(FLIGHT.pack, effects=(off,)), FLIGHT.load).voltage_V
    missed_V = exact_V - simulate(FLIGHT.pack, FLIGHT.load).voltage_V
    ways_V = loss_ways(FLIGHT.pack, FLIGHT, 5.0)
    sizes = np.linalg.lstsq(ways_V, missed_V, rcond=None)[0]
    assert rms_V(missed_V - ways_V @ sizes) < 0.1 * rms_V(missed_V)
    assert np.linalg.norm(sizes) < 1.0  # uncertainty of the prior


def test_of_a_recording_in_which_nothing_counts_there_is_none() -> None:
    nothing = replace(FLIGHT, judged=np.zeros(FLIGHT.time_s.size, dtype=bool))
    assert loss_ways(nothing.pack, nothing, 8e-3).shape == (FLIGHT.time_s.size, 0)


def test_several_recordings_tell_no_more_of_a_size_than_one() -> None:
    """The twin's error is the same in all of them."""
    resistance = [h for h in HYPOTHESES if h.id == "series_resistance"]
    flights = [flown([SeriesResistance(resistance_ohm=0.01)], seed=k) for k in range(1, 6)]

    def std_ohm(count: int, stated_V: float | None) -> float:
        data = split(flights[:count], flights[-1:], slow_V=stated_V)
        own = fit(data, resistance)
        values = own.problem.stds(own.q, uncertainty(own, 1.0))
        return values["series_resistance"]["resistance_ohm"]

    assert std_ohm(4, 0.05) == pytest.approx(std_ohm(1, 0.05), rel=0.15)
    assert std_ohm(4, None) < 0.6 * std_ohm(1, None)
