"""What each effect of a model does to the voltage of a recording."""

from collections.abc import Sequence

import numpy as np

from twin.mismatch.finding import Part
from twin.mismatch.flight import Flight, FloatArray
from twin.mismatch.noise import Whitener
from twin.mismatch.problem import Problem


def parts(
    data: Sequence[tuple[Flight, Whitener]], problem: Problem, q: FloatArray, flight: int
) -> tuple[Part, ...]:
    """Of the model `problem` of `data` at q: the voltage with an effect minus that without it.

    The others stay as they are. Effects that act on each other make a sum of parts that is not
    quite the whole.
    """
    whole_V = problem.residual_V(q, flight)
    out, first = [], 0
    for number, h in enumerate(problem.hypotheses):
        rest = [*problem.hypotheses[:number], *problem.hypotheses[number + 1 :]]
        kept = np.delete(q, range(first, first + len(h.fitted)))
        without_V = Problem(data, rest).residual_V(kept, flight)
        out.append(Part(effect=h.id, voltage_V=without_V - whole_V))
        first += len(h.fitted)
    return tuple(out)
