"""A smooth correction of the open-circuit curve; `ocp_evidence.py` tells where there is one.

At rest a cell shows the difference of its potentials alone, so one of them is enough: bumps
    sum of height_k exp(-((y - centre_k) / width)**2)
evenly over the window of the positive electrode are added to its potential, in the cell itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from twin.bpx_file import open_circuit_V
from twin.bpx_function import Expression
from twin.bpx_out import plus
from twin.calibrate.cell_map import Infeasible
from twin.cell import Cell

FloatArray = npt.NDArray[np.float64]

ROWS_A_WIDTH = 15  # of a potential that is a table
SHOWN = 101  # states of charge
WINDOW_MOVES = 0.1  # of the stoichiometry, at most, with the correction


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """Of the positive electrode's open-circuit potential, and the evidence for it.

    Attributes:
        centres: (k,) of the bumps, stoichiometries from full to empty.
        width: at which a bump has fallen to 1/e.
        heights_V: (k,) of the bumps.
        stds_V: (k,) their standard errors.
        test: name of the slow discharge.
        rms_V: what it left without correction,
        corrected_rms_V: and what the correction is expected to leave.
        gain: criterion after Schwarz (difference of BIC): least squares saved over the variance
            left with it (correlation counted, noise at the least), minus ln(samples that tell
            something) for each bump that the data and not the prior sets.
    """

    centres: tuple[float, ...]
    width: float
    heights_V: tuple[float, ...]
    stds_V: tuple[float, ...]
    test: str
    rms_V: float
    corrected_rms_V: float
    gain: float

    @property
    def added(self) -> Expression:
        """To the potential [V], of the stoichiometry."""
        return Expression(
            " + ".join(
                f"({height!r}) * exp(-((x - {centre!r}) / {self.width!r}) ** 2)"
                for centre, height in zip(self.centres, self.heights_V, strict=True)
            )
        )

    def at_V(self, y: FloatArray) -> FloatArray:
        """(m,) at stoichiometries (m,)."""
        return np.asarray(bumps(y, self.centres, self.width) @ np.array(self.heights_V))

    def along(self) -> tuple[FloatArray, FloatArray]:
        """(m,) state of charge from full to empty, and what is added there [V]."""
        y = np.linspace(self.centres[0], self.centres[-1], SHOWN)
        return np.linspace(1.0, 0.0, SHOWN), self.at_V(y)

    def __str__(self) -> str:
        soc, added_V = self.along()
        low, high = int(added_V.argmin()), int(added_V.argmax())
        return (
            f"{self.test}: the open-circuit curve of the cell is corrected, from "
            f"{1e3 * added_V[low]:+.1f} mV at {100 * soc[low]:.0f} % charge to "
            f"{1e3 * added_V[high]:+.1f} mV at {100 * soc[high]:.0f} %; without it the fit "
            f"leaves {1e3 * self.rms_V:.1f} mV rms of this test, {1e3 * self.corrected_rms_V:.1f} "
            "mV of them not explained by such a curve"
        )

    def of_cell(self, cell: Cell) -> Cell:
        """The same cell with it; its windows end at the same rest voltages, else Infeasible."""
        every = self.width / ROWS_A_WIDTH
        positive, branches = cell.positive, cell.positive_hysteresis
        raised = replace(positive, ocp_V=plus(positive.ocp_V, self.added, every))
        if branches is not None:
            branches = replace(
                branches,
                lithiation_V=plus(branches.lithiation_V, self.added, every),
                delithiation_V=plus(branches.delithiation_V, self.added, every),
            )
        moved = replace(cell, positive=raised, positive_hysteresis=branches)
        full, empty = (_end(moved, soc, open_circuit_V(cell, soc)) for soc in (1.0, 0.0))
        window = replace(raised, stoichiometry_min=full, stoichiometry_max=empty)
        return replace(moved, positive=window)


def bumps(y: FloatArray, centres: Sequence[float], width: float) -> FloatArray:
    """(m, k) of height 1, at stoichiometries (m,)."""
    return np.asarray(np.exp(-(((y[:, None] - np.asarray(centres)) / width) ** 2)))


def _end(cell: Cell, soc: float, voltage_V: float) -> float:
    """Positive stoichiometry where the cell, full (soc 1) or empty (0), rests at a voltage.

    Infeasible if that is further than WINDOW_MOVES from where it did before.
    """
    positive, full = cell.positive, soc > 0.5

    def above_V(y: float) -> float:
        moved = (
            replace(positive, stoichiometry_min=y)
            if full
            else replace(positive, stoichiometry_max=y)
        )
        return open_circuit_V(replace(cell, positive=moved), soc) - voltage_V

    old = positive.stoichiometry_min if full else positive.stoichiometry_max
    reach = min(WINDOW_MOVES, old, 1 - old)
    ends_V = above_V(old - reach), above_V(old + reach)
    if ends_V[0] * ends_V[1] > 0:
        raise Infeasible(
            f"the corrected curve comes to {voltage_V:.3f} V nowhere near {old:.3f}",
            by=min(map(abs, ends_V)),
        )
    return float(brentq(above_V, old - reach, old + reach, xtol=1e-12))
