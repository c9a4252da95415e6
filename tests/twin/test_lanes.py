"""Vectors of directions, against CasADi's own code for the same."""

from functools import partial

import casadi as ca
import numpy as np
import pytest

from twin.compiled import compiler
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


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
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
