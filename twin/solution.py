"""`Solution`: what the twin answers to a load."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


class SimulationStopped(RuntimeError):
    """Raised by `Solution.require()`; the text is that of the status."""


class Status(Enum):
    """How a simulation ended; the value says what happened and what to try."""

    DONE = "the whole load was simulated"
    LOWER_CUT_OFF = (
        "the voltage reached the lower cut-off; the load asks for more than the cell holds"
    )
    UPPER_CUT_OFF = "the voltage reached the upper cut-off; the load charges a full cell"
    ELECTROLYTE_DEPLETED = (
        "the electrolyte has no salt left to carry the current; the load is beyond the rate this "
        "cell can deliver: check the capacity and the number of parallel cells"
    )
    ELECTRODE_EMPTY = (
        "an electrode's surface ran out of lithium, or of room for it; the load asks for more than "
        "the cell holds: check the start state of charge and the capacity"
    )
    NOT_CONVERGED = (
        "the equations could not be solved at this point; check the parameters of the cell, and "
        "whether the load is physical"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LithiumAudit:
    """Where the lithium is [mol], at the start and at the end; of one cell.

    Of a pack of unlike cells: amounts of the mean cell, errors of the cell that balances worst.

    Attributes:
        negative_mol: (2,) in the negative electrode, start and end.
        positive_mol: (2,) in the positive electrode, start and end.
        electrolyte_mol: (2,) in the electrolyte, start and end.
        lost_mol: likewise, by name: what is in films, plated, dead, or trapped in lost material;
            empty without ageing.
        relative_error: (end - start of the sum) / start of the sum.
        charge_error_C: integral of the load minus what the positive electrode took up.
    """

    negative_mol: FloatArray
    positive_mol: FloatArray
    electrolyte_mol: FloatArray
    lost_mol: Mapping[str, FloatArray]
    relative_error: float
    charge_error_C: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inside:
    """What no terminal shows, at n moments, of the cell that is worst off.

    Attributes:
        anode_V: (n,) least over the negative electrode of phi_s - phi_e less the film's loss:
            against lithium, which plates below 0.
        negative_stress_Pa: (2, n) hydrostatic stress at the surface of its particles, tension
            positive: the least and the greatest over the electrode.
        positive_stress_Pa: (2, n) likewise.
    """

    anode_V: FloatArray
    negative_stress_Pa: FloatArray
    positive_stress_Pa: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """The response of a pack to a load, up to where it ended.

    Attributes:
        time_s: (n,) the load's own sample times, as far as simulated.
        current_A: (n,) of the load, as recorded.
        voltage_V: (n,) as a sensor records it at the terminals, by a `VoltageGain`; each belongs to
            the current at the same time.
        temperature_K: (n,) mean over the cells, which close the energy balance together.
        soc: (n,) state of charge from the negative electrode's mean stoichiometry, 0..1; mean over
            the cells.
        heat_W: (n,) released inside, of the whole pack.
        audit: the lithium balance.
        status: how it ended.
        stopped_s: time at which it ended, located inside the sample if it ended early.
        steps: time steps taken, sub-steps included; where salt ran short those on the finer mesh.
        retried_steps: sub-steps that replaced a step which had not converged or was beyond a limit.
        charge_C: drawn from the pack up to where it ended: what flowed, not what was recorded.
        energy_J: likewise, at the voltage of its cells.
        end_state: the kernel's state there; `simulate(..., state=)` continues from it.
        cell_voltage_V: (series, n) of each cell; read-only where all are equal.
        cell_temperature_K: (series, n) likewise.
        inside: at the same times.
    """

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    temperature_K: FloatArray
    soc: FloatArray
    heat_W: FloatArray
    audit: LithiumAudit
    status: Status
    stopped_s: float
    steps: int
    retried_steps: int
    charge_C: float
    energy_J: float
    end_state: FloatArray
    cell_voltage_V: FloatArray
    cell_temperature_K: FloatArray
    inside: Inside

    def require(self) -> "Solution":
        """This solution if the whole load was simulated, else SimulationStopped with the reason."""
        if self.status is not Status.DONE:
            raise SimulationStopped(f"stopped at {self.stopped_s:.1f} s: {self.status.value}")
        return self
