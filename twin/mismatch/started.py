"""How full a pack was where nothing tells it: by the voltage of the whole recording."""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from twin.at_rest import OVERFULL
from twin.mismatch.fit import Fitted
from twin.mismatch.flight import Flight
from twin.mismatch.left import beyond_cut_offs, left_V
from twin.simulate import simulate_all

LEAST, MOST, TRIED = 0.05, 1.0, 20  # states of charge
CLOSE = 1e-4


def started(flight: Flight) -> Flight:
    """It starts where the twin as configured is nearest to it, rms; as it is if its start is told.

    What was left out moves that: it is fitted again, within `start_std`, beside every effect. No
    rest tells it then, and none above full.
    """
    if flight.start_told or not flight.judged.any():
        return flight
    pack = beyond_cut_offs(flight.pack)

    def missed_V2(*socs: float) -> list[float]:
        done = simulate_all([(replace(pack, initial_soc=soc), flight.load) for soc in socs])
        left = [left_V(flight, pack, solution)[flight.judged] for solution in done]
        return [float(np.mean(own**2)) for own in left]

    apart = [0.0, *(weak.soc_offset for weak in pack.weak)]
    tried = np.linspace(max(LEAST, -min(apart)), min(MOST, OVERFULL - max(apart)), TRIED)
    nearest = int(np.argmin(missed_V2(*tried.tolist())))
    best = minimize_scalar(
        lambda soc: missed_V2(soc)[0],
        bounds=(tried[max(nearest - 1, 0)], tried[min(nearest + 1, TRIED - 1)]),
        method="bounded",
        options={"xatol": CLOSE},
    )
    told = replace(flight.pack, initial_soc=float(best.x), soc_by_rest=False)
    return replace(flight, pack=told)


def starts_of(fitted: Fitted) -> dict[str, tuple[float, float]]:
    """Recording -> charge at its start and its standard deviation, where nothing tells it."""
    stds = fitted.starts_std()
    return {
        flight.name: (pack.initial_soc, stds[flight.name])
        for problem, packs in zip((fitted.problem, fitted.judge), fitted.packs, strict=True)
        for flight, pack in zip(problem.flights, packs, strict=True)
        if not flight.start_told
    }
