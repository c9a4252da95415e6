"""Tests of a cell with known parameters, made by the twin itself: truth without model error."""

import numpy as np
import numpy.typing as npt

from twin.builtin import load_cell
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import problem_of
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]
Stage = tuple[float, float, float]
"""C-rate, duration [s], period of the samples [s]."""

NOISE_V = 2e-3
RELAX: tuple[Stage, ...] = ((0.0, 30.0, 1.0), (0.0, 570.0, 30.0))
PULSES: tuple[Stage, ...] = tuple(
    stage for rate in (1.0, -1.0, 2.0, -2.0) for stage in ((rate, 10.0, 0.5), (0.0, 40.0, 1.0))
)
PROTOCOLS: dict[str, tuple[Stage, ...]] = {
    "0.1C": ((0.0, 60.0, 10.0), (0.1, 38000.0, 60.0)),
    "2C": ((0.0, 60.0, 10.0), (2.0, 1500.0, 1.0), *RELAX),
    "pulses": ((0.0, 60.0, 10.0), (1.0, 1080.0, 10.0), *RELAX, *PULSES,
               (1.0, 1080.0, 10.0), *RELAX, *PULSES),
}  # fmt: skip


def cell_pack(name: str = "lipo_2200") -> Pack:
    """One built-in cell."""
    return Pack(cell=load_cell(name))


def load_of(stages: tuple[Stage, ...], capacity_Ah: float) -> tuple[FloatArray, FloatArray]:
    """Times and currents that hold."""
    times, currents, start = [], [], 0.0
    for rate, duration_s, period_s in stages:
        times.append(start + period_s * np.arange(round(duration_s / period_s)))
        currents.append(np.full(times[-1].size, rate * capacity_Ah))
        start += duration_s
    return np.append(np.concatenate(times), start), np.append(
        np.concatenate(currents), currents[-1][-1]
    )


def empty_tests(pack: Pack, names: tuple[str, ...] = tuple(PROTOCOLS)) -> list[ReferenceTest]:
    """The protocols, nothing measured yet."""
    out = []
    for name in names:
        time_s, current_A = load_of(PROTOCOLS[name], pack.cell.nominal_capacity_C / 3600)
        full_V = np.full(time_s.size, pack.cell.upper_cut_off_V)
        out.append(ReferenceTest(name=name, time_s=time_s, current_A=current_A, voltage_V=full_V))
    return out


def drawn_cell(problem: Problem, seed: int) -> FloatArray:
    """Coordinates drawn from the prior, again until a cell has them; tests start full."""
    random = np.random.default_rng(seed)
    low, high = problem.bounds
    starts = np.array([p.name.startswith("start_V") for p in problem.parameters])
    while True:
        q = np.where(starts, 0.0, random.standard_normal(low.size))
        try:
            derived = problem.mapped(q, 0).derived
        except Infeasible:
            continue
        if (q >= low).all() and (q <= high).all() and derived[2:4].min() > 0:
            return q


def measured(
    pack: Pack, seed: int, names: tuple[str, ...] = tuple(PROTOCOLS)
) -> tuple[list[ReferenceTest], FloatArray, Problem]:
    """Noisy tests of a drawn cell, each up to the lower cut-off, and the truth."""
    blank = empty_tests(pack, names)
    problem = problem_of(pack, blank)
    q = drawn_cell(problem, seed)
    random = np.random.default_rng(1000 + seed)
    out = []
    for test in blank:
        voltage_V = problem.replayed(q, test, pack.cell.upper_cut_off_V)
        over = ~(voltage_V >= pack.cell.lower_cut_off_V)
        stop = int(np.argmax(over)) if over.any() else voltage_V.size
        noisy = voltage_V[:stop] + NOISE_V * random.standard_normal(stop)
        out.append(
            ReferenceTest(name=test.name, time_s=test.time_s[:stop],
                          current_A=test.current_A[:stop], voltage_V=noisy)
        )  # fmt: skip
    return out, q, problem
