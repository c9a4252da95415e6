"""1000 parameter sets on one flight: `python -m benchmarks.population [MEMBERS]`.

600 s at 10 Hz, no ageing; radii, diffusivities, conductivity and start drawn around the LG M50.
Whole calls, with one thread and with one a core: what passed, and what one core would have taken.
"""

import os
import sys
import time
from collections import Counter

import numpy as np

from benchmarks.sensitivity import NAMES, flight
from twin.builtin import load_cell
from twin.pack import Pack
from twin.population import population
from twin.simulate import changeable, simulate

VARIED = NAMES[:6]
SPREAD = 0.1  # relative standard deviation of each number


def main() -> None:
    """Print one line for each number of threads."""
    members = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    pack, load = Pack(cell=load_cell("lg_m50"), initial_soc=0.9), flight()
    simulate(pack, load)  # compiles
    there = np.array([changeable(pack, load)[name] for name in VARIED])
    draws = np.random.default_rng(5).standard_normal((members, there.size))
    values = there * np.exp(SPREAD * draws)
    values[:, VARIED.index("initial_soc")] = np.clip(values[:, VARIED.index("initial_soc")], 0, 1)
    for workers in sorted({1, os.cpu_count() or 1}):
        start, before = time.perf_counter(), time.process_time()
        many = population(pack, load, VARIED, values, workers=workers)
        seconds, core_s = time.perf_counter() - start, time.process_time() - before
        ends = ", ".join(f"{n} {s.name}" for s, n in Counter(many.status).items())
        print(
            f"{workers} threads: {members} members in {seconds:.1f} s, "
            f"{members / core_s:.1f} a second of a core; {ends}"
        )


if __name__ == "__main__":
    main()
