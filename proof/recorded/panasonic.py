"""Panasonic NCR18650PF, NCA, 2.9 Ah.

Recordings: P. Kollmeyer, University of Wisconsin-Madison, via fededc88/Panasonic-18650PF-Data.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from proof.recorded.measured import (
    TICK_S,
    RealCell,
    RealTest,
    discharge_of,
    matlab,
    nearest,
    on_one_clock,
    recording,
)
from twin.constants import ZERO_CELSIUS_K

FloatArray = npt.NDArray[np.float64]

FOLDER = "battery/panasonic_18650pf/"
SLOW = "05-08-17_13.26_C20_OCV_Test_C20_25dC.mat"
ONE_C = "03-09-17_17.59_3349_Dis1C_1.mat"
PULSES = {
    25: "03-11-17_08.47_25degC_5Pulse_HPPC_Pan18650PF.mat",
    0: "05-20-17_10.44_0degC_5pulse_HPPC_Pan18650PF.mat",
}
HELD_OUT = {
    "US06 25 degC": "03-20-17_01.43_25degC_US06_Pan18650PF.mat",
    "US06 10 degC": "03-27-17_09.06_10degC_US06_Pan18650PF.mat",
    "US06 -20 degC": "06-25-17_10.31_n20degC_US06_Pan18650PF.mat",
    "mixed cycle, chamber 10 to 23 degC": "07-09-17_19.11_10degC_trise_Cycle_1_Pan18650PF.mat",
}
LEFT_OUT_S = 20.0  # a longer step between samples hides a discharge
BETWEEN_A = 0.87
"""Of the discharges between the pulses, which were not recorded. Their charge is (the counter went
on), and every gap is as long as that charge takes at 0.87 A, and 1800 s (once 3600 s) of rest."""
PUT_BACK_S = 10.0  # between samples that are put back: a longer step is a pause of the logger
EDGE_S = 0.1  # the current rises and falls in that
OFFSET_A = 0.009
"""Too much in the current that was written down at C/20, 0.145 A either way: 2.997 Ah drawn, and
2.617 Ah later the cell rests 24 mV, or 0.03 Ah, below where it began. At rest it says 0."""
LATE_S, LATE_A = 0.5, 0.3  # a fall of the current that was seen so late


def read(folder: Path, file: str, name: str) -> tuple[RealTest, FloatArray]:
    """A file as it is, and its charge counter [C], both on one clock."""
    raw = matlab(recording(folder, FOLDER + file))
    test = RealTest(
        name=name,
        time_s=raw.Time,
        current_A=-raw.Current,
        voltage_V=raw.Voltage,
        temperature_K=raw.Battery_Temp_degC + ZERO_CELSIUS_K,
        mount="chamber",
    )
    counted = replace(test, voltage_V=-3600.0 * raw.Ah)  # travels with the samples that are kept
    return on_one_clock(test), on_one_clock(counted).voltage_V


def slow(folder: Path) -> RealTest:
    """The discharge at C/20."""
    return discharge_of(flowed(read(folder, SLOW, "C/20 25 degC")[0]))


def flowed(test: RealTest) -> RealTest:
    """C/20 with the current that flowed, see OFFSET_A."""
    told_A = test.current_A
    return replace(test, current_A=np.where(told_A == 0.0, 0.0, told_A - OFFSET_A))


def cycle(folder: Path, name: str) -> RealTest:
    """One of HELD_OUT with current and voltage at one time.

    In the files the voltage is a sample, 0.1 s, later than the current: so the changes of both from
    sample to sample correlate. In those of the pulses it is not.
    """
    test, _ = read(folder, HELD_OUT[name], name)
    late, early = slice(1, None), slice(None, -1)
    assert test.temperature_K is not None
    return replace(
        test, time_s=test.time_s[early], current_A=test.current_A[early],
        voltage_V=test.voltage_V[late], temperature_K=test.temperature_K[early],
    )  # fmt: skip


def pulses(folder: Path, degrees: int = 25) -> RealTest:
    """The pulses at 25 or 0 degC, with the discharges between them put back, without their voltage.

    Put back too: a pulse's end. After the strongest the next sample comes a second later, but the
    counter stood still meanwhile: the current had ended with the sample before.
    """
    test, counted_C = read(folder, PULSES[degrees], f"pulses {degrees} degC")
    t, step_s = test.time_s, np.diff(test.time_s)
    hidden, late = step_s > LEFT_OUT_S, (step_s > LATE_S) & (np.diff(test.current_A) < -LATE_A)
    added: dict[int, tuple[list[float], list[float]]] = {}
    for k in np.flatnonzero(late & ~hidden).tolist():
        added[k] = [t[k] + TICK_S], [test.current_A[k + 1]]
    for k in np.flatnonzero(hidden).tolist():
        start_s = t[k] + EDGE_S
        stop_s = start_s + (counted_C[k + 1] - counted_C[k]) / BETWEEN_A
        flows_s = [*np.arange(start_s, stop_s - EDGE_S, PUT_BACK_S), stop_s]
        rests_s = np.arange(stop_s + EDGE_S, t[k + 1] - EDGE_S, PUT_BACK_S)
        added[k] = [*flows_s, *rests_s], [*([BETWEEN_A] * len(flows_s)), *([0.0] * rests_s.size)]
    return _with(test, added)


def _with(test: RealTest, added: Mapping[int, tuple[list[float], list[float]]]) -> RealTest:
    """Samples (times, currents) put in after others, whose temperature they have; no voltage."""
    assert test.temperature_K is not None
    after = np.concatenate([np.full(len(times), k) for k, (times, _) in added.items()])
    times, currents = (np.concatenate([pair[m] for pair in added.values()]) for m in (0, 1))
    return replace(
        test,
        time_s=np.insert(test.time_s, after + 1, times),
        current_A=np.insert(test.current_A, after + 1, currents),
        voltage_V=np.insert(test.voltage_V, after + 1, np.nan),
        temperature_K=np.insert(test.temperature_K, after + 1, test.temperature_K[after]),
    )


def cell(folder: Path) -> RealCell:
    """Fitted on laboratory tests at 25 degC, judged on drive cycles there and in the cold."""
    slowest = slow(folder)
    baseline, source = nearest("lg_m50", slowest)
    return RealCell(
        name="Panasonic NCR18650PF 2.9 Ah",
        fit=(slowest, discharge_of(read(folder, ONE_C, "1C 25 degC")[0]), pulses(folder)),
        held_out=tuple(cycle(folder, name) for name in HELD_OUT),
        baseline=baseline,
        source=source,
        published=False,
    )
