"""The derivative of a step that is already taken: how a change of state and parameters goes on.

The step solves F(z, y) = 0, y = (state, drive, p), and hands on G(z, y). At its solution
dz = -(dF/dz)^-1 dF/dy dy, and the next state changes by dG/dz dz + dG/dy dy: the implicit function
theorem, so no iteration is differentiated. One elimination serves all directions; what Newton left
unsolved (see `CONVERGED_V`) is the error of the derivative, relative.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from twin import elimination
from twin.step import DRIVE, StepModel, _Unknown


@dataclass(frozen=True, slots=True)
class Tangent:
    """Of the steps of a `StepModel` without ageing."""

    model: StepModel

    def solved(self, after: ca.DM) -> ca.DM:
        """(unknowns, m) what Newton found in steps that ended in `after` (states, m)."""
        names = "salt", "phi", "reaction_n", "reaction_p"
        return ca.vertcat(*(after[self.model.layout.slice_of(name), :] for name in names))

    def step(self, directions: int) -> ca.Function:
        """(dstate, z, state, drive, p, ddrive, dp) -> dstate after, of it voltage and temperature.

        All d have one column per direction.
        """
        layout, parameters = self.model.layout, self.model.p.vector
        sizes = layout.nodes, layout.nodes, *layout.electrodes
        z = _Unknown(*(ca.SX.sym("z", n) for n in sizes))
        y = ca.SX.sym("state", layout.size), ca.SX.sym("drive", len(DRIVE)), parameters
        dy = [ca.SX.sym(f"d{i}", v.numel(), directions) for i, v in enumerate(y)]
        residual, following = self._equations(z, *y)
        by_y = ca.jtimes(residual, ca.vertcat(*y), ca.vertcat(*dy))
        order = layout.elimination_order()
        jacobian = ca.jacobian(residual, z.vector())[order, order]
        solution = elimination.solve(jacobian, -by_y[order, :])
        dz = solution[np.argsort(order).tolist(), :]
        whole = ca.vertcat(z.vector(), *y)
        result = ca.jtimes(following, whole, ca.vertcat(dz, *dy))
        inputs = [dy[0], z.vector(), *y, dy[1], dy[2]]
        result = ca.cse(result)
        shown = [result[layout.slice_of(name), :] for name in ("voltage_V", "temperature_K")]
        return ca.Function("tangent", inputs, [result, ca.vertcat(*shown)])

    def _equations(self, z: _Unknown, state: ca.SX, drive: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
        """F, in the order of `_Unknown`, and G."""
        model = self.model
        _, *prepared = model._prepare()(state, drive, p)
        old = model.layout.split(state)
        reactions = z.reaction_n, z.reaction_p
        at_surface = [
            known - gain * reaction
            for known, gain, reaction in zip(prepared[:2], prepared[2:4], reactions, strict=True)
        ]
        surfaces = model._surfaces(z, at_surface, old, drive[0])
        following, _ = model._finish()(z.vector(), *prepared[4:], state, drive, p)
        return model._residual(z, surfaces, old, drive), following
