"""Derivatives of many expressions in few directions, at few operations a direction.

CasADi's own forward derivative of an expression repeats, in every direction, a multiplication for
every operation. Here operations that depend on one quantity alone are joined before: an
open-circuit potential of thirty operations becomes one factor, and what all directions share can be
taken out (`split`).

Source: Griewank, Walther, Evaluating Derivatives (SIAM 2008), doi:10.1137/1.9780898717761, chapters
9 and 10: preaccumulation.
"""

from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import casadi as ca

Factors = dict[int, ca.SX]
"""Quantity -> how much something changes with it."""


class Operation(NamedTuple):
    """One instruction of a CasADi function of scalars: work[to] = op(work[of], ...).

    A function that is called, as a table is, stays one operation: `called`.
    """

    op: int
    of: list[int]
    to: list[int]
    constant: float
    called: ca.Function | None


def operations(inputs: list[ca.SX], result: ca.SX) -> Iterator[Operation]:
    """What has to be done for `result` (n,), which is dense."""
    return instructions(ca.Function("f", inputs, [ca.densify(result)], {"cse": True}))


def instructions(f: ca.Function) -> Iterator[Operation]:
    """Of a function of scalars.

    An input is read from `of`: its place, and the place in it. An output is written likewise.
    """
    nodes = f.instructions_sx()
    for k in range(f.n_instructions()):
        op = f.instruction_id(k)
        constant = f.instruction_constant(k) if op == ca.OP_CONST else 0.0
        called = nodes[k].which_function() if op == ca.OP_CALL else None
        yield Operation(op, f.instruction_input(k), f.instruction_output(k), constant, called)


class ChainRule:
    """How `outputs` (n,) change with `inputs` (m,)."""

    def __init__(self, outputs: ca.SX, inputs: ca.SX) -> None:
        self._quantities: list[Factors] = []  # behind the inputs: how each changes with those above
        self._first = inputs.numel()
        self._outputs: list[Factors] = [{} for _ in range(outputs.numel())]
        symbols = ca.vertsplit(inputs)
        values: dict[int, ca.SX] = {}
        factors: dict[int, Factors] = {}
        for op, of, to, constant, called in operations([inputs], outputs):
            if op == ca.OP_OUTPUT:
                self._outputs[to[1]] = factors[of[0]]
            elif op == ca.OP_CONST:
                values[to[0]], factors[to[0]] = ca.SX(constant), {}
            elif op == ca.OP_INPUT:
                values[to[0]], factors[to[0]] = symbols[of[1]], {of[1]: ca.SX(1)}
            else:
                given = [values[a] for a in of]
                joined = _joined(op, given, [factors[a] for a in of], called)
                values[to[0]], factors[to[0]] = _value(op, given, called), self._known(joined)

    def _known(self, factors: Factors) -> Factors:
        """A new quantity, unless it changes with a single one."""
        if len(factors) < 2:
            return factors
        self._quantities.append(factors)
        return {self._first + len(self._quantities) - 1: ca.SX(1)}

    def along(self, direction: ca.SX) -> ca.SX:
        """(n,) change of the outputs along `direction` (m,)."""
        changes = ca.vertsplit(direction)
        for factors in self._quantities:
            changes.append(_sum(factors, changes))
        return ca.vertcat(*(_sum(factors, changes) for factors in self._outputs))


def _sum(factors: Factors, changes: list[ca.SX]) -> ca.SX:
    return sum((w * changes[q] for q, w in factors.items()), start=ca.SX(0))


def _value(op: int, given: list[ca.SX], called: ca.Function | None) -> ca.SX:
    if called is not None:
        return _call(called, given)
    value: ca.SX = ca.SX.unary(op, *given) if len(given) == 1 else ca.SX.binary(op, *given)
    return value


