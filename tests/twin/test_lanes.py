"""Operations on vectors, and tangents along directions in them, against CasADi's own code."""

from functools import partial

import casadi as ca
import numpy as np
import pytest

from twin import compiled, lanes
from twin.bpx_function import Table
from twin.chain_rule import instructions
from twin.kernel import CompiledLoop, VirtualLoop, kernel
from twin.tangent import c_of_tangent, tangent_step

STATE, DRIVE, P = 3, 1, 2


def parts() -> tuple[ca.Function, ca.Function]:
    """(after, state, drive, p) -> shared, and a change with every operation that there may be."""
    after, state, drive, p = (ca.SX.sym("v", n) for n in (STATE, STATE, DRIVE, P))
    known = ca.vertcat(after[0] * state[1], drive[0] > 0, p[0] + 2, ca.cos(after[2]))
    shared, ds, dd, dp = (ca.SX.sym("d", n) for n in (4, STATE, DRIVE, P))
    one = shared[0] * ds[0] - ds[1] / shared[2] + 0.25 * dd[0]
    two = ca.if_else(shared[1], one, 0) + (shared[3] + 1.5) * dp[1]
    after_change = ca.vertcat(one, -two, dp[0] - ds[2])
    return (
        ca.Function("shared", [after, state, drive, p], [known]),
        ca.Function("along", [shared, ds, dd, dp], [after_change, ca.vertcat(two, one)]),
    )


@pytest.mark.skipif(compiled.compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("directions", [4, 12])
def test_they_give_what_casadi_gives(directions: int) -> None:
    function, rng = tangent_step(*parts(), directions), np.random.default_rng(3)
    loop = kernel(function, code=partial(c_of_tangent, *parts()))
    each = [rng.normal(size=(9, STATE)), rng.normal(size=(9, DRIVE))]
    fixed = [rng.normal(size=n) for n in (P, DRIVE * directions, P * directions)]
    fixed.append(np.array([float(directions)]))
    given = rng.normal(size=STATE * (1 + directions)), each, fixed
    assert isinstance(loop, CompiledLoop)
    assert len(np.unique(each[1] > 0)) == 2  # a condition that holds and does not
    for own, expected in zip(loop(*given), VirtualLoop(function)(*given), strict=True):
        assert own == pytest.approx(expected, rel=1e-12, abs=1e-12)


def every_operation() -> ca.Function:
    """All that `lanes` knows, of two numbers; a table, and its slope; constants."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    one = [op for op in lanes.OPERATIONS if op in UNARY]
    both = [op for op in lanes.OPERATIONS if op not in UNARY]
    table = Table((0.0, 0.5, 2.0), (1.0, 3.0, 2.0))
    out = [ca.SX.unary(op, x) for op in one] + [ca.SX.binary(op, x, y) for op in both]
    out += [table(y), ca.jacobian(table(y), y)]
    out += [ca.SX(value) for value in (1e-300, np.inf, -np.inf, np.nan)]
    return ca.Function("every_operation", [x, y], [ca.vertcat(*map(ca.densify, out))])


UNARY = {
    ca.OP_NEG, ca.OP_SQ, ca.OP_TWICE, ca.OP_INV, ca.OP_SQRT, ca.OP_EXP, ca.OP_LOG, ca.OP_TANH,
    ca.OP_SINH, ca.OP_COSH, ca.OP_ASINH, ca.OP_FABS, ca.OP_SIGN, ca.OP_NOT,
}  # fmt: skip

ALL_OF_THEM = """
static int every(const casadi_real** arg, casadi_real** res, casadi_int* iw, casadi_real* w,
                 int mem) {
  every_operation((loose*)arg[1], (loose*)arg[2], (loose*)res[1]);
  return 0;
}
"""


@pytest.mark.skipif(compiled.compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("apart", [0, 7])
@pytest.mark.parametrize("without", ["", compiled.NATIVE])
def test_every_operation_is_that_of_casadi(
    apart: int, without: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In lanes that hold the same, and in such that do not; on a processor without them too."""
    flags = tuple(flag for flag in compiled.FLAGS if flag != without)
    monkeypatch.setattr(compiled, "FLAGS", flags)
    f = every_operation()
    known = {o.op for o in instructions(f)} | {ca.OP_CONSTPOW}
    assert known >= set(lanes.OPERATIONS)
    values = [0.0, -0.0, 1.0, -1.0, 0.3, -2.5, 700.0, 1e-300, np.inf, -np.inf, np.nan]
    pairs = np.array([(a, b) for a in values for b in values])
    rows = np.stack([np.roll(pairs, apart * k, axis=0) for k in range(lanes.LANES)], axis=1)
    given = [ca.MX.sym("v", lanes.LANES) for _ in range(3)]
    out = f.map(lanes.LANES)(given[1].T, given[2].T).T
    function = ca.Function("every", given, [given[0], out])
    loop = kernel(function, code=lambda: lanes.c_of_lanes([f]) + ALL_OF_THEM)
    assert isinstance(loop, CompiledLoop)
    own = loop(np.zeros(lanes.LANES), [rows[:, :, 0], rows[:, :, 1]], [])[1]
    own = own.reshape(len(pairs), -1, lanes.LANES)
    for k in range(lanes.LANES):
        expected = f.map(len(pairs))(rows[:, k, 0], rows[:, k, 1]).full().T
        assert own[:, :, k] == pytest.approx(expected, rel=1e-14, abs=1e-15, nan_ok=True)
