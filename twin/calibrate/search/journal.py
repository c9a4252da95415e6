"""What a search has evaluated: enough to continue it."""

import json

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


class SearchError(ValueError):
    """The search cannot be what is asked; the text says why."""


class Journal:
    """Points and their costs in the order in which they were evaluated.

    `search(..., state=journal)` appends to it. Given to another call with the same seed, dimension
    and start, it stands for the evaluations: the algorithms are deterministic, so they are run
    through it again, which costs their own arithmetic alone, and go on where it ends. It holds
    nothing of their insides, and pickles.
    """

    def __init__(self) -> None:
        self._points: list[list[float]] = []
        self._costs: list[float] = []

    def __len__(self) -> int:
        return len(self._costs)

    @property
    def points(self) -> FloatArray:
        """(n, k), in the unit box."""
        return np.array(self._points, dtype=float)

    @property
    def costs(self) -> FloatArray:
        """(n,)."""
        return np.array(self._costs, dtype=float)

    def record(self, points: FloatArray, costs: FloatArray) -> None:
        """Append (m, k) points and their (m,) costs."""
        self._points += points.tolist()
        self._costs += costs.tolist()

    def known(self, at: int, points: FloatArray) -> FloatArray:
        """Costs of as many of `points`, asked for at evaluation `at`, as the journal reaches.

        Raises:
            SearchError: other points were evaluated there, so this is not the same search.
        """
        there = np.array(self._points[at : at + len(points)], dtype=float)
        asked = points[: len(there)]
        if there.size and (
            there.shape[1] != points.shape[1] or not np.allclose(there, asked, rtol=0, atol=1e-6)
        ):
            raise SearchError(
                f"the journal of {len(self)} evaluations departs from this search near "
                f"evaluation {at}: it was made with another seed, dimension, start or version of "
                "the algorithms. Start anew, with its best point as `start`"
            )
        return np.array(self._costs[at : at + len(points)], dtype=float)

    def to_json(self) -> str:
        """All of it; every number comes back exactly."""
        return json.dumps({"points": self._points, "costs": self._costs})

    @staticmethod
    def from_json(text: str) -> "Journal":
        """What `to_json` wrote; SearchError if it is something else."""
        journal = Journal()
        try:
            content = json.loads(text)
            points = np.array(content["points"], dtype=float)
            costs = np.array(content["costs"], dtype=float)
        except (ValueError, KeyError, TypeError) as e:
            raise SearchError(f"no journal of a search: {e}") from e
        if (
            costs.ndim != 1
            or points.shape[:1] != costs.shape
            or points.ndim != 2 - (not costs.size)
        ):
            raise SearchError(f"journal: points {points.shape} do not fit costs {costs.shape}")
        journal.record(points, costs)
        return journal
