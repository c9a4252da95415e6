"""Many parameter sets on one load: `population(pack, load, names, values)`.

Members are shared out to threads: the compiled kernel lets other threads run. CasADi's virtual
machine does not; without a compiler one core does the work.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.pack_model import pack_model
from twin.sensitivity import known_values
from twin.simulate import DEFAULT_MESH, Run, changeable, solution_of
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]


class PopulationError(ValueError):
    """The members cannot be what is asked; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Population:
    """Responses of m members to one load of n samples.

    Attributes:
        time_s: (n,) of the load.
        voltage_V: (m, n) at the terminals; NaN from where a member ended.
        temperature_K: (m, n) likewise.
        status: (m,) how each ended.
        stopped_s: (m,) when.
    """

    time_s: FloatArray
    voltage_V: FloatArray
    temperature_K: FloatArray
    status: tuple[Status, ...]
    stopped_s: FloatArray


def population(
    pack: Pack, load: Load, names: Sequence[str], values: npt.ArrayLike, *,
    workers: int | None = None,
) -> Population:  # fmt: skip
    """Simulate `pack` under `load` with each row of `values` (m, k) for the k numbers `names`.

    Names are those of `simulate.changeable`; each number stands for itself, as in `sensitivity`.
    A member that cannot be simulated ends with its status and leaves the others alone. `workers`
    threads at once (None: one a core).

    Raises:
        PackError: an unknown name.
        PopulationError: `values` do not fit `names`, or not a single worker.
    """
    known_values(changeable(pack, load), names)
    table = np.array(values, dtype=float)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise PopulationError(f"values {table.shape}: expected (members, {len(names)})")
    if workers is not None and workers < 1:
        raise PopulationError(f"workers = {workers}: expected 1 or more, or None")
    pack_model(pack, DEFAULT_MESH, Backend.AUTO)  # compiled here, once, not by every thread
    whole = changeable(pack, load)
    members = (whole | dict(zip(names, row, strict=True)) for row in table.tolist())
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        return _joined(load, table.shape[0], pool.map(partial(_member, pack, load), members))


def _member(pack: Pack, load: Load, numbers: Mapping[str, float]) -> Solution:
    run = Run(pack, load, DEFAULT_MESH, Backend.AUTO, None)
    run.change(numbers)
    run.run()
    return solution_of(run, pack, load)


def _joined(load: Load, members: int, solutions: Iterable[Solution]) -> Population:
    size = members, load.time_s.size
    voltage_V, temperature_K = np.full(size, np.nan), np.full(size, np.nan)
    status, stopped_s = [], np.zeros(members)
    for i, solution in enumerate(solutions):
        n = solution.voltage_V.size
        voltage_V[i, :n], temperature_K[i, :n] = solution.voltage_V, solution.temperature_K
        status.append(solution.status)
        stopped_s[i] = solution.stopped_s
    return Population(
        time_s=load.time_s,
        voltage_V=voltage_V,
        temperature_K=temperature_K,
        status=tuple(status),
        stopped_s=stopped_s,
    )
