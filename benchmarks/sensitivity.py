"""Cost of exact sensitivities, in simulations: `python -m benchmarks.sensitivity`.

A flight of 600 s at 10 Hz with self-heating, without and with ageing; whole calls in the time of
one core, kernels compiled before. The cost of a parameter is what `sensitivity` takes beyond
`simulate`, over the number of parameters.
"""

import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from twin.builtin import load_cell
from twin.effects import AGEING, SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.sensitivity import sensitivity
from twin.simulate import simulate

REPEATS = 7  # the median counts
NAMES = (
    "negative.particle_radius_m", "positive.particle_radius_m", "negative.diffusivity_factor",
    "positive.diffusivity_factor", "electrolyte.conductivity_factor", "initial_soc", "initial_K",
    "heat_transfer_W_m2_K", "area_m2", "negative.thickness_m", "positive.thickness_m",
    "negative.porosity", "positive.porosity", "negative.rate_constant_mol_m2_s",
    "positive.rate_constant_mol_m2_s", "electrolyte.transference",
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
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times)


def main() -> None:
    """Print the table."""
    load, ageing = flight(), tuple(kind() for kind in AGEING)
    print("ageing | parameters | simulation | sensitivities | simulations a parameter")
    for effects in ((), ageing):
        pack = Pack(cell=load_cell("lg_m50"), effects=(SelfHeating(), *effects))
        for k in (1, 2, 4, 5, 8, 16):
            one_s = median_s(partial(simulate, pack, load))
            all_s = median_s(partial(sensitivity, pack, load, NAMES[:k]))
            cost = (all_s - one_s) / k / one_s
            times = f"{1e3 * one_s:.0f} ms | {1e3 * all_s:.0f} ms"
            print(f"{'yes' if effects else 'no'} | {k} | {times} | {cost:.2f}")


if __name__ == "__main__":
    main()
