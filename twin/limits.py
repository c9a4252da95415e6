"""What a step may not go beyond, and which limit it was that ended a run."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.kinetics import SURFACE_MARGIN, SALT_FLOOR_mol_m3
from twin.newton import CONVERGED_V
from twin.solution import Status
from twin.step import OUTPUTS

FloatArray = npt.NDArray[np.float64]

LOWER_TOLERANCE_V = 1e-4
UPPER_TOLERANCE_V = 5e-3  # a full cell at rest, under a sensor's noise, is not being overcharged
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


@dataclass(frozen=True, slots=True)
class Limits:
    """What a step may not go beyond.

    Cut-off voltages are the pack's, shared out to its cells: charger and flight controller see no
    single cell, so one may go beyond. Salt and stoichiometry are those of the cell that is worst
    off.
    """

    lower_V: float
    upper_V: float

    def beyond(self, out: FloatArray, current_A: FloatArray) -> npt.NDArray[np.bool_]:
        """(limits, m) in the order of `REACHED`, for outputs (OUTPUTS, m) at currents (m,)."""
        voltage = out[COLUMN["voltage_V"]]
        return np.array(
            [
                out[COLUMN["salt_min_mol_m3"]] <= -DEPLETED * SALT_FLOOR_mol_m3,
                out[COLUMN["surface_margin"]] <= SURFACE_MARGIN,
                (voltage < self.lower_V - LOWER_TOLERANCE_V) & (current_A > 0),
                (voltage > self.upper_V + UPPER_TOLERANCE_V) & (current_A < 0),
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
