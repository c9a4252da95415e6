"""Functions of a cell whose smooth correction is numbers of the kernel.

sum of height_k exp(-((x - centre_k) / width)**2), evenly spaced, is added to a potential or an
entropic coefficient as it was given. Heights can be fitted like any other number, without a kernel
of their own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum

import casadi as ca

from twin.bpx_function import Expression
from twin.bpx_out import plus
from twin.cell import Cell, Function

ROWS_A_WIDTH = 15  # of a function that is a table


class Of(Enum):
    """What a height is of, in its name, and its unit."""

    POTENTIAL = ("ocp_bump_", "V")
    ENTROPY = ("entropic_bump_", "V_K")


@dataclass(frozen=True, slots=True)
class Bumped:
    """A function of stoichiometry, and bumps on it.

    Attributes:
        of: what it is.
        plain: the function without them.
        centres: (k,) of the bumps.
        width: at which a bump has fallen to 1/e.
    """

    of: Of
    plain: Function
    centres: tuple[float, ...]
    width: float

    def __call__(self, x: ca.SX) -> ca.SX:
        """With heights of 0."""
        return self.plain(x)

    def raised(self, x: ca.SX, heights: Iterable[ca.SX]) -> ca.SX:
        """What the bumps are, of the shape of x, with these heights (k,)."""
        each = zip(self.centres, heights, strict=True)
        return sum((h * ca.exp(-(((x - c) / self.width) ** 2)) for c, h in each), 0 * x)

    def names(self, side: str) -> tuple[str, ...]:
        """(k,) of the heights among the kernel's numbers."""
        what, unit = self.of.value
        return tuple(f"{side}.{what}{k}_{unit}" for k in range(1, len(self.centres) + 1))

    def settled(self, heights: Iterable[float], function: Function) -> Function:
        """`function` with the bumps in it, as BPX writes it."""
        added = Expression(
            " + ".join(
                f"({height!r}) * exp(-((x - {centre!r}) / {self.width!r}) ** 2)"
                for centre, height in zip(self.centres, heights, strict=True)
            )
        )
        return plus(function, added, self.width / ROWS_A_WIDTH)


def evenly(of: Of, plain: Function, full: float, empty: float, count: int) -> Bumped:
    """So many bumps from one stoichiometry to another."""
    step = (empty - full) / (count - 1)
    return Bumped(of, plain, tuple(full + k * step for k in range(count)), abs(step))


def bump_names(cell: Cell) -> tuple[str, ...]:
    """Of all heights in a cell, as the kernel has them; none in most cells."""
    found = {
        side: (electrode.ocp_V, electrode.entropic_V_K)
        for side, electrode in (("negative", cell.negative), ("positive", cell.positive))
    }
    return tuple(
        name
        for side, functions in found.items()
        for f in functions
        if isinstance(f, Bumped)
        for name in f.names(side)
    )


def is_bump(name: str) -> bool:
    """It is one of the heights."""
    return any(of.value[0] in name for of in Of)


def settled(cell: Cell, numbers: Mapping[str, float]) -> Cell:
    """A cell whose bumps are part of its functions, as BPX writes them; without any, the same.

    `numbers` are the kernel's, the heights among them.
    """
    for side in ("negative", "positive"):
        electrode, branches = getattr(cell, side), cell.hysteresis(side)
        ocp_V, entropic_V_K = electrode.ocp_V, electrode.entropic_V_K
        if isinstance(ocp_V, Bumped):
            heights = [numbers[name] for name in ocp_V.names(side)]
            electrode = replace(electrode, ocp_V=ocp_V.settled(heights, ocp_V.plain))
            if branches is not None:
                branches = replace(
                    branches,
                    lithiation_V=ocp_V.settled(heights, branches.lithiation_V),
                    delithiation_V=ocp_V.settled(heights, branches.delithiation_V),
                )
        if isinstance(entropic_V_K, Bumped):
            heights = [numbers[name] for name in entropic_V_K.names(side)]
            added = entropic_V_K.settled(heights, entropic_V_K.plain)
            electrode = replace(electrode, entropic_V_K=added)
        cell = replace(cell, **{side: electrode, f"{side}_hysteresis": branches})
    return cell
