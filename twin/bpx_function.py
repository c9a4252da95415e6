"""Functions as BPX writes them: a number, an expression in x, or a table; callable with CasADi.

They are values: comparable, hashable and picklable, so a `Cell` may cross to a worker process.
"""

import ast
import operator
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
from scipy.interpolate import PchipInterpolator

TABLE_REFINEMENT = 16  # pieces between two rows: slope jumps shrink to a sixteenth at a node

_BINARY: dict[type[ast.operator], Callable[[ca.SX, ca.SX], ca.SX]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_CALLS: dict[str, Callable[[ca.SX], ca.SX]] = {"exp": ca.exp, "tanh": ca.tanh, "cosh": ca.cosh}


class ExpressionError(ValueError):
    """The text is no BPX expression; the message says which part."""


@dataclass(frozen=True, slots=True)
class Constant:
    """The same everywhere."""

    value: float

    def __call__(self, x: ca.SX) -> ca.SX:
        """Of the shape of x; independent of x in structure too."""
        return 0 * x + self.value


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression in Python syntax: numbers, x, + - * / **, exp, tanh, cosh.

    It is walked, never executed: text from a file runs no code. ExpressionError at construction.
    """

    text: str

    def __post_init__(self) -> None:
        try:
            _walk(_tree(self.text), ca.SX.sym("x"))
        except (SyntaxError, ZeroDivisionError, OverflowError) as e:
            raise ExpressionError(f"{self.text!r}: {e}") from e

    def __call__(self, x: ca.SX) -> ca.SX:
        """Element by element; a text without x is the same everywhere."""
        return _walk(_tree(self.text), x) + 0 * x


@dataclass(frozen=True, slots=True)
class Table:
    """Rows (x, y): exact in the rows, monotone where they are, straight beyond the ends.

    Between rows a monotone cubic (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 238 (1980),
    doi:10.1137/0717021), drawn with TABLE_REFINEMENT straight pieces. Straight lines from row to
    row, as PyBaMM draws them, make steps of dU/dx and with them of the cell's resistance.
    ExpressionError if there are fewer than two rows, or an x twice.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.x) < 2 or len(self.x) != len(self.y):
            raise ExpressionError(f"a table of {len(self.x)} x and {len(self.y)} y")
        if not np.isfinite([*self.x, *self.y]).all():
            raise ExpressionError("a table with an entry that is not finite")
        rows = sorted(zip(self.x, self.y, strict=True))
        object.__setattr__(self, "x", tuple(float(a) for a, _ in rows))
        object.__setattr__(self, "y", tuple(float(b) for _, b in rows))
        if (twice := np.flatnonzero(np.diff(self.x) <= 0)).size:
            raise ExpressionError(f"a table with x = {self.x[twice[0]]} twice")

    def __call__(self, x: ca.SX) -> ca.SX:
        """Element by element."""
        look_up = _look_up(self.x, self.y)
        return ca.reshape(ca.vertcat(*(look_up(e) for e in ca.vertsplit(ca.vec(x)))), x.shape)


@cache
def _look_up(x: tuple[float, ...], y: tuple[float, ...]) -> ca.Function:
    share = np.arange(TABLE_REFINEMENT) / TABLE_REFINEMENT
    rows = np.asarray(x)
    fine = np.append((rows[:-1, None] + np.diff(rows)[:, None] * share).ravel(), rows[-1])
    with np.errstate(over="ignore"):  # a slope below 1e-308 has an infinite reciprocal: it is 0
        values = PchipInterpolator(rows, np.asarray(y))(fine)
    values[::TABLE_REFINEMENT] = y
    options = {"lookup_mode": ["binary"]}
    return ca.interpolant("table", "linear", [fine], values, options)


@cache
def _tree(text: str) -> ast.expr:
    return ast.parse(text.strip(), mode="eval").body


def _walk(node: ast.expr, x: ca.SX) -> ca.SX:
    match node:
        case ast.Constant(value=float() | int() as number) if not isinstance(number, bool):
            return ca.SX(float(number))
        case ast.Name(id="x"):
            return x
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_walk(operand, x)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _walk(operand, x)
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=1.5)):
            base = _walk(left, x)  # of conductivities; a square root is much faster
            return base * ca.sqrt(base)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _BINARY[type(op)](_walk(left, x), _walk(right, x))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in _CALLS:
            return _CALLS[name](_walk(argument, x))
    raise ExpressionError(
        f"{ast.unparse(node)!r} is no part of a BPX expression (numbers, x, + - * / **, "
        f"{', '.join(_CALLS)})"
    )
