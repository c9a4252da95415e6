"""The search of a calibration as a file, from which a later call goes on."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from twin.calibrate.run import Search
from twin.calibrate.search import Best, Journal, SearchError, search

FloatArray = npt.NDArray[np.float64]

SAME = 1e-6  # relative, of a cost: another machine rounds otherwise, another test costs otherwise


def read_journal(file: Path) -> Journal:
    """What was evaluated; nothing if there is no such file, SearchError if it is no journal."""
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        return Journal()
    except (OSError, UnicodeDecodeError) as e:
        why = (isinstance(e, OSError) and e.strerror) or e
        raise SearchError(f"cannot be read: {why}") from e
    return Journal.from_json(text)


def going_on(journal: Journal) -> Search:
    """A search that continues what `journal` holds, from where that began, and appends to it.

    It raises SearchError where the journal is that of other tests or another pack (its first point
    costs something else here) or of another seed.
    """

    def searched(
        evaluate: Callable[[FloatArray], FloatArray], dimension: int, *, seed: int,
        evaluations: int, start: FloatArray,
    ) -> Iterator[Best]:  # fmt: skip
        first = journal.points[:1]
        if len(journal):
            same = first.shape[1] == dimension
            if not (same and np.allclose(evaluate(first), journal.costs[:1], rtol=SAME, atol=0.0)):
                raise SearchError("it was made with other tests, or another pack")
            start = first[0]
        return search(
            evaluate, dimension, seed=seed, evaluations=evaluations, start=start, state=journal
        )

    return searched
