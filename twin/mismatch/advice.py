"""The test that would tell candidates apart: the one in which their predictions differ most."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from twin.load import Between, Load
from twin.mismatch.fit import Fitted
from twin.mismatch.left import within_cut_offs
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]

PERIOD_S, MOST_SAMPLES = 1.0, 10_000
LEAST_C = 0.05  # a smaller mean current empties a pack in days
WORTH = 2.0  # times the noise: less would not be seen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Manoeuvre:
    """A test that can be flown, or made on a bench.

    Attributes:
        words: for whoever makes it.
        load: of the pack.
        full: the pack is full when it begins, else it starts as in the recording.
    """

    words: str
    load: Load
    full: bool


def manoeuvres(pack: Pack, mean_A: float, peak_A: float, ambient_K: float) -> Iterator[Manoeuvre]:
    """Those a pilot can make, by the mean and peak discharge current of what was recorded."""
    full_C = pack.rated_C
    hover_s = min(0.8 * pack.initial_soc * full_C / mean_A, 3600.0)

    def test(words: str, *steps: tuple[float, float], full: bool = False) -> Manoeuvre:
        period_s = max(PERIOD_S, sum(s for _, s in steps) / MOST_SAMPLES)
        current = np.concatenate([np.full(max(int(s / period_s), 1), a) for a, s in steps])
        load = Load(
            time_s=period_s * np.arange(current.size, dtype=float), current_A=current,
            between=Between.HOLD, ambient_K=ambient_K, longest_step_s=period_s,
        )  # fmt: skip
        return Manoeuvre(words=words, load=load, full=full)

    yield test(
        "hover until 80 % is drawn, then leave the pack connected at rest for 5 min",
        (mean_A, hover_s), (0.0, 300.0),
    )  # fmt: skip
    yield test(
        "from a full, rested pack: 5 s of full throttle every 30 s, ten times",
        *((peak_A, 5.0), (0.2 * mean_A, 25.0)) * 10, full=True,
    )  # fmt: skip
    yield test(
        "a slow discharge at a tenth of the hover current until empty",
        (0.1 * mean_A, 0.95 * pack.initial_soc * full_C / (0.1 * mean_A)),
    )
    yield test(
        "fly 1 min, rest 10 min, and fly 1 min again",
        (mean_A, 60.0), (0.0, 600.0), (mean_A, 60.0),
    )  # fmt: skip
    idle = "leave the full pack connected without load for an hour"
    yield test(idle, (0.0, 3600.0), full=True)
    yield test("hover without pause until the pack is empty", (mean_A, hover_s / 0.8))
    yield test("full throttle for 60 s from full", (peak_A, 60.0), full=True)


def advise(models: Sequence[Fitted], noise_V: float) -> str:
    """In words which manoeuvre separates these models most, and by how much; "" if none does."""
    if len(models) < 2:
        return ""
    flights = models[0].problem.flights
    current = np.concatenate([f.load.current_A[f.judged] for f in flights])
    drawn_A = current[current > 0]
    if not drawn_A.size or drawn_A.mean() < LEAST_C * flights[0].pack.rated_C / 3600:
        return ""
    mean_A, peak_A = float(drawn_A.mean()), float(np.quantile(drawn_A, 0.99))
    packs = [within_cut_offs(m.problem.pack(m.q, 0)) for m in models]
    found = [
        (_least_apart_V([_answer_V(p.charged() if t.full else p, t.load) for p in packs]), t)
        for t in manoeuvres(flights[0].pack, mean_A, peak_A, flights[0].load.ambient_K)
    ]
    apart_V, test = max(found, key=lambda pair: pair[0])
    if apart_V < WORTH * noise_V / np.sqrt(10.0):  # ten samples tell as much as one
        return (
            "none of the manoeuvres that were tried tells the candidates apart: measure the "
            "cells' voltages or the temperature, or check the sensors"
        )
    return f"{test.words}: the candidates then differ by {1e3 * apart_V:.0f} mV rms"


def _answer_V(pack: Pack, load: Load) -> FloatArray:
    simulated = simulate(pack, load).voltage_V
    out = np.full(load.time_s.size, simulated[-1] if simulated.size else 0.0)
    out[: simulated.size] = simulated
    return out


def _least_apart_V(answers: Sequence[FloatArray]) -> float:
    """Of all pairs, the least difference, an offset aside (the start is never known exactly)."""
    return min(float(np.std(a - b)) for a, b in combinations(answers, 2))
