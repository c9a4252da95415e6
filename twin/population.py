"""Many parameter sets on one load: `population(pack, load, names, values)`.

Members are shared out to processes, not threads: two Python threads were seen to use one core only
(benchmarks/population.py measures the processes).
"""

import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.sensitivity import known_values
from twin.simulate import DEFAULT_MESH, Run, changeable, solution_of
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

SHARES_PER_WORKER = 4  # members that end early leave room for others; each share is sent once
WORTH_A_WORKER = 20
"""Members for which a further process is started: it imports the twin and loads the kernel first,
and a flight of 600 s at 10 Hz takes a tenth of a second."""


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


@dataclass(frozen=True, slots=True)
class _Share:
    """What one process is given: some of the members."""

    pack: Pack
    load: Load
    names: tuple[str, ...]
    values: FloatArray


def population(
    pack: Pack, load: Load, names: Sequence[str], values: npt.ArrayLike, *,
    workers: int | None = None,
) -> Population:  # fmt: skip
    """Simulate `pack` under `load` with each row of `values` (m, k) for the k numbers `names`.

    Names are those of `simulate.changeable`; each number stands for itself, as in `sensitivity`.
    A member that cannot be simulated ends with its status and leaves the others alone. `workers`
    processes at most (None: one a core); they are started afresh, so a script that calls this
    needs the usual `if __name__ == "__main__":`.

    Raises:
        PackError: an unknown name.
        PopulationError: `values` do not fit `names`, or not a single worker.
    """
    known_values(pack, load, names)
    table = np.array(values, dtype=float)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise PopulationError(f"values {table.shape}: expected (members, {len(names)})")
    if workers is not None and workers < 1:
        raise PopulationError(f"workers = {workers}: expected 1 or more, or None")
    cores = min(workers or os.cpu_count() or 1, max(1, table.shape[0] // WORTH_A_WORKER))
    count = max(1, min(table.shape[0], SHARES_PER_WORKER * cores)) if cores > 1 else 1
    shares = [_Share(pack, load, tuple(names), part) for part in np.array_split(table, count)]
    return _joined(load, _answers(shares, cores))


@dataclass(frozen=True, slots=True)
class _Answer:
    """Of one share; as in `Population`."""

    voltage_V: FloatArray
    temperature_K: FloatArray
    status: tuple[Status, ...]
    stopped_s: FloatArray


def _answers(shares: list[_Share], cores: int) -> list[_Answer]:
    if cores == 1:
        return [_simulate(share) for share in shares]
    fresh = multiprocessing.get_context("spawn")  # a fork would copy the caller's threads' locks
    with ProcessPoolExecutor(cores, mp_context=fresh) as pool:
        return list(pool.map(_simulate, shares))


def _simulate(share: _Share) -> _Answer:
    """The members of a share, one after the other."""
    size = share.values.shape[0], share.load.time_s.size
    voltage_V, temperature_K = np.full(size, np.nan), np.full(size, np.nan)
    status, stopped_s = [], np.zeros(size[0])
    given = changeable(share.pack, share.load)
    for i, row in enumerate(share.values.tolist()):
        run = Run(share.pack, share.load, DEFAULT_MESH, Backend.AUTO, None)
        run.change(given | dict(zip(share.names, row, strict=True)))
        run.run()
        solution = solution_of(run, share.pack, share.load)
        n = solution.voltage_V.size
        voltage_V[i, :n], temperature_K[i, :n] = solution.voltage_V, solution.temperature_K
        status.append(solution.status)
        stopped_s[i] = solution.stopped_s
    return _Answer(voltage_V, temperature_K, tuple(status), stopped_s)


def _joined(load: Load, answers: list[_Answer]) -> Population:
    return Population(
        time_s=load.time_s,
        voltage_V=np.concatenate([a.voltage_V for a in answers]),
        temperature_K=np.concatenate([a.temperature_K for a in answers]),
        status=tuple(s for a in answers for s in a.status),
        stopped_s=np.concatenate([a.stopped_s for a in answers]),
    )
