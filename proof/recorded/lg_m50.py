"""LG M50, NMC811 against graphite with silicon, 5 Ah: the cell of Chen et al. 2020.

Recordings: WMG, University of Warwick, via pybop-team/PyBOP.
"""

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from proof.recorded.measured import (
    RealCell,
    RealTest,
    discharge_of,
    matlab,
    on_one_clock,
    recording,
    wide,
)
from twin.builtin import load_cell
from twin.constants import ZERO_CELSIUS_K
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

RATES = "battery/lg_m50/LGM50_5Ah_RateTest.mat"
PULSES = "battery/lg_m50/LGM50_5Ah_Pulse.mat"
PULSED = (9, 7, 5, 3, 1)  # tenths of charge; 10 s of 1.5C each
PULSED_CELL = "Cell1"
FELL_OHM = 0.007  # and more: of the voltage, at once, when a current begins
FLOWS_A = 1.0  # of a pulse of 7.5 A
WARM_C = 45  # of a chamber in which each rate is another cell again
OTHER = "battery/lg_m50/tec/Cell{}_{}_{}degC.csv"
OTHER_COLUMNS = (3, 7, 8, 13)  # time, voltage, charging current, temperature


def rate(raw: SimpleNamespace, degrees: int, name: str) -> RealTest:
    """One discharge; temperature in the middle of the cell.

    Each rate has a cell and a mount, and at WARM_C others: after 0.5C and 1C they cool in 782 and
    727 s, at 0 to 25 degC in 540 to 543 and 472 to 484 (`cools_s`).
    """
    test = getattr(getattr(raw, f"T{degrees}"), f"cRate_{name.replace('.', 'p')}")
    whole = RealTest(
        name=f"{name} {degrees} degC",
        time_s=test.timeVec,
        current_A=_flowing(-test.currVec, test.volVec),
        voltage_V=test.volVec,
        temperature_K=test.cellTemp_mid + ZERO_CELSIUS_K,
        mount=f"{name} {degrees} degC" if degrees == WARM_C else name,
    )
    return discharge_of(on_one_clock(whole))


def _flowing(current_A: FloatArray, voltage_V: FloatArray) -> FloatArray:
    """With the current in a first row that has its voltage already and itself not yet.

    The logger reads voltage and current one after the other. Such a first voltage is not that of
    rest: as the next row's current begins, it does not fall as a cell's does.
    """
    under_load = voltage_V[0] - voltage_V[1] < FELL_OHM * current_A[1]
    return np.concatenate([current_A[1:2] if under_load else current_A[:1], current_A[1:]])


def cools_s(raw: SimpleNamespace, degrees: int, name: str) -> float:
    """Time in which the middle of a cell loses all but 1/e of its warmth, at rest afterwards [s].

    By `RATES`, in a chamber at so many degrees Celsius. No heat is in it, and no twin: heat
    capacity over cooling, of the mount that the cell was in.
    """
    test = getattr(getattr(raw, f"T{degrees}"), f"cRate_{name.replace('.', 'p')}")
    ended = int(np.argmax(test.cellTemp_mid))
    above_K = test.cellTemp_mid[ended:] - test.cellTemp_mid[0]
    left = int(np.argmax(above_K < above_K[0] / np.e))
    return float(test.timeVec[ended + left] - test.timeVec[ended])


def other(folder: Path, cell: int, name: str, degrees: int, which: int = 0) -> RealTest:
    """A discharge of another cell of the batch (786, 796), with the last sample of the rest before.

    Recordings: brosaplanella/TEC-reduced-model; 0.5C was drawn twice, `which` counts from 0.
    """
    file = recording(folder, OTHER.format(cell, name.replace(".", "p"), degrees))
    with file.open(encoding="latin-1", newline="") as stream:
        lines = [line for line in csv.reader(stream) if line and line[0].strip().isdigit()]
    rows = np.array([[float(line[k]) for k in OTHER_COLUMNS] for line in lines])
    drawn = np.concatenate([[0], [line[1] == "DCH" for line in lines], [0]]).astype(int)
    start, stop = np.flatnonzero(np.diff(drawn)).reshape(-1, 2)[which].tolist()
    time_s, voltage_V, charge_A, celsius = rows[start - 1 : stop].T
    whole = RealTest(
        name=f"{name} {degrees} degC, cell {cell}, {which + 1}",
        time_s=time_s,
        current_A=-charge_A,
        voltage_V=voltage_V,
        temperature_K=celsius + ZERO_CELSIUS_K,
        mount=f"cell {cell}",
    )
    return on_one_clock(whole)


def pulse(raw: SimpleNamespace, tenths: int, slow: RealTest) -> RealTest:
    """One pulse at 25 degC from the rest before it; tenths of the charge of a slow discharge.

    That is what the file means: the rest voltages lie within 1 % of charge of its open-circuit
    curve (the one at a tenth: 3.5 %). The logger reads voltage and current one after the other: as
    the pulse begins a row has its voltage and still no current, which is put right; as it ends one
    has no current and still its voltage, so that the time of the end is not known, nor what follows
    it of use.
    """
    test = getattr(getattr(raw.T25, f"SoC{tenths}"), PULSED_CELL).data
    current_A = -test.Current
    began = int(np.argmax(np.diff(test.Voltage) < -FELL_OHM * current_A.max())) + 1
    current_A[began] = max(current_A[began], current_A[began + 1])
    whole = RealTest(
        name=f"pulse at {tenths}0 % 25 degC",
        time_s=test.ProgTime,
        current_A=current_A,
        voltage_V=test.Voltage,
        temperature_K=np.full(test.ProgTime.size, test.LogTemp001[0] + ZERO_CELSIUS_K),
        drawn_before_C=(1 - tenths / 10) * float(slow.drawn_C[-1]),
    )
    ended = int(np.flatnonzero(current_A > FLOWS_A)[-1]) + 1
    return on_one_clock(whole.part(slice(began - 1, ended)))


def cell(folder: Path) -> RealCell:
    """Fitted at 25 degC and up to 1C, judged at other rates and in the cold."""
    rates, pulses = matlab(recording(folder, RATES)), matlab(recording(folder, PULSES))
    slow = rate(rates, 25, "0.1C")
    return RealCell(
        name="LG M50 5 Ah",
        fit=(
            slow,
            rate(rates, 25, "1C"),
            *(pulse(pulses, tenths, slow) for tenths in PULSED),
        ),
        held_out=(
            rate(rates, 25, "0.5C"),
            rate(rates, 25, "2C"),
            rate(rates, 10, "1C"),
            rate(rates, 0, "2C"),
        ),
        baseline=Pack(cell=wide(load_cell("lg_m50"))),
        source="Chen et al. 2020, completed by O'Kane et al. 2022 (built-in lg_m50)",
        published=True,
    )
