"""A pack as it truly is: its cells, what leaves past the sensor, and what distorts the record."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from proof.simulated.cell_truth import CellTruth
from proof.simulated.configured import Configured

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PackTruth:
    """Cells in series and parallel, all alike but for one of the series.

    Attributes:
        cells: what each of them is.
        series: in series.
        parallel: strings.
        full_C: charge of the pack.
        weak_area: coated area of the one cell (the last) over that of the others.
        weak_soc: its state of charge at the start minus that of the others.
        weak_ohm: in series with it.
        leak_S: conductance across the pack, before the sensor.
        consumer_A: drawn before the sensor while the vehicle moves horizontally.
        faults: name and size, from the cells to the recorder.
    """

    cells: CellTruth
    series: int
    parallel: int
    full_C: float
    weak_area: float = 1.0
    weak_soc: float = 0.0
    weak_ohm: float = 0.0
    leak_S: float = 0.0
    consumer_A: float = 0.0
    faults: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, told: Configured) -> "PackTruth":
        """The pack that is as the twin believes."""
        return cls(
            cells=CellTruth(
                cell=told.cell,
                soc=told.start_soc,
                start_K=told.start_K,
                ambient_K=told.ambient_K,
                heat_transfer_W_m2_K=told.heat_transfer_W_m2_K,
            ),
            series=told.series,
            parallel=told.parallel,
            full_C=told.full_C,
        )

    def places(self) -> tuple[CellTruth, ...]:
        """(series,) each cell."""
        if (self.weak_area, self.weak_soc, self.weak_ohm) == (1.0, 0.0, 0.0):
            return (self.cells,) * self.series
        odd = replace(
            self.cells,
            soc=self.cells.soc + self.weak_soc,
            contact_ohm=self.cells.contact_ohm + self.weak_ohm * self.parallel,
            scaled=(*self.cells.scaled, ("Electrode width [m]", self.weak_area)),
        )
        return (self.cells,) * (self.series - 1) + (odd,)
