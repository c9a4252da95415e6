"""Three modules of a Nissan Leaf (2013), aged: 6 pairs of cells in series, 1C down to empty.

Recording: batterysim/equiv-circ-model, MIT, with the voltage of every pair and three thermocouples.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from proof.recorded.measured import FloatArray, recording
from twin.constants import ZERO_CELSIUS_K

DISAGREE = 3e-3
"""Of a voltage: the cycler's own, of the pack, is 0.99738 of the sum of its six inputs for cells,
less 0.48 mOhm of leads. Which of the two is right the file does not say; a question has the sum."""
FILE = "battery/leaf/module123-irdischarge-65ah-1_0c.csv"
SERIES, PARALLEL = 6, 2
PAIRS = tuple(f"A{k}" for k in range(1, SERIES + 1))
MODULES = ("A1", "A2", "A3")  # a thermocouple each
COLUMNS = (
    "Total Time", "Current", *(f"Cell Voltage {name}" for name in PAIRS),
    *(f"Temperature {name}" for name in MODULES),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cells:
    """A recording with every cell of the series.

    Attributes:
        time_s: (n,) from 0, increasing.
        current_A: (n,) of the pack, discharge positive.
        cell_voltage_V: (n, cells)
        temperature_K: (n,) mean of what was measured on them; None if it was not.
    """

    time_s: FloatArray
    current_A: FloatArray
    cell_voltage_V: FloatArray
    temperature_K: FloatArray | None = None

    @property
    def voltage_V(self) -> FloatArray:
        """(n,) of the pack."""
        return np.asarray(self.cell_voltage_V.sum(axis=1))

    def of(self, names: Sequence[str]) -> "Cells":
        """Some of PAIRS alone, in this order."""
        own = [PAIRS.index(name) for name in names]
        return replace(self, cell_voltage_V=self.cell_voltage_V[:, own])

    def every(self, step: int) -> "Cells":
        """Each so-manieth sample."""
        warm_K = self.temperature_K
        return Cells(
            time_s=self.time_s[::step],
            current_A=self.current_A[::step],
            cell_voltage_V=self.cell_voltage_V[::step],
            temperature_K=None if warm_K is None else warm_K[::step],
        )


def module(folder: Path) -> Cells:
    """The whole recording: 20 s of rest, then 65 A."""
    with recording(folder, FILE).open(encoding="latin-1", newline="") as stream:
        lines = list(csv.reader(stream))
    first = next(k for k, line in enumerate(lines) if line and line[0] == COLUMNS[0])
    places = [lines[first].index(name) for name in COLUMNS]
    rows = np.array([[float(line[k]) for k in places] for line in lines[first + 1 :] if line])
    rows = rows[np.append(True, np.diff(rows[:, 0]) > 0)]
    time_s, charge_A, cells_V, celsius = np.split(rows, (1, 2, 2 + SERIES), axis=1)
    return Cells(
        time_s=time_s[:, 0] - time_s[0, 0],
        current_A=-charge_A[:, 0],
        cell_voltage_V=cells_V,
        temperature_K=celsius.mean(axis=1) + ZERO_CELSIUS_K,
    )
