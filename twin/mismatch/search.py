"""Models of recordings, with what flowed before these where that is likely."""

from collections.abc import Callable, Sequence

from twin.mismatch.choose import MOST_EFFECTS, Model, models
from twin.mismatch.fit import Data
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.split import flown_before


def search(  # noqa: PLR0913
    data: Data, hypotheses: Sequence[Hypothesis], *, stated: bool,
    progress: Callable[[tuple[str, ...]], None],
    most_effects: int = MOST_EFFECTS, most_alone: int | None = None,
) -> tuple[Data, tuple[Model, ...]]:  # fmt: skip
    """All models that were fitted, see `models`, and the recordings as they were seen by them.

    `stated`: an error of the twin is, which is as slow as what flowed before: that is not asked.
    """

    def of(own: Data) -> tuple[Model, ...]:
        return models(
            own, hypotheses, progress=progress, most_effects=most_effects, most_alone=most_alone
        )

    found = of(data)
    begun = None if stated else flown_before(data, [m.fitted for m in found])
    return (begun, of(begun)) if begun else (data, found)
