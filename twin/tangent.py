"""The derivative of a step that is already taken: how a change of state and parameters goes on.

With y = (state, drive, p), a step solves two systems and hands on G(e, z, y):
  R(e, y) = 0     salt e that unchanged reactions would lead to: linear in e
  F(e, z, y) = 0  z as in `Unknown`
At their solution de = -(dR/de)^-1 dR/dy dy, dz likewise, and the next state changes by
dG/de de + dG/dz dz + dG/dy dy: the implicit function theorem, so neither an iteration nor an
elimination is differentiated. What Newton left unsolved (see `CONVERGED_V`) is the error of the
derivative, relative.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from twin import elimination
from twin.chain_rule import ChainRule, split
from twin.kernel import c_of
from twin.lanes import c_of_lanes
from twin.stages import Unknown
from twin.step import StepModel

SHOWN = ("voltage_V", "temperature_K")
NAME = "tangent"  # of the step, in C too

STEP = """
/* lane k of number i is at v[k*n+i]: from there, and to there */
static inline void gather(const double* v, int n, lanes* to) {
  for (int i = 0; i < n; ++i) for (int k = 0; k < LANES; ++k) to[i][k] = v[k*n+i];
}
static inline void scatter(const lanes* from, int n, double* v) {
  for (int k = 0; k < LANES; ++k) for (int i = 0; i < n; ++i) v[k*n+i] = from[i][k];
}
static int %(name)s(const casadi_real** arg, casadi_real** res, casadi_int* iw, casadi_real* w,
                    int mem) {
  /* behind the seven inputs and the two outputs is scratch, which what is shared may use */
  const casadi_real **in = arg + 7;
  casadi_real known[%(known)d], **out = res + 2;
  lanes d_state[%(state)d], d_drive[%(drive)d], d_p[%(p)d], d_after[%(state)d], d_shown[%(shown)d];
  in[0] = arg[1]; in[1] = arg[0]; in[2] = arg[2]; in[3] = arg[3];
  out[0] = known;
  if (shared(in, out, iw, w, mem)) return 1;
  for (casadi_int i = 0; i < %(state)d; ++i) res[0][i] = arg[1][i];
  for (casadi_int k = 0; k < *arg[6]; k += LANES) {
    gather(arg[0] + (1 + k) * %(state)d, %(state)d, d_state);
    gather(arg[4] + k * %(drive)d, %(drive)d, d_drive);
    gather(arg[5] + k * %(p)d, %(p)d, d_p);
    along(known, d_state, d_drive, d_p, d_after, d_shown);
    scatter(d_after, %(state)d, res[0] + (1 + k) * %(state)d);
    scatter(d_shown, %(shown)d, res[1] + k * %(shown)d);
  }
  return 0;
}
"""


@dataclass(frozen=True, slots=True)
class Equations:
    """Of one step.

    Attributes:
        expected: (nodes,) e.
        unknown: z.
        linear: (nodes, nodes) dR/de.
        made: (nodes,) linear @ e.
        balance: (nodes,) R.
        misses: F, in the order of `Unknown.vector`.
        following: G, the next state.
    """

    expected: ca.SX
    unknown: Unknown
    linear: ca.SX
    made: ca.SX
    balance: ca.SX
    misses: ca.SX
    following: ca.SX


def tangent_step(shared: ca.Function, along: ca.Function, directions: int) -> ca.Function:
    """((state, dstate), after, drive, p, ddrive, dp, directions) -> (carried, shown).

    Of `Tangent.split`. All d have one column per direction, those of dstate one after the other
    behind the state; `shown` is the change of SHOWN, direction by direction. How many directions
    there are is told for the C code's sake (`c_of_tangent`), which is the same for any number.
    """
    size, *sizes = (along.numel_in(k) for k in (1, 2, 3))
    carried, after = ca.MX.sym("carried", size * (1 + directions)), ca.MX.sym("after", size)
    given = [ca.MX.sym("given", n) for n in sizes]
    changes = [ca.MX.sym("d", n, directions) for n in sizes]
    state, *dstates = ca.vertsplit(carried, size)
    known = shared(after, state, *given)
    dy = zip(dstates, *map(ca.horzsplit, changes), strict=True)
    out = [along(known, *own) for own in dy]
    whole = [ca.vertcat(after, *(o[0] for o in out)), ca.vertcat(*(o[1] for o in out))]
    return ca.Function(NAME, [carried, after, *given, *changes, ca.MX.sym("directions")], whole)


def c_of_tangent(shared: ca.Function, along: ca.Function) -> str:
    """C of `tangent_step` along as many directions as its last input says, whole LANES."""
    sizes = {
        "known": along.numel_in(0), "state": along.numel_in(1), "drive": along.numel_in(2),
        "p": along.numel_in(3), "shown": along.numel_out(1),
    }  # fmt: skip
    return c_of(shared) + c_of_lanes([along], alike=[0]) + STEP % {"name": NAME, **sizes}


@dataclass(frozen=True, slots=True)
class Tangent:
    """Of the steps of a `StepModel`."""

    model: StepModel

    def split(self) -> tuple[ca.Function, ca.Function]:
        """What all directions share, and the change along one of them.

        (state after, state, drive, p) -> shared
        (shared, dstate, ddrive, dp) -> (dstate after, of it SHOWN).
        """
        change = self._change()
        given = [ca.SX.sym(change.name_in(i), change.size_in(i)) for i in range(change.n_in())]
        at, along = given[:4], given[4:]
        known, values, result = split(change(*given), ca.vertcat(*at), ca.vertcat(*along))
        shown = ca.vertcat(*(result[self.model.layout.slice_of(name)] for name in SHOWN))
        solved, after = ca.Function("solved", at, [values]), ca.SX.sym("after", at[1].numel())
        return (
            ca.Function("shared", [after, *at[1:]], [solved(self._solved(after, at[1]), *at[1:])]),
            ca.Function("along", [known, *along], [result, shown]),
        )

    def _solved(self, after: ca.SX, before: ca.SX) -> ca.SX:
        """(unknowns,) z of a step that led from the state `before` to `after`."""
        at, reactions = self.model.layout.slice_of, []
        for key in ("n", "p"):
            reaction, left = after[at(f"reaction_{key}")], f"left_{key}"
            if self.model.ageing:  # see `StepModel._aged`
                reaction *= after[at(left)] / before[at(left)]
            reactions.append(reaction)
        return ca.vertcat(*reactions, after[at("gap_V")], after[at("salt")])

    def _change(self) -> ca.Function:
        """(z, state, drive, p, dstate, ddrive, dp) -> change of the next state."""
        model, eq = self.model, self._equations()
        y, e, z = [model.state, model.drive, model.p.vector], eq.expected, eq.unknown.vector()
        dy = [ca.SX.sym("d", v.numel()) for v in y]
        order = model.layout.elimination_order()
        nodes, last = e.numel(), e.numel() + z.numel()
        no_e, no_z = ca.SX(nodes, 1), ca.SX(z.numel(), 1)
        rule = ChainRule(ca.vertcat(eq.balance, eq.misses, eq.following), ca.vertcat(e, z, *y))
        missed = rule.along(ca.vertcat(no_e, no_z, *dy))[:nodes, :]
        de = _solution(eq.linear, -missed, order)
        missed = rule.along(ca.vertcat(de, no_z, *dy))[nodes:last, :]
        dz = _solution(ca.jacobian(eq.misses, z), -missed, self._order())
        change = rule.along(ca.vertcat(de, dz, *dy))[last:, :]
        at = ca.Function("at", [e, z, *y, *dy], [change])
        expected = ca.Function("expected", y, [_solution(eq.linear, eq.made, order)])
        return ca.Function("change", [z, *y, *dy], [at(expected(*y), z, *y, *dy)])

    def _equations(self) -> Equations:
        model, old = self.model, self.model.old
        z, expected, begun = model.unknown(), ca.SX.sym("e", model.layout.nodes), model.begun()
        porosity = begun.porosity if begun else None
        linear, moved, made = model.electrolyte.balance(old, model.drive[0], porosity)
        moved += linear @ old["salt"]
        response = ca.SX(model.layout.nodes, sum(model.layout.electrodes))
        ready = model.ready(begun, expected, (z.salt, response))
        surfaces = model.surfaces(z, ready)
        (miss_n, missing_n), (miss_p, missing_p) = model.misses(z, ready, surfaces)
        before = made @ model.transfer(model.old_totals())
        after = made @ model.transfer((surfaces[0].total, surfaces[1].total))
        salt = linear @ z.salt - moved - (before + after) / 2
        answers = ca.SX.zeros(sum(model.layout.electrodes))  # only a guess: nothing depends on it
        following, _ = model.finished(z, answers, ready)
        return Equations(
            expected=expected,
            unknown=z,
            linear=linear,
            made=moved + before,
            balance=linear @ expected - moved - before,
            misses=ca.vertcat(miss_n, miss_p, missing_n, missing_p, salt),
            following=following,
        )

    def _order(self) -> list[int]:
        """Positions in `Unknown.vector` as they are eliminated: reactions, gaps, salt.

        Reactions see the salt of their own electrode, whose nodes see each other anyway: they fill
        no zero of the salt's equations.
        """
        first = sum(self.model.layout.electrodes) + 2
        return [*range(first), *(first + i for i in self.model.layout.elimination_order())]


def _solution(matrix: ca.SX, rhs: ca.SX, order: list[int]) -> ca.SX:
    """(n,) x with matrix @ x = rhs; `order` is that of the pivots."""
    solution = elimination.solve(matrix[order, order], rhs[order, :])
    return solution[np.argsort(order).tolist(), :]
