"""The derivative of a step that is already taken: how a change of state and parameters goes on.

The step solves F(z, y) = 0, y = (state, drive, p), and hands on G(z, y). At its solution
dz = -(dF/dz)^-1 dF/dy dy, and the next state changes by dG/dz dz + dG/dy dy: the implicit function
theorem, so no iteration is differentiated. One elimination serves all directions; what Newton left
unsolved (see `CONVERGED_V`) is the error of the derivative, relative.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import elimination
from twin.step import StepModel, Unknown

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tangent:
    """Of the steps of a `StepModel` without ageing."""

    model: StepModel

    def solved(self, after: FloatArray) -> FloatArray:
        """(m, unknowns) what Newton found in steps that ended in `after` (m, states)."""
        names = "reaction_n", "reaction_p", "gap_V", "salt"
        return np.hstack([after[:, self.model.layout.slice_of(name)] for name in names])

    def step(self, directions: int) -> ca.Function:
        """(dstate, z, state, drive, p, ddrive, dp) -> dstate after, of it voltage and temperature.

        All d have one column per direction.
        """
        model, layout = self.model, self.model.layout
        y, z = (model.state, model.drive, model.p.vector), model.unknown()
        dy = [ca.SX.sym(f"d{i}", v.numel(), directions) for i, v in enumerate(y)]
        residual, following = self._equations(z)
        by_y = ca.jtimes(residual, ca.vertcat(*y), ca.vertcat(*dy))
        order = self._order()
        jacobian = ca.jacobian(residual, z.vector())[order, order]
        solution = elimination.solve(jacobian, -by_y[order, :])
        dz = solution[np.argsort(order).tolist(), :]
        whole = ca.vertcat(z.vector(), *y)
        result = ca.cse(ca.jtimes(following, whole, ca.vertcat(dz, *dy)))
        inputs = [dy[0], z.vector(), *y, dy[1], dy[2]]
        shown = [result[layout.slice_of(name), :] for name in ("voltage_V", "temperature_K")]
        return ca.Function("tangent", inputs, [result, ca.vertcat(*shown)])

    def _equations(self, z: Unknown) -> tuple[ca.SX, ca.SX]:
        """F, in the order of `Unknown.vector`, and G."""
        model = self.model
        ready = model.prepared()
        surfaces = model.surfaces(z, ready)
        (miss_n, missing_n), (miss_p, missing_p) = model.misses(z, ready, surfaces)
        transfer = model.transfer((surfaces[0].total, surfaces[1].total))
        salt = z.salt - ready.salt - ready.response @ transfer
        answers = ca.SX.zeros(sum(model.layout.electrodes))  # only a guess: nothing depends on it
        following, _ = model.finished(z, answers, ready)
        return ca.vertcat(miss_n, miss_p, missing_n, missing_p, salt), following

    def _order(self) -> list[int]:
        """Positions in `Unknown.vector` as they are eliminated: salt, negative, positive."""
        n, p = self.model.layout.electrodes
        salt = range(n + p + 2, n + p + 2 + self.model.layout.nodes)
        return [*salt, *range(n), n + p, *range(n, n + p), n + p + 1]
