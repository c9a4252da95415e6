"""Samsung INR18650-30Q, 3 Ah, cells S001 and S002.

Recordings: ARTS Laboratory, University of South Carolina, CC BY-SA 4.0.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from proof.recorded.measured import RealCell, RealTest, nearest, recording
from twin.constants import ZERO_CELSIUS_K

FloatArray = npt.NDArray[np.float64]

FOLDER = "battery/samsung_30q/"
PULSES = "hppc/hppc_20degC_10pct_soc_steps.txt"
WARM_PULSES = "hppc/DNN01_HPPC_2C_40amb_processed_scrubbed.csv"
WARM_PERIOD_S = 1.0  # by the charge that the file counts from row to row
PERIOD_S = 1.0005  # of the pulse test, median
COLUMNS = {"time_s": 0, "current_A": 1, "voltage_V": 2, "temperature": 4}
LEAST_V = 2.0  # below it a sample is a fault of the logger


def read(folder: Path, name: str, cell: str = "S001") -> RealTest:
    """One discharge of a cell, S001 or S002."""
    path = recording(folder, f"{FOLDER}{cell}/Q30_{cell}_{name}.csv")
    return _test(name, np.genfromtxt(path, delimiter=",", encoding="utf-8-sig"), cell)


def pulses(folder: Path) -> RealTest:
    """10 s of 2C either way, then a tenth of the charge at 1C, again and again, at 20 degC.

    The logger starts each step's clock anew, at times of its own; the samples are 1 s apart
    throughout, so a step back or ahead is one PERIOD_S. Neither file nor source says which cell
    that was, nor in which mount: it has one of its own.
    """
    text = recording(folder, FOLDER + PULSES).read_text(encoding="latin-1")
    lines = (line.split("\t") for line in text.splitlines())
    rows = [line for line in lines if len(line) == 6 and line[0][:1].isdigit()]
    table = np.array(rows, dtype=float)
    table = np.insert(table, 3, 0.0, axis=1)[:, [0, 1, 2, 4, 5]]  # the columns of the discharges
    steps = np.diff(table[:, 0])
    steps[(steps <= 0) | (steps > 2 * PERIOD_S)] = PERIOD_S
    table[:, 0] = np.append(0.0, np.cumsum(steps))
    return _test("pulses 20 degC", table, "pulses")


def warm_pulses(folder: Path) -> RealTest:
    """Of a third cell, DNN01, at 40 degC: 10 s at 2C, a twentieth of the charge at C/3, an hour.

    No row has a time: they are WARM_PERIOD_S apart.
    """
    path = recording(folder, FOLDER + WARM_PULSES)
    charge_A, voltage_V, celsius, _ = np.loadtxt(path, delimiter=",", skiprows=1).T
    return RealTest(
        name="pulses 40 degC",
        time_s=WARM_PERIOD_S * np.arange(charge_A.size),
        current_A=-charge_A,
        voltage_V=voltage_V,
        temperature_K=celsius + ZERO_CELSIUS_K,
        mount="DNN01",
    )


def _test(name: str, table: FloatArray, cell: str) -> RealTest:
    sound = (np.abs(table) < 1e6).all(axis=1) & (table[:, COLUMNS["voltage_V"]] > LEAST_V)
    columns = {key: table[sound, place] for key, place in COLUMNS.items()}
    return RealTest(
        name=name,
        time_s=columns["time_s"] - columns["time_s"][0],
        current_A=-columns["current_A"],
        voltage_V=columns["voltage_V"],
        temperature_K=columns["temperature"] + ZERO_CELSIUS_K,
        mount=cell,
    )


def cell(folder: Path) -> RealCell:
    """Fitted on slow tests and pulses, judged at 2C to 4C."""
    slow = read(folder, "C10")
    baseline, source = nearest("lg_m50", slow)
    return RealCell(
        name="Samsung 30Q 3 Ah",
        fit=(slow, read(folder, "1C"), pulses(folder)),
        held_out=tuple(read(folder, name) for name in ("2C", "3C", "4C")),
        baseline=baseline,
        source=source,
        published=False,
    )
