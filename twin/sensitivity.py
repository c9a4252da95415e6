"""Exact derivatives of the response: `sensitivity(pack, load, names)`.

The steps that the simulation accepted are gone through once more, carrying dstate/dparameter
(`tangent.py`). Times are not moved: what is after a change of the steps themselves does not exist.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin.kernel import Backend, Kernel, kernel
from twin.lanes import LANES
from twin.load import Load
from twin.mesh import Mesh
from twin.one_thread import SYMBOLS
from twin.pack import Pack, PackError
from twin.parameters import vector
from twin.pieces import sample_ends
from twin.simulate import OUTSIDE, Run, cells_of, changeable, solution_of
from twin.solution import Solution
from twin.step import DRIVE, StepModel
from twin.tangent import Tangent, c_of_tangent, tangent_step

FloatArray = npt.NDArray[np.float64]

DIRECTIONS = 16
"""Parameters that are taken at once, at most: what they share costs as much as two or three
(benchmarks/sensitivity.py). They go in whole LANES, those that are not asked for being idle."""
DIFFERENCE = 1e-5
"""Relative, of the central difference of starting state and kernel's parameters by a number. Those
are products and quotients of the numbers, so that it is right to 1e-10."""


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
    pack: Pack, load: Load, names: Sequence[str], *, mesh: Mesh | None = None,
    backend: Backend = Backend.AUTO,
) -> Sensitivities:  # fmt: skip
    """Derivatives of voltage and temperature by the numbers `names` of `changeable(pack, load)`.

    The numbers are those of one cell as the kernel takes them, each for itself: a larger
    `negative.particle_radius_m` leaves `negative.specific_area_m2_m3` as it is. Exact but for what
    Newton's method left unsolved. Where the run ended early, up to there.

    Raises:
        PackError: an unknown name.
    """
    return sensitivity_of(Run(pack, load, mesh, backend, None), load, names, backend=backend)


def sensitivity_of(
    run: Run, load: Load, names: Sequence[str], *, numbers: Mapping[str, float] | None = None,
    backend: Backend = Backend.AUTO,
) -> Sensitivities:  # fmt: skip
    """As `sensitivity`, of a `run` under `load` that has not begun; it is run here.

    `numbers` are values for all of `changeable(run.pack, load)`; None takes those of the pack.
    """
    pack = run.pack
    whole = dict(numbers or changeable(pack, load))
    values = known_values(whole, names)
    if numbers is not None:
        run.change(whole)
    run.taken = []
    run.run()
    solution = solution_of(run, pack, load)
    done = sum(rows.shape[1] for rows in run.rows)
    parts = [
        _carry(run, whole, tuple(names[i : i + DIRECTIONS]), backend)
        for i in range(0, len(names), DIRECTIONS)
    ]
    at = _last_steps(run)[sample_ends(run.pieces, done)]
    voltage, temperature = (
        np.hstack([part[row][at] for part in parts] or [np.zeros((at.size, 0))]) for row in (0, 1)
    )
    return Sensitivities(
        names=tuple(names),
        values=values,
        voltage=voltage * pack.terminals,
        temperature=temperature,
        solution=solution,
    )


def known_values(there: Mapping[str, float], names: Sequence[str]) -> FloatArray:
    """(k,) present values; PackError if one of `names` is not among them."""
    for name in names:
        if name not in there:
            raise PackError(f"parameter {name!r} is unknown: expected one of {', '.join(there)}")
    return np.array([there[name] for name in names])


def _last_steps(run: Run) -> npt.NDArray[np.int64]:
    """(pieces,) the last step of each piece, whole or not, as a position in all that was taken."""
    piece = np.concatenate([t.piece for t in run.taken or ()] or [np.zeros(0, dtype=np.int64)])
    return np.flatnonzero(np.diff(piece, append=-1))


@lru_cache(maxsize=16)
def _built(model: StepModel, directions: int, backend: Backend) -> Kernel:
    return kernel(tangent_step(*_parts(model), directions), backend, partial(_code, model))


@lru_cache(maxsize=16)
def _parts(model: StepModel) -> tuple[ca.Function, ca.Function]:
    return Tangent(model).split()


@lru_cache(maxsize=16)
def _code(model: StepModel) -> str:
    return c_of_tangent(*_parts(model))


def _carry(
    run: Run, whole: dict[str, float], names: tuple[str, ...], backend: Backend
) -> tuple[FloatArray, FloatArray]:
    """(steps, k) derivatives of the mean cell's voltage and temperature after each step."""
    changes = _input_changes(run, whole, names)
    kinds = [
        _carry_kind(run, kind, change, names, backend)
        for kind, change in enumerate(zip(*changes, strict=True))
    ]
    voltage, temperature = np.average(kinds, axis=0, weights=run.model.counts)
    return voltage, temperature


def _carry_kind(
    run: Run, kind: int, change: tuple[FloatArray, FloatArray], names: tuple[str, ...],
    backend: Backend,
) -> FloatArray:  # fmt: skip
    """(2, steps, k) of one kind of cell, whose first state (k, states) and p (k, p) change."""
    k = LANES * -(-len(names) // LANES)
    with SYMBOLS:
        many = _built(run.model.cell, k, backend)
    state, drive, p = (_filled(rows, k) for rows in (change[0], _unit(names), change[1]))
    fixed = [vector(run.kinds[kind].values), drive.ravel(), p.ravel(), np.array([float(k)])]
    carried = np.concatenate([run.model.states(run.initial)[kind], state.ravel()])
    out = [np.zeros((0, 2 * k))]
    for taken in run.taken or []:
        after = run.model.states(taken.after)[:, kind]
        for at in range(0, after.shape[0], many.at_once):
            span = slice(at, at + many.at_once)
            carries, shown = many(carried, [after[span], taken.drive[span]], fixed)
            carried = carries[-1]
            out.append(shown.copy())  # a view would keep all that was carried
    return np.concatenate(out).reshape(-1, k, 2)[:, : len(names)].transpose(2, 0, 1)


def _filled(rows: FloatArray, k: int) -> FloatArray:
    """(k, n) the rows, then zeros."""
    return np.pad(rows, ((0, k - rows.shape[0]), (0, 0)))


def _unit(names: tuple[str, ...]) -> FloatArray:
    """(names, DRIVE) 1 where one of OUTSIDE is the same."""
    return np.array([[float(a == b and a in OUTSIDE) for b in DRIVE] for a in names])


def _input_changes(
    run: Run, whole: dict[str, float], names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """By the numbers: first state (kinds, k, states) and parameters (kinds, k, p)."""
    kinds = len(run.kinds)
    states: list[FloatArray] = []
    parameters: list[FloatArray] = []
    for name in names:
        step = DIFFERENCE * (abs(whole[name]) or 1.0)
        high, low = (cells_of(run.pack, whole | {name: whole[name] + s}) for s in (step, -step))
        for out, of in ((states, run.model.initial_state), (parameters, run.model.parameters)):
            out.append((of(high) - of(low)).reshape(kinds, -1) / (2 * step))
    return np.stack(states, axis=1), np.stack(parameters, axis=1)
