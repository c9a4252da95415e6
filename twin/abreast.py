"""Steps of several cells at once: LANES of them go through the equations side by side.

A step is a hundred kilobytes of machine code without a loop, more than a processor keeps near:
reading it takes as long for one cell as for LANES. So there is only this one kernel, and where
fewer cells are asked for, the other lanes repeat the last. What a cell does is the same to the bit
in any lane, whatever the others hold: each stops to iterate when it has converged itself.
"""

from collections.abc import Callable
from functools import partial

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import newton
from twin.kernel import Backend, Kernel, VirtualLoop, begun
from twin.lanes import LANES, c_of_lanes
from twin.step import StepModel

FloatArray = npt.NDArray[np.float64]

NAME = "side_by_side"  # of the function, in C too
STEP = """
static int %(name)s(const casadi_real** arg, casadi_real** res, casadi_int* iw, casadi_real* w,
                    int mem) {
  const loose *state = (const loose*)arg[0], *drive = (const loose*)arg[1];
  const loose *p = (const loose*)arg[2];
  loose *next = (loose*)res[0], *shown = (loose*)res[1];
  lanes z[%(z)d], better[%(z)d], answers[%(answers)d], answered[%(answers)d], moved, moves;
  lanes %(ready)s;
  prepare(state, drive, p, z, %(readied)s);
  correct(z, %(readied)s, state, drive, p, better, &moved, answers);
  for (int i = 0; i < %(z)d; ++i) z[i] = better[i];
  for (int k = 1; k < %(most)d; ++k) {
    words on = (words)(moved > %(converged)r);
    casadi_int any = 0;
    for (int l = 0; l < LANES; ++l) any |= on[l];
    if (!any) break;
    correct(z, %(readied)s, state, drive, p, better, &moves, answered);
    for (int i = 0; i < %(z)d; ++i) z[i] = SELECT(on, better[i], z[i]);
    for (int i = 0; i < %(answers)d; ++i) answers[i] = SELECT(on, answered[i], answers[i]);
    moved = SELECT(on, moves, moved);
  }
  finish(z, answers, %(readied)s, state, drive, p, next, shown);
  for (int i = %(shown)d - 1; i > %(correction)d; --i) shown[i] = shown[i - 1];
  shown[%(correction)d] = moved;
  return 0;
}
"""


def c_of_step(prepare: ca.Function, correct: ca.Function, finish: ca.Function) -> str:
    """C of `side_by_side`."""
    ready = {f"ready_{i}": prepare.numel_out(i) for i in range(1, prepare.n_out())}
    own = {
        "name": NAME,
        "z": prepare.numel_out(0),
        "answers": correct.numel_out(2),
        "shown": finish.numel_out(1) + 1,
        "correction": newton.CORRECTION,
        "most": newton.MAX_ITERATIONS,
        "converged": newton.CONVERGED_V,
        "ready": ", ".join(f"{r}[{n}]" for r, n in ready.items()),
        "readied": ", ".join(ready),
    }
    return c_of_lanes([prepare, correct, finish]) + STEP % own


class Abreast:
    """Any number of cells; `lanes` of them cost as much as one."""

    def __init__(self, loop: Kernel, lanes: int) -> None:
        self._loop, self.lanes = loop, lanes

    def __call__(
        self, states: FloatArray, drives: FloatArray, p: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """All steps of l cells.

        Args:
            states: (l, states) before the first step.
            drives: (l, m, DRIVE) of each step.
            p: (l, p) of each cell.

        Returns:
            (m, l, states) after each step, and (m, l, OUTPUTS) what each gives out.
        """
        starts = range(0, states.shape[0], self.lanes)
        spans = [slice(k, k + self.lanes) for k in starts]
        parts = [self._some(states[span], drives[span], p[span]) for span in spans]
        if len(parts) == 1:
            return parts[0]
        after, out = (np.concatenate(both, axis=1) for both in zip(*parts, strict=True))
        return after, out

    def _some(
        self, states: FloatArray, drives: FloatArray, p: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        cells, steps = drives.shape[:2]
        lane = np.minimum(np.arange(self.lanes), cells - 1)
        each = drives[lane].transpose(1, 2, 0).reshape(steps, -1)
        results = self._loop(states[lane].T, [each], [p[lane].T])
        after, out = (r.reshape(steps, -1, self.lanes)[:, :, :cells] for r in results)
        return after.swapaxes(1, 2), np.ascontiguousarray(out.swapaxes(1, 2))


def side_by_side(step: ca.Function) -> ca.Function:
    """`step` of LANES cells, one in each row."""
    given = [ca.MX.sym("given", LANES, step.numel_in(i)) for i in range(step.n_in())]
    after, out = step.map(LANES)(*(g.T for g in given))
    return ca.Function(NAME, given, [after.T, out.T])


def begun_abreast(model: StepModel, backend: Backend) -> Callable[[], Abreast]:
    """Of `model`, compiled while the caller does something else, see `kernel.begun`.

    The virtual machine gains nothing by idle lanes: there it is one cell after the other.
    """
    parts = model.parts()
    one = newton.joined(*parts)
    many, code = side_by_side(one), partial(c_of_step, *parts)
    made = begun(many, backend, code, virtual=one)

    def abreast() -> Abreast:
        loop = made()
        return Abreast(loop, 1 if isinstance(loop, VirtualLoop) else LANES)

    return abreast
