"""What the tests of a calibrated twin leave open of a recording's voltage: `open_V`.

A twin calibrated to slow tests is not as good where much is drawn for long: numbers that those
hardly tell decide there. Other cells that the tests allow as well (`twin.calibrate.doubt`) answer
the recording's current by other voltages, and by as much the twin may be off in it, whatever it
errs by in its own tests: the posterior predictive distribution of the calibration (A. Gelman et
al., Bayesian Data Analysis (2013), chapter 6).
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np

from twin.mismatch.flight import Flight, FloatArray
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate_all

CELLS = 24  # drawn: a variance by so many is within 60 % of its own in 19 of 20


def open_V(flights: Sequence[Flight]) -> float:
    """Rms by which `allowed` cells differ from the twin as configured, over all that counts [V].

    One that is empty before the twin is none that flew this. 0 where no other is known.
    """
    squares = [_squares_V2(f) for f in flights]
    return float(np.sqrt(np.mean(np.concatenate(squares)))) if squares else 0.0


def _squares_V2(flight: Flight) -> FloatArray:
    """(j,) mean over the cells, of the samples that count; 0 from where the twin is empty [V^2]."""
    out = np.zeros(flight.time_s.size)
    if flight.allowed:
        wide = beyond_cut_offs(flight.pack)
        packs = [(p, flight.load) for p in (wide, *_possible(wide, flight))]
        own, *others = (s.voltage_V for s in simulate_all(packs))
        off_V = [v[: own.size] - own for v in others if v.size >= own.size]
        out[: own.size] = np.mean(np.square(off_V), axis=0) if off_V else 0.0
    return out[flight.judged]


def _possible(pack: Pack, flight: Flight) -> Iterator[Pack]:
    """Of the other cells, with whatever `pack` has besides."""
    for other in flight.allowed:
        with suppress(ValueError):  # an effect takes more than this cell has
            yield other.instead(pack)
