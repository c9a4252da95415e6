"""A true pack on a flight, as instruments without noise show it."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from proof.simulated.faults import FAULTS, Traces
from proof.simulated.flights import TrueFlight
from proof.simulated.pack_truth import PackTruth
from proof.simulated.solves import Solves
from segment.segment import Motion

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flown:
    """A true pack's flight.

    Attributes:
        recorded: as instruments without noise show it.
        cells_V: (series, n) of each cell.
        temperature_K: (n,) of the cells that are alike.
        flight: what was flown.
    """

    recorded: Traces
    cells_V: FloatArray
    temperature_K: FloatArray
    flight: TrueFlight


def fly(pack: PackTruth, flight: TrueFlight, solves: Solves) -> Flown:
    """The pack on a flight; OutOfReachError if a cell cannot."""
    current_A = flight.current_A + pack.consumer_A * (flight.motion == Motion.HORIZONTAL.value)
    if pack.leak_S:  # at the voltage of the pack that does not leak: wrong by under a percent
        tight = fly(replace(pack, leak_S=0.0, faults=()), flight, solves)
        current_A = current_A + pack.leak_S * tight.cells_V.sum(axis=0)
    answers = [
        solves.answer(cell, flight.time_s, current_A / pack.parallel) for cell in pack.places()
    ]
    cells_V = np.array([voltage for voltage, _ in answers])
    steps = np.diff(flight.time_s) * (current_A[1:] + current_A[:-1]) / 2
    traces = Traces(
        time_s=flight.time_s,
        current_A=flight.current_A,
        voltage_V=cells_V.sum(axis=0),
        drawn=np.concatenate([[0.0], np.cumsum(steps)]) / pack.full_C,
        seed=flight.seed,
    )
    for name, size in pack.faults:
        traces = FAULTS[name](traces, size)
    return Flown(recorded=traces, cells_V=cells_V, temperature_K=answers[0][1], flight=flight)
