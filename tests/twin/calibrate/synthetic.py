"""Tests of a cell with known parameters, made by the twin itself: truth without model error."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from twin.builtin import load_cell
from twin.calibrate.cell_map import FILLERS, Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.refine import PARTS, refined
from twin.calibrate.run import problem_of
from twin.load import Load
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


def drawn_cell(problem: Problem, random: np.random.Generator) -> FloatArray:
    """Coordinates drawn from the prior, that of the fillers included; tests start full.

    By rejection: a cell is kept with the probability that its fillers have over that of the
    likeliest.
    """
    low, high = problem.bounds
    starts = np.array([p.name.startswith("start_V") for p in problem.parameters])
    while True:
        q = np.where(starts, 0.0, random.standard_normal(low.size))
        try:
            mapped = problem.mapped(q, 0)
        except Infeasible:
            continue
        fillers = mapped.derived[FILLERS]
        kept = np.log(random.random()) < -0.5 * float(
            np.sum(problem.missed_fillers(mapped.derived)[0] ** 2)
        )
        if kept and (q >= low).all() and (q <= high).all() and fillers.min() > 0:
            return q


def measured(
    pack: Pack, seed: int, names: tuple[str, ...] = tuple(PROTOCOLS)
) -> tuple[list[ReferenceTest], FloatArray, Problem]:
    """Noisy tests of a drawn cell, each up to the lower cut-off, and the truth.

    Drawn again where the cell does not deliver a test.
    """
    blank = empty_tests(pack, names)
    problem = problem_of(pack, blank)
    random = np.random.default_rng(seed)
    parts: list[FloatArray] | None = None
    while parts is None:
        q = drawn_cell(problem, random)
        parts = _delivered(problem, q, blank)
    noise = np.random.default_rng(1000 + seed)
    out = [
        ReferenceTest(
            name=test.name, time_s=test.time_s[: v.size], current_A=test.current_A[: v.size],
            voltage_V=v + NOISE_V * noise.standard_normal(v.size),
        )
        for test, v in zip(blank, parts, strict=True)
    ]  # fmt: skip
    return out, q, problem


def _delivered(
    problem: Problem, q: FloatArray, tests: list[ReferenceTest]
) -> list[FloatArray] | None:
    """Voltages up to the lower cut-off or the end; None if a test comes to neither."""
    cell, out = problem.pack.cell, []
    for test in tests:
        load = refined(Load(time_s=test.time_s, current_A=test.current_A, between=test.between))
        fine = replace(
            test, time_s=load.time_s, current_A=load.current_A, voltage_V=0 * load.time_s
        )
        voltage_V = problem.replayed(q, fine, cell.upper_cut_off_V)[::PARTS]
        over = ~(voltage_V >= cell.lower_cut_off_V)
        stop = int(np.argmax(over)) if over.any() else voltage_V.size
        if stop < voltage_V.size and np.isnan(voltage_V[stop]):
            return None
        out.append(voltage_V[:stop])
    return out
