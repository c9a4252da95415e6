"""Newton's method for one step: the linear systems of an iteration, and the iterations."""

from typing import TYPE_CHECKING

import casadi as ca

from twin import elimination
from twin.stages import Ready, Surface, Unknown

if TYPE_CHECKING:
    from twin.step import StepModel

CONVERGED_V = 3e-4
"""Newton stops when a correction moves no potential by more: being quadratic, what is left after it
was measured to be below 1e-6 V."""
MAX_ITERATIONS = 8
CORRECTION = 3
"""Where the last correction is in what a step puts out."""


def corrected(model: "StepModel", z: Unknown, ready: Ready) -> tuple[ca.SX, ca.SX, ca.SX]:
    """(unknowns,) z after one iteration, and () the largest change of a potential [V].

    Also (n + p,) how the reactions answer a change of the current: the next step's first guess.

    Each electrode is solved for itself, its reactions and its gap. What one does to the salt in the
    other is left to the next iteration: it has to come through the separator. No pivot is near
    zero: the slopes are a positive charge-transfer resistance at every node on top of ohmic losses
    that no distribution of currents makes negative, and the last pivot is the conductance of all.
    """
    surfaces = model.surfaces(z, ready)
    misses = model.misses(z, ready, surfaces)
    transfer, changes_V, steps = model.transfer((surfaces[0].total, surfaces[1].total)), [], []
    answers, first = [], 0
    for k, side in enumerate(model.electrodes):
        nodes = slice(first, first := first + side.layer.size)
        slope, steep, taken = _slopes(model, z, ready, k, surfaces[k], nodes)
        matrix = ca.vertcat(
            ca.horzcat(slope, -ca.SX.ones(side.layer.size)), ca.horzcat(taken.T, ca.SX(1, 1))
        )
        more_current = ca.vertcat(ca.SX(side.layer.size, 1), side.outward / model.p["area_m2"])
        solution = elimination.solve(matrix, ca.horzcat(ca.vertcat(*misses[k]), more_current))
        step = solution[:, 0]
        transfer[nodes] += taken * step[:-1]
        changes_V += [steep * step[:-1], step[-1]]
        steps.append(step)
        answers.append(solution[:-1, 1])
    reactions = [i + step[:-1] for i, step in zip(z.reactions, steps, strict=True)]
    gaps = z.gap_V + ca.vertcat(*(step[-1] for step in steps))
    salt = ready.salt + ready.response @ transfer
    z_after = ca.vertcat(*reactions, gaps, salt)
    return z_after, ca.norm_inf(ca.vertcat(*changes_V)), ca.vertcat(*answers)


def _slopes(  # noqa: PLR0913
    model: "StepModel", z: Unknown, ready: Ready, k: int, surface: Surface, nodes: slice
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """How electrode k answers a change of its reactions.

    `nodes` are its own of both electrodes'. Returns what is missing less of the potential at each
    node (n, n), how much more the surface needs there (n,) [V per A/m2], and how much more current
    leaves the solid there (n,) [A/m2 of coated area per A/m2].
    """
    side, own = model.electrodes[k], ready.sides[k]
    n, span = side.layer.size, model.layout.layers()[side.name]
    ones = ca.SX.ones(n)  # what follows is local to a node, so its derivative is a diagonal
    steep = ca.jtimes(surface.needed_V, z.reactions[k], ones)
    taken = ca.jtimes(model.transfer_of(side, surface.total), z.reactions[k], ones)
    salty = ca.jtimes(surface.needed_V, z.salt, ca.SX.ones(model.layout.nodes))
    diffusion = model.diffusion_V() / model.floored(side, z.salt)
    response = ready.response[span, nodes]
    slope = own.losses_ohm_m2 + ca.repmat(diffusion + salty, 1, n) * response
    slope -= ca.repmat(diffusion[side.separator] * response[side.separator, :], n, 1)
    return slope * ca.repmat(taken.T, n, 1) + ca.diag(steep), steep, taken


def joined(prepare: ca.Function, correct: ca.Function, finish: ca.Function) -> ca.Function:
    """(state, drive, p) -> (next, out): iterations until a correction is within CONVERGED_V."""
    given = prepare.mx_in()
    z, *ready = prepare(*given)
    z, correction, answers = correct(z, *ready, *given)
    inputs = [ca.MX.sym("correction_V"), answers_in := ca.MX.sym("answers", answers.numel())]
    inputs += correct.mx_in()
    more = ca.Function("more", inputs, list(correct(*inputs[2:])))
    enough = ca.Function("enough", inputs, [inputs[2], inputs[0], answers_in])
    refine = ca.Function.if_else("refine", more, enough)
    for _ in range(MAX_ITERATIONS - 1):
        z, correction, answers = refine(
            correction > CONVERGED_V, correction, answers, z, *ready, *given
        )
    following, out = finish(z, answers, *ready, *given)
    out = ca.vertcat(out[:CORRECTION], correction, out[CORRECTION:])
    return ca.Function("step", given, [following, out], ["state", "drive", "p"], ["next", "out"])
