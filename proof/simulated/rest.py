"""A rest before take-off, by whose voltage the judge is told how full the pack is."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from analyze.start import pack_use
from proof.simulated.configured import Configured
from proof.simulated.flights import PERIOD_S, TrueFlight
from segment.segment import Motion
from twin.builtin import load_cell
from twin.load_csv import LoadTable
from twin.mismatch import UNTOLD
from twin.pack_file import PackFile, PackTable

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rest:
    """Of a pack whose file states no charge.

    Attributes:
        soc: true state of charge at the start.
        seconds: before the flight.
        idle_A: that the pack gives meanwhile; 0 where the avionics have another supply.
    """

    soc: float
    seconds: float
    idle_A: float

    def before(self, flight: TrueFlight) -> TrueFlight:
        """It with the rest before it."""
        idle = round(self.seconds / PERIOD_S)
        current_A = np.concatenate([np.full(idle, self.idle_A), flight.current_A])
        return replace(
            flight,
            time_s=PERIOD_S * np.arange(current_A.size, dtype=float),
            current_A=current_A,
            motion=np.concatenate([np.full(idle, Motion.GROUND.value), flight.motion]),
            rest_s=self.seconds,
        )


def read(
    told: Configured, time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray
) -> Configured | None:
    """As the judge reads the start of a recording; None where it takes its rest for none.

    Columns are (n,).
    """
    file = PackFile(
        pack=PackTable(
            name="pack", cell=told.cell, capacity_ah=told.full_C / 3600,
            series=told.series, parallel=told.parallel,
        )
    )  # fmt: skip
    table = LoadTable(time_s=time_s, current_A=current_A, voltage_V=voltage_V)
    use = pack_use(None, file, load_cell(told.cell), builtin=True, table=table)
    known = use.soc_by_rest and use.soc_std < UNTOLD
    return told.rested(use.initial_soc) if known else None
