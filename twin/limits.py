"""What a step may not go beyond, and which limit it was that ended a run."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.kinetics import SURFACE_MARGIN, SALT_FLOOR_mol_m3
from twin.newton import CONVERGED_V
from twin.pack import Pack
from twin.solution import Status
from twin.step import OUTPUTS

FloatArray = npt.NDArray[np.float64]

LOWER_TOLERANCE_V = 1e-4
UPPER_TOLERANCE_V = 5e-3
IDLE_TOLERANCE_V = 0.05
"""Of a current below IDLE_RATE: a full cell at rest, under the noise of a sensor for a hundred
ampere, is not being overcharged. 0.23 A of it on a cell of 4 Ah at 15 degC were 11 mV."""
IDLE_RATE = 0.2  # of the rated capacity in an hour
COLUMN = {name: i for i, name in enumerate(OUTPUTS)}
REACHED = (
    Status.ELECTROLYTE_DEPLETED,
    Status.ELECTRODE_EMPTY,
    Status.LOWER_CUT_OFF,
    Status.UPPER_CUT_OFF,
)
DEPLETED = 20.0  # times the floor, below none: reactions end far above
NEARLY_DEPLETED = 50.0  # times the floor: where Newton fails with less, salt is why
NEARLY_EMPTY = 1e4  # likewise: a stoichiometry within 1 % of its end


def limits_of(pack: Pack) -> "Limits":
    """Of its cells."""
    idle_A = IDLE_RATE * pack.rated_C / pack.parallel / 3600
    return Limits(pack.cell.lower_cut_off_V, pack.cell.upper_cut_off_V, idle_A)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a step may not go beyond.

    Cut-off voltages are the pack's, shared out to its cells: charger and flight controller see no
    single cell, so one may go beyond. Salt and stoichiometry are those of the cell that is worst
    off. Currents are of one string of cells, as is `idle_A`, below which it idles.
    """

    lower_V: float
    upper_V: float
    idle_A: float

    def beyond(self, out: FloatArray, current_A: FloatArray) -> npt.NDArray[np.bool_]:
        """(limits, m) in the order of `REACHED`, for outputs (OUTPUTS, m) at currents (m,)."""
        voltage = out[COLUMN["voltage_V"]]
        idle = np.abs(current_A) < self.idle_A
        full_V = self.upper_V + np.where(idle, IDLE_TOLERANCE_V, UPPER_TOLERANCE_V)
        return np.array(
            [
                out[COLUMN["salt_min_mol_m3"]] <= -DEPLETED * SALT_FLOOR_mol_m3,
                out[COLUMN["surface_margin"]] <= SURFACE_MARGIN,
                (voltage < self.lower_V - LOWER_TOLERANCE_V) & (current_A > 0),
                (voltage > full_V) & (current_A < 0),
            ]
        )

    def accepts(self, out: FloatArray, current_A: FloatArray) -> npt.NDArray[np.bool_]:
        """(m,) solved and within all limits."""
        solved = np.isfinite(out).all(axis=0) & (out[COLUMN["correction_V"]] <= CONVERGED_V)
        return np.asarray(solved & ~self.beyond(out, current_A).any(axis=0))

    def reached(self, trial: FloatArray, last: FloatArray, current_A: float) -> Status:
        """Why `trial` was not accepted, a moment after `last` was."""
        for status, hit in zip(
            REACHED, self.beyond(trial[:, None], np.array([current_A]))[:, 0], strict=True
        ):
            if hit:
                return status
        if last[COLUMN["salt_min_mol_m3"]] < NEARLY_DEPLETED * SALT_FLOOR_mol_m3:
            return Status.ELECTROLYTE_DEPLETED
        if last[COLUMN["surface_margin"]] < NEARLY_EMPTY * SURFACE_MARGIN:
            return Status.ELECTRODE_EMPTY
        return Status.NOT_CONVERGED
