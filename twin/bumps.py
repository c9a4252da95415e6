"""An open-circuit potential whose smooth correction is numbers of the kernel.

sum of height_k exp(-((x - centre_k) / width)**2), evenly spaced, is added to a potential as it was
given. The heights can be fitted like any other number, without a kernel of their own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import casadi as ca

from twin.bpx_function import Expression
from twin.bpx_out import plus
from twin.cell import Cell, Function

HEIGHT = "ocp_bump_"  # in the name of each
ROWS_A_WIDTH = 15  # of a potential that is a table


@dataclass(frozen=True, slots=True)
class Bumped:
    """A potential [V] and bumps on it, of stoichiometry.

    Attributes:
        plain: the potential without them.
        centres: (k,) of the bumps.
        width: at which a bump has fallen to 1/e.
    """

    plain: Function
    centres: tuple[float, ...]
    width: float

    def __call__(self, x: ca.SX) -> ca.SX:
        """With heights of 0."""
        return self.plain(x)

    def raised_V(self, x: ca.SX, heights_V: Iterable[ca.SX]) -> ca.SX:
        """What the bumps are, of the shape of x, with these heights (k,)."""
        each = zip(self.centres, heights_V, strict=True)
        return sum((h * ca.exp(-(((x - c) / self.width) ** 2)) for c, h in each), 0 * x)

    def names(self, side: str) -> tuple[str, ...]:
        """(k,) of the heights among the kernel's numbers."""
        return tuple(f"{side}.{HEIGHT}{k}_V" for k in range(1, len(self.centres) + 1))

    def settled(self, heights_V: Iterable[float], function: Function) -> Function:
        """`function` with the bumps in it, as BPX writes it."""
        added = Expression(
            " + ".join(
                f"({height!r}) * exp(-((x - {centre!r}) / {self.width!r}) ** 2)"
                for centre, height in zip(self.centres, heights_V, strict=True)
            )
        )
        return plus(function, added, self.width / ROWS_A_WIDTH)


def evenly(plain: Function, full: float, empty: float, count: int) -> Bumped:
    """So many bumps from one stoichiometry to another."""
    step = (empty - full) / (count - 1)
    return Bumped(plain, tuple(full + k * step for k in range(count)), abs(step))


def bump_names(cell: Cell) -> tuple[str, ...]:
    """Of all heights in a cell, as the kernel has them; none in most cells."""
    sides = {"negative": cell.negative.ocp_V, "positive": cell.positive.ocp_V}
    return tuple(
        name for side, v in sides.items() if isinstance(v, Bumped) for name in v.names(side)
    )


def is_bump(name: str) -> bool:
    """It is one of the heights."""
    return HEIGHT in name


def settled(cell: Cell, numbers: Mapping[str, float]) -> Cell:
    """A cell whose bumps are part of its potentials, as BPX writes them; without any, the same.

    `numbers` are the kernel's, the heights among them.
    """
    for side in ("negative", "positive"):
        electrode, branches = getattr(cell, side), cell.hysteresis(side)
        bumped = electrode.ocp_V
        if not isinstance(bumped, Bumped):
            continue
        heights_V = [numbers[name] for name in bumped.names(side)]
        if branches is not None:
            branches = replace(
                branches,
                lithiation_V=bumped.settled(heights_V, branches.lithiation_V),
                delithiation_V=bumped.settled(heights_V, branches.delithiation_V),
            )
        electrode = replace(electrode, ocp_V=bumped.settled(heights_V, bumped.plain))
        cell = replace(cell, **{side: electrode, f"{side}_hysteresis": branches})
    return cell
