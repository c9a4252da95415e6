"""`Trial`: a question and its truth, and how both are made when they are needed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from proof.question import Question
from proof.truth import Truth


class NoTrial(Exception):
    """A trial that cannot be made; the text says why. It is counted and shown."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """One trial.

    Attributes:
        name: in its list; in a proof "trial-007": the name of its folder, which the judge sees.
        source: whose truth it is: "PyBaMM", or cell and owner of the recordings.
        make: simulates, or reads and calibrates; raises NoTrial.
    """

    name: str
    source: str
    make: Callable[[], tuple[Question, Truth]]


def order(seed: int, count: int) -> list[int]:
    """Place in its list of each trial of a proof: drawn, so that their names tell nothing."""
    return [int(place) for place in np.random.default_rng([seed, 1]).permutation(count)]
