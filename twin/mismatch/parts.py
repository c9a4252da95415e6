"""What each effect of a model does to the voltage of a recording."""

from twin.mismatch.finding import Part
from twin.mismatch.flight import FloatArray
from twin.mismatch.problem import Problem


def parts(problem: Problem, q: FloatArray, flight: int) -> tuple[Part, ...]:
    """Of a model at q: the voltage with an effect minus that without it.

    The others stay as they are. Effects that act on each other make a sum of parts that is not
    quite the whole.
    """
    whole_V, out = problem.residual_V(q, flight), []
    for place, h in enumerate(problem.hypotheses):
        rest, kept = problem.without(place, q)
        out.append(Part(effect=h.id, voltage_V=rest.residual_V(kept, flight) - whole_V))
    return tuple(out)
