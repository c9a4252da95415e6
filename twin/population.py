"""Many parameter sets on one load: `population(pack, load, names, values)`.

Members go side by side, and in threads, see `simulate.run_all`. CasADi's virtual machine knows
neither; without a compiler one core does the work.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.sensitivity import known_values
from twin.simulate import Run, changeable, run_all, solution_of
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]


AT_ONCE = 64
"""Members whose whole responses are held."""


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
    whole = changeable(pack, load)
    members = [whole | dict(zip(names, row, strict=True)) for row in table.tolist()]
    return _joined(load, len(members), _solved(pack, load, members, workers))


def _solved(
    pack: Pack, load: Load, members: Sequence[Mapping[str, float]], workers: int | None
) -> Iterator[Solution]:
    for first in range(0, len(members), AT_ONCE):
        some = members[first : first + AT_ONCE]
        runs = [Run(pack, load, None, Backend.AUTO, None) for _ in some]
        for run, numbers in zip(runs, some, strict=True):
            run.change(numbers)
        run_all(runs, workers=workers)
        for run in runs:
            yield solution_of(run, pack, load)


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
