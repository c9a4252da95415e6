"""Three modules of a Nissan Leaf (2013), aged: 6 pairs of cells in series, 1C down to empty.

And a single cell of the make at 1C and 2C, again and again.

Recordings: batterysim/equiv-circ-model, MIT; of the modules with the voltage of every pair.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proof.recorded.measured import FloatArray, RealTest, recording

SINGLE = "battery/leaf/cell-discharge-bitrode-{}c.csv"
SINGLE_COLUMNS = (1, 8, 9)  # time, charging current, voltage
FLOWS_A = 20.0
RESTING = 5  # samples of rest that are kept
FILE = "battery/leaf/module123-irdischarge-65ah-1_0c.csv"
SERIES, PARALLEL = 6, 2
COLUMNS = ("Total Time", "Current", *(f"Cell Voltage A{k}" for k in range(1, SERIES + 1)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cells:
    """A recording with every cell of the series.

    Attributes:
        time_s: (n,) from 0, increasing.
        current_A: (n,) of the pack, discharge positive.
        cell_voltage_V: (n, cells)
    """

    time_s: FloatArray
    current_A: FloatArray
    cell_voltage_V: FloatArray

    @property
    def voltage_V(self) -> FloatArray:
        """(n,) of the pack."""
        return np.asarray(self.cell_voltage_V.sum(axis=1))

    def every(self, step: int) -> "Cells":
        """Each so-manieth sample."""
        own = slice(None, None, step)
        return Cells(
            time_s=self.time_s[own],
            current_A=self.current_A[own],
            cell_voltage_V=self.cell_voltage_V[own],
        )


def module(folder: Path) -> Cells:
    """The whole recording: 20 s of rest, then 65 A."""
    with recording(folder, FILE).open(encoding="latin-1", newline="") as stream:
        lines = list(csv.reader(stream))
    first = next(k for k, line in enumerate(lines) if line and line[0] == COLUMNS[0])
    places = [lines[first].index(name) for name in COLUMNS]
    rows = np.array([[float(line[k]) for k in places] for line in lines[first + 1 :] if line])
    rows = rows[np.append(True, np.diff(rows[:, 0]) > 0)]
    return Cells(time_s=rows[:, 0] - rows[0, 0], current_A=-rows[:, 1], cell_voltage_V=rows[:, 2:])


def single(folder: Path, times: int, which: int) -> RealTest:
    """A discharge of the single cell at so many C, with the last of the rest before it.

    Args:
        folder: of the recordings.
        times: 1 or 2, of 30.6 A.
        which: of the equal discharges of the file, from 0; at 2C nothing was recorded before 0.
    """
    file = SINGLE.format(times)
    with recording(folder, file).open(encoding="latin-1", newline="") as stream:
        lines = [line for line in csv.reader(stream) if line and line[0].strip() == "No"]
    rows = np.array([[float(line[k]) for k in SINGLE_COLUMNS] for line in lines])
    rows = rows[np.append(True, np.diff(rows[:, 0]) > 0)]
    flows = np.concatenate([[0], (-rows[:, 1] > FLOWS_A).astype(int), [0]])
    start, stop = np.flatnonzero(np.diff(flows)).reshape(-1, 2)[which].tolist()
    own = rows[start - RESTING : stop]
    return RealTest(
        name=f"{times}C, {which}",
        time_s=own[:, 0] - own[0, 0],
        current_A=-own[:, 1],
        voltage_V=own[:, 2],
    )
