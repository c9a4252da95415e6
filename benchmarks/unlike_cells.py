"""Cost of unlike cells in a pack: `python -m benchmarks.unlike_cells`.

A flight of 600 s at 10 Hz and a charge after it, 12 cells in series of which some differ. Whole
calls, kernels compiled before; ratios to the pack of equal cells, taken in turns.
"""

import statistics
import time
from collections.abc import Callable
from functools import partial

from benchmarks.sensitivity import flight
from twin.builtin import load_cell
from twin.effects import EFFECTS, AnyEffect, SelfHeating, WeakCell, chosen
from twin.load import Load
from twin.pack import Pack
from twin.protocol import charge_cc_cv, run
from twin.simulate import simulate

REPEATS = 7  # the median counts
SERIES = 12
WEAK = (0, 1, 2, 3, 5, 11)


def packs(effects: tuple[AnyEffect, ...], start: float) -> list[Pack]:
    """Of 1, 2, 3, ... kinds of cells."""
    cell = load_cell("lipo_2200")
    cells = tuple(WeakCell(capacity_factor=1 - 0.01 * n) for n in range(1, SERIES))
    return [
        Pack(
            cell=cell,
            series=SERIES,
            capacity_C=18000.0,
            initial_soc=start,
            effects=effects + cells[:n],
        )
        for n in WEAK
    ]


def fly(pack: Pack, load: Load) -> None:
    """The whole flight."""
    simulate(pack, load).require()


def charge(pack: Pack) -> None:
    """The whole charge."""
    run(pack, charge_cc_cv(pack)).require()


def seconds(work: Callable[[], object]) -> float:
    """Of one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def ratios(works: list[Callable[[], object]]) -> list[tuple[float, float]]:
    """Median seconds of each, and of their ratio to the first."""
    for work in works:
        work()
    rounds = [[seconds(work) for work in works] for _ in range(REPEATS)]
    columns = zip(*rounds, strict=True)
    firsts = [r[0] for r in rounds]
    return [
        (statistics.median(c), statistics.median(s / f for s, f in zip(c, firsts, strict=True)))
        for c in columns
    ]


def main() -> None:
    """Print the table."""
    load = flight()
    print("work | kinds of cells | time | over equal cells")
    for name, effects in (
        ("self-heating", (SelfHeating(),)),
        ("all ageing", chosen(EFFECTS, heat_transfer_W_m2_K=12.0)),
    ):
        flights = [partial(fly, pack, load) for pack in packs(effects, 1.0)]
        charges = [partial(charge, pack) for pack in packs(effects, 0.3)]
        for what, works in (("flight", flights), ("charge", charges)):
            for n, (taken_s, ratio) in zip(WEAK, ratios(list(works)), strict=True):
                print(f"{what}, {name} | {n + 1} | {1e3 * taken_s:.0f} ms | {ratio:.2f}")


if __name__ == "__main__":
    main()
