"""Exact derivatives of the response: `sensitivity(pack, load, names)`.

The steps that the simulation accepted are gone through once more, carrying dstate/dparameter
(`tangent.py`). Times are not moved: what is after a change of the steps themselves does not exist.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from twin.cell import Cell
from twin.kernel import Backend, Kernel, kernel
from twin.load import Load
from twin.mesh import Mesh
from twin.pack import Pack, PackError
from twin.parameters import vector
from twin.simulate import (
    DEFAULT_MESH,
    OUTSIDE,
    START,
    Run,
    changeable,
    sample_ends,
    solution_of,
)
from twin.solution import Solution
from twin.step import DRIVE, StepModel
from twin.tangent import Tangent

FloatArray = npt.NDArray[np.float64]

DIRECTIONS = 4
"""Parameters a pass: more share one elimination, but the code grows, and with it its compilation
(benchmarks/sensitivity.py)."""
START_STEP = 1e-5
"""Relative, of the central difference of the starting state: exact to rounding, since that state is
of degree 1 in each number."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sensitivities:
    """How the response changes with k parameters, at the samples that were simulated.

    Attributes:
        names: (k,) of the parameters.
        values: (k,) at which the derivatives were taken.
        voltage: (n, k) d voltage_V / d parameter [V per unit of the parameter].
        temperature: (n, k) d temperature_K / d parameter [K per unit of it].
        solution: the response itself.
    """

    names: tuple[str, ...]
    values: FloatArray
    voltage: FloatArray
    temperature: FloatArray
    solution: Solution


def sensitivity(
    pack: Pack, load: Load, names: Sequence[str], *, mesh: Mesh = DEFAULT_MESH,
    backend: Backend = Backend.AUTO,
) -> Sensitivities:  # fmt: skip
    """Derivatives of voltage and temperature by the numbers `names` of `changeable(pack, load)`.

    The numbers are those of one cell as the kernel takes them, each for itself: a larger
    `negative.particle_radius_m` leaves `negative.specific_area_m2_m3` as it is. Exact but for what
    Newton's method left unsolved. Where the run ended early, up to there.

    Raises:
        PackError: an unknown name, or a pack that ages or whose diffusion is enhanced by stress:
            their kernels are not differentiated in this version.
    """
    if pack.ages or pack.stressed:
        raise PackError(
            "no sensitivities of a pack that ages or is enhanced by stress: leave out those effects"
        )
    values = known_values(pack, load, names)
    run = Run(pack, load, mesh, backend, None)
    run.taken = []
    run.run()
    solution = solution_of(run, pack, load)
    done = sum(rows.shape[1] for rows in run.rows)
    parts = [
        _carry(run, pack, load, tuple(names[i : i + DIRECTIONS]), backend)
        for i in range(0, len(names), DIRECTIONS)
    ]
    at = _last_steps(run)[sample_ends(run.pieces, done)]
    voltage, temperature = (
        np.hstack([part[row][at] for part in parts] or [np.zeros((at.size, 0))]) for row in (0, 1)
    )
    return Sensitivities(
        names=tuple(names),
        values=values,
        voltage=voltage * pack.series,
        temperature=temperature,
        solution=solution,
    )


def known_values(pack: Pack, load: Load, names: Sequence[str]) -> FloatArray:
    """(k,) present values; PackError if one of `names` is not a number of this pack and load."""
    there = changeable(pack, load)
    for name in names:
        if name not in there:
            raise PackError(f"parameter {name!r} is unknown: expected one of {', '.join(there)}")
    return np.array([there[name] for name in names])


def _last_steps(run: Run) -> npt.NDArray[np.int64]:
    """(pieces,) the last step of each piece, whole or not, as a position in all that was taken."""
    piece = np.concatenate([t.piece for t in run.taken or ()] or [np.zeros(0, dtype=np.int64)])
    return np.flatnonzero(np.diff(piece, append=-1))


@lru_cache(maxsize=16)
def _built(cell: Cell, mesh: Mesh, backend: Backend, directions: int) -> tuple[Tangent, Kernel]:
    tangent = Tangent(StepModel(cell, mesh))
    return tangent, kernel(tangent.step(directions), backend)


def _carry(
    run: Run, pack: Pack, load: Load, names: tuple[str, ...], backend: Backend
) -> tuple[FloatArray, FloatArray]:
    """(steps, k) derivatives of one cell's voltage and of the temperature after each step."""
    k, mesh = len(names), run.model.layout.mesh
    tangent, many = _built(pack.cell, mesh, backend, k)
    directions = _unit(names, _DRIVE_NAMES), _unit(names, tuple(run.values))
    fixed = [vector(run.values), *(a.ravel(order="F") for a in directions)]
    moved = np.concatenate([_start_change(run, pack, load, name) for name in names])
    before, out = run.initial, [np.zeros((0, 2 * k))]
    for taken in run.taken or []:
        inputs = tangent.solved(taken.after), np.vstack([before, taken.after[:-1]]), taken.drive
        changes, shown = many(moved, inputs, fixed)
        before, moved = taken.after[-1], changes[-1]
        out.append(shown)
    voltage, temperature = np.concatenate(out).reshape(-1, k, 2).transpose(2, 0, 1)
    return voltage, temperature


_DRIVE_NAMES = tuple(name if name in OUTSIDE else "" for name in DRIVE)


def _unit(names: tuple[str, ...], of: tuple[str, ...]) -> FloatArray:
    """(of, names) 1 where they are the same."""
    return np.array([[float(a == b) for b in names] for a in of])


def _start_change(run: Run, pack: Pack, load: Load, name: str) -> FloatArray:
    """(states,) d initial state / d parameter."""
    whole = changeable(pack, load)
    step = START_STEP * (abs(whole[name]) or 1.0)
    ends = []
    for value in (whole[name] + step, whole[name] - step):
        changed = whole | {name: value}
        soc, temperature_K = (changed.pop(n) for n in START)
        ends.append(run.model.initial_state(soc, temperature_K, changed))
    change: FloatArray = (ends[0] - ends[1]) / (2 * step)
    return change
