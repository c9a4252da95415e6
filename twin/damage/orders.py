"""The same segments in other orders: what a motion costs depends on when it was flown.

Early the pack is cold and full, late it is warm and empty, and a flight tells a motion's cost at
the moments it happened to have. How much that decides is found by flying its segments in other
orders, drawn at random. Their spread is what the motion's own segments show of it only where they
are many and lie all over the flight; in most flights they are two or three.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from math import factorial

import numpy as np
import numpy.typing as npt

from twin.damage.cost import Cost, drawn
from twin.damage.loss import Ledger
from twin.load import Load
from twin.pack import Pack
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

ORDERS = 8
SEED = 0


def orders(count: int, wanted: int = ORDERS) -> list[tuple[int, ...]]:
    """Different orders of `count` segments, none as they are; fewer if there are no more."""
    random, same = np.random.default_rng(SEED), tuple(range(count))
    most = min(wanted, factorial(count) - 1)
    found: list[tuple[int, ...]] = []
    while len(found) < most:
        order = tuple(random.permutation(count).tolist())
        if order != same and order not in found:
            found.append(order)
    return found


def reordered(
    pack: Pack, ledger: Ledger, loads: Sequence[Load], movable: Sequence[int], state: FloatArray
) -> tuple[dict[int, Cost], ...]:
    """Place in `loads` -> what that load cost, in orders of the movable ones that can be flown.

    Args:
        pack: that ages.
        ledger: of it.
        loads: of a flight, one after the other.
        movable: places of those that may be flown at another moment; the others stay.
        state: when the first begins.
    """

    def flown(order: tuple[int, ...]) -> dict[int, Cost] | None:
        places = list(range(len(loads)))
        for place, k in zip(movable, order, strict=True):
            places[place] = movable[k]
        costs, status = drawn(pack, ledger, [loads[p] for p in places], state)
        return dict(zip(places, costs, strict=True)) if status is Status.DONE else None

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return tuple(c for c in pool.map(flown, orders(len(movable))) if c is not None)
