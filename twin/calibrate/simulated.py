"""The cell on the loads of tests: voltages and temperatures at their samples, with derivatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.calibrate.refine import PARTS, refined
from twin.calibrate.resample import Sampled
from twin.cell_mesh import fine_mesh_of
from twin.kernel import Backend
from twin.load import Load
from twin.mesh import Mesh
from twin.pack import Pack
from twin.sensitivity import sensitivity_of
from twin.simulate import Run, changeable, run_all, solution_of
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

UNBOUNDED = 1e6  # V or K by as much again of a number: no derivative of a cell


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulated:
    """One test at some values.

    Attributes:
        voltage_V: (m,) at the compared samples.
        by_q: (m, k) its derivative, or None if it was not asked for.
        temperature_K: (m,) there, and from where it ended as at its end.
        warming_by_q: (m, k) its derivative, or None.
        complete: it came to the end.
    """

    voltage_V: FloatArray
    by_q: FloatArray | None
    temperature_K: FloatArray
    warming_by_q: FloatArray | None
    complete: bool


class Simulator:
    """Of one cell, given the numbers of the kernel that are not as in its `pack`.

    Beyond its cut-offs it goes on; samples that it never comes to count as if it stood there, so
    that whoever comes further is better.
    """

    def __init__(self, pack: Pack) -> None:
        self._wide = replace(pack, cell=pack.cell.beyond())

    def plain(self, asked: Sequence[tuple[Sampled, Mapping[str, float]]]) -> list[Simulated]:
        """Tests without derivatives; least work where the same ones follow each other."""
        runs = [self._run(sample.load, numbers) for sample, numbers in asked]
        run_all(runs)
        both = zip(runs, asked, strict=True)
        return [self._at(solution_of(r, self._wide, s.load), s) for r, (s, _) in both]

    def _at(self, solution: Solution, sample: Sampled) -> Simulated:
        return Simulated(
            voltage_V=self._filled(solution.voltage_V, sample),
            by_q=None,
            temperature_K=_warm_K(solution, sample),
            warming_by_q=None,
            complete=solution.status is Status.DONE,
        )

    def response(
        self, sample: Sampled, numbers: Mapping[str, float], names: Sequence[str]
    ) -> Simulated:
        """A test, and derivatives by the kernel's numbers `names`."""
        run = Run(self._wide, sample.load, None, Backend.AUTO, None)
        given = self._given(sample.load) | dict(numbers)
        s = sensitivity_of(run, sample.load, names, numbers=given)
        slopes, warming = (np.zeros((sample.load.time_s.size, len(names))) for _ in range(2))
        n = s.solution.voltage_V.size
        # none where a particle fills, nor where a potential that does not fall
        # lets it grow: a step is judged by its cost
        most = UNBOUNDED / np.array([abs(given[name]) or 1.0 for name in names])
        slopes[:n], warming[:n] = (
            np.where(np.abs(v) < most, v, 0.0) for v in (s.voltage, s.temperature)
        )
        warming[n:] = warming[n - 1] if n else 0.0
        return Simulated(
            voltage_V=self._filled(s.solution.voltage_V, sample),
            by_q=slopes[sample.at],
            temperature_K=_warm_K(s.solution, sample),
            warming_by_q=warming[sample.at],
            complete=s.solution.status is Status.DONE,
        )

    def missed_V(self, sample: Sampled, numbers: Mapping[str, float]) -> FloatArray:
        """(m,) fine minus coarse; 0 from where either does not come to."""
        load, at = sample.load, sample.at
        coarse_V = self.solved(load, numbers).voltage_V
        fine_V = self.finely(refined(load), numbers).voltage_V[::PARTS]
        come_to = at[at < min(coarse_V.size, fine_V.size)]
        out = np.zeros(at.size)
        out[: come_to.size] = fine_V[come_to] - coarse_V[come_to]
        return out

    def solved(self, load: Load, numbers: Mapping[str, float]) -> Solution:
        """At every sample of a load."""
        return self._solved(load, numbers, None)

    def finely(self, load: Load, numbers: Mapping[str, float]) -> Solution:
        """The same on the fine mesh of the cell."""
        return self._solved(load, numbers, fine_mesh_of(self._wide.cell))

    def _solved(self, load: Load, numbers: Mapping[str, float], mesh: Mesh | None) -> Solution:
        run = self._run(load, numbers, mesh)
        run.run()
        return solution_of(run, self._wide, load)

    def _run(self, load: Load, numbers: Mapping[str, float], mesh: Mesh | None = None) -> Run:
        run = Run(self._wide, load, mesh, Backend.AUTO, None)
        run.change({**self._given(load), **numbers})
        return run

    def _given(self, load: Load) -> dict[str, float]:
        """Numbers of the pack; a test starts as warm as its surroundings."""
        numbers = changeable(self._wide, load)
        numbers["initial_K"] += load.ambient_K - self._wide.initial_K
        return numbers

    def _filled(self, voltage_V: FloatArray, sample: Sampled) -> FloatArray:
        """(m,) at the compared samples, also those that were not come to."""
        whole = np.empty(sample.load.time_s.size)
        n = voltage_V.size
        whole[:n] = voltage_V
        charging = n > 0 and sample.load.current_A[min(n, whole.size - 1)] < 0
        whole[n:] = self._wide.cell.upper_cut_off_V if charging else self._wide.cell.lower_cut_off_V
        return np.asarray(whole[sample.at] + sample.missed_V)


def _warm_K(solution: Solution, sample: Sampled) -> FloatArray:
    """(m,) at the compared samples; from where it ended, as at its end."""
    n, whole_K = solution.temperature_K.size, np.empty(sample.load.time_s.size)
    whole_K[:n] = solution.temperature_K
    whole_K[n:] = solution.temperature_K[-1] if n else sample.load.ambient_K
    return np.asarray(whole_K[sample.at])
