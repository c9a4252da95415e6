"""Search and polish on a calibration: `python -m benchmarks.search_calibration`.

Options: `--seeds 10 --evaluations 600 --first-seed 0`; about 15 min on two quiet cores. A cell is
drawn from the prior and measured by the twin itself (0.1C, 2C, pulses; 2 mV of noise). Each method
starts from the same point, drawn evenly over the whole box of all parameters: least squares alone,
and least squares from what the portfolio, or one of its members alone, has found after so many
evaluations. Found is a cell whose residuals noise explains, as the calibration itself asks.
A line a run; then a line a method: how often it found the cell, medians over all seeds of the time,
of the error of what least squares began with, and of their steps.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.search_portfolio import METHODS
from tests.twin.calibrate.synthetic import cell_pack, measured
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.polish import polish
from twin.calibrate.run import EXPLAINED, problem_of
from twin.calibrate.search import search

FloatArray = npt.NDArray[np.float64]

ALONE = "least squares"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One run.

    Attributes:
        seconds: of all.
        begun: mean square of the residuals, in what was expected, when least squares began.
        ended: likewise at the end.
        steps: linearisations.
    """

    seconds: float
    begun: float
    ended: float
    steps: int


def random_start(problem: Problem, seed: int) -> FloatArray:
    """(k,) in the unit cube; of a cell that is possible."""
    random, (low, high) = np.random.default_rng([seed, 1]), problem.bounds
    while True:
        unit = random.random(low.size)
        try:
            problem.mapped(low + unit * (high - low), 0)
        except Infeasible:
            continue
        return unit


def run(problem: Problem, method: str, seed: int, evaluations: int) -> Outcome:
    """From the start of `seed` to the end of least squares."""
    samples = sum(t.at.size for t in problem.tests)
    low, high = problem.bounds
    unit = random_start(problem, seed)
    begun = time.perf_counter()
    if method != ALONE:
        *_, found = search(
            problem.costs, unit.size, seed=seed, evaluations=evaluations, start=unit,
            members=METHODS[method],
        )  # fmt: skip
        unit = found.point
    first, *others = polish(problem, low + unit * (high - low))
    last = others[-1] if others else first
    return Outcome(
        seconds=time.perf_counter() - begun, begun=2 * first.cost / samples,
        ended=2 * last.cost / samples, steps=last.steps,
    )  # fmt: skip


def main() -> None:
    """Run all and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    for name, value in (("seeds", 10), ("evaluations", 600), ("first-seed", 0)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    pack, outcomes = cell_pack(), {}
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        problem = problem_of(pack, measured(pack, seed)[0])
        for method in (ALONE, *METHODS):
            o = outcomes[method, seed] = run(problem, method, seed, given.evaluations)
            print(f"{seed:3d} {method:14s} {o.seconds:6.1f} s  mean square {o.begun:9.3g} to "
                  f"{o.ended:9.3g} in {o.steps} steps", flush=True)  # fmt: skip
    print(f"\n{'method':14s} {'found':>7s} {'s':>7s} {'begun at':>9s} {'steps':>6s}")
    for method in (ALONE, *METHODS):
        runs = [o for (m, _), o in outcomes.items() if m == method]
        found = sum(o.ended < EXPLAINED for o in runs)
        middle = np.median([(o.seconds, o.begun, o.steps) for o in runs], axis=0)
        print(f"{method:14s} {found:4d}/{len(runs)} {middle[0]:7.1f} {middle[1]:9.3g} "
              f"{middle[2]:6.0f}")  # fmt: skip


if __name__ == "__main__":
    main()