def _call(called: ca.Function, given: list[ca.SX]) -> ca.SX:
    """Of a function with one number as its result; those of `given` are all that it depends on."""
    if called.nnz_out() != 1:
        raise NotImplementedError(f"{called}: a call with other than one result")
    rest, arguments = iter(given), []
    for k in range(called.n_in()):
        own = called.sparsity_in(k)
        arguments.append(ca.SX(own, ca.vertcat(*(next(rest) for _ in range(own.nnz())))))
    return called(*arguments)


def _joined(
    op: int, given: list[ca.SX], factors: list[Factors], called: ca.Function | None
) -> Factors:
    """How the result of an operation changes with what its arguments change with."""
    if not any(factors):
        return {}
    out: Factors = {}
    for slope, of in zip(_slopes(op, given, called), factors, strict=True):
        if not slope.is_zero():
            for q, weight in of.items():
                out[q] = out.get(q, ca.SX(0)) + slope * weight
    return out


_SIMPLE: dict[int, Callable[..., list[ca.SX]]] = {
    ca.OP_ADD: lambda _x, _y: [ca.SX(1), ca.SX(1)],
    ca.OP_SUB: lambda _x, _y: [ca.SX(1), ca.SX(-1)],
    ca.OP_MUL: lambda x, y: [y, x],
    ca.OP_NEG: lambda _x: [ca.SX(-1)],
}  # most of all operations; the others are asked of CasADi


def _slopes(op: int, given: list[ca.SX], called: ca.Function | None) -> list[ca.SX]:
    if op in _SIMPLE:
        return _SIMPLE[op](*given)
    derivative = _derivative(op, len(given), called)
    slopes: list[ca.SX] = ca.vertsplit(derivative(ca.vertcat(*given)))
    return slopes


@cache
def _derivative(op: int, arity: int, called: ca.Function | None) -> ca.Function:
    x = ca.SX.sym("x", arity)
    value = _value(op, ca.vertsplit(x), called)
    return ca.Function("derivative", [x], [ca.densify(ca.jacobian(value, x).T)])


class _Known:
    """Values that follow from early inputs, and the symbols they go by later."""

    def __init__(self) -> None:
        self.values: list[ca.SX] = []
        self.symbols: list[ca.SX] = []
        self._slots: dict[int, ca.SX] = {}

    def symbol(self, slot: int, value: ca.SX) -> ca.SX:
        """Of what is in `slot` of the work; a number stands for itself."""
        if value.is_constant():
            return value
        if slot not in self._slots:
            self._slots[slot] = ca.SX.sym("known")
            self.symbols.append(self._slots[slot])
            self.values.append(value)
        return self._slots[slot]

    def forget(self, slot: int) -> None:
        """It holds something else from now on."""
        self._slots.pop(slot, None)


def split(result: ca.SX, early: ca.SX, late: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """(symbols, values, rest): `result` (n,) is `rest` with the symbols at their values.

    The values follow from `early` alone; `rest` holds the symbols and `late`.
    """
    inputs = ca.vertsplit(early), ca.vertsplit(late)
    work: dict[int, tuple[ca.SX, bool]] = {}  # value, and whether it needs `late`
    known, rest = _Known(), [ca.SX(0)] * result.numel()

    def inside(slot: int) -> ca.SX:
        value, needs_late = work[slot]
        return value if needs_late else known.symbol(slot, value)

    for op, of, to, constant, called in operations([early, late], result):
        if op == ca.OP_OUTPUT:
            rest[to[1]] = inside(of[0])
            continue
        if op == ca.OP_CONST:
            new = ca.SX(constant), False
        elif op == ca.OP_INPUT:
            new = inputs[of[0]][of[1]], of[0] == 1
        else:
            needs_late = any(work[a][1] for a in of)
            given = [inside(a) if needs_late else work[a][0] for a in of]
            new = _value(op, given, called), needs_late
        known.forget(to[0])
        work[to[0]] = new
    return ca.vertcat(*known.symbols), ca.vertcat(*known.values), ca.vertcat(*rest)
