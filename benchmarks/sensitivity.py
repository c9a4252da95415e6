"""Cost of exact sensitivities, in simulations: `python -m benchmarks.sensitivity`.

A flight of 600 s at 10 Hz with self-heating; whole calls, kernels compiled before. The cost of a
parameter is what `sensitivity` takes beyond `simulate`, over the number of parameters.
"""

import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from twin.builtin import load_cell
from twin.effects import SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.sensitivity import sensitivity
from twin.simulate import simulate

REPEATS = 7  # the median counts
NAMES = (
    "negative.particle_radius_m", "positive.particle_radius_m", "negative.diffusivity_factor",
    "positive.diffusivity_factor", "electrolyte.conductivity_factor", "initial_soc", "initial_K",
    "heat_transfer_W_m2_K",
)  # fmt: skip


def flight() -> Load:
    """600 s at 10 Hz around 2C of the LG M50, noisy as a flight is."""
    t = np.arange(0.0, 600.0, 0.1)
    noise = np.random.default_rng(1).standard_normal(t.size)
    return Load(time_s=t, current_A=10 * (1 + 0.2 * noise))


def median_s(work: Callable[[], object]) -> float:
    """Of REPEATS calls, after one that is not counted."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main() -> None:
    """Print the table."""
    pack, load = Pack(cell=load_cell("lg_m50"), effects=(SelfHeating(),)), flight()
    print("parameters | simulation | sensitivities | simulations a parameter")
    for k in (1, 2, 3, 4, 8):
        one_s = median_s(partial(simulate, pack, load))
        all_s = median_s(partial(sensitivity, pack, load, NAMES[:k]))
        cost = (all_s - one_s) / k / one_s
        print(f"{k} | {1e3 * one_s:.0f} ms | {1e3 * all_s:.0f} ms | {cost:.2f}")


if __name__ == "__main__":
    main()
