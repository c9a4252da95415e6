"""The recordings of each cell of `heat_list`, and what of them is given in a trial.

Of all discharges but the slowest that is what a flight uses: all but the last of the charge
(FLOWN). There the voltage falls by a volt within minutes, at a time set by a percent of capacity; a
twin that errs by 20 mV before misses 50 to 130 over the whole.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from proof.recorded import about_energy, leaf_cell, lg_m50, melasta, panasonic, samsung
from proof.recorded.measured import RealTest, matlab, recording
from proof.recorded.thinned import binned, every, spaced, until

Recordings = Mapping[str, Callable[[Path], RealTest]]

FLOWN = 0.9  # of the charge of a discharge
STEP_S = 5.0  # between samples of a steady discharge
DRIVE_S = 2.0  # of a drive cycle: means over as long
PULSED_S, PULSE_S = 4 * 3600.0, 10.0  # of pulses are given, so far apart
DRIVEN_S = 2700.0  # of it are given, so that a verdict takes a minute or two


def samsung_test(folder: Path, name: str, cell: str) -> RealTest:
    """A discharge of S001 or S002."""
    return until(samsung.read(folder, name, cell), FLOWN)


def melasta_test(folder: Path, name: str) -> RealTest:
    """A discharge, the slowest to its end."""
    test = melasta.tests(folder)[name]
    return test if name == "C/10" else until(test, FLOWN)


def leaf_test(folder: Path, times: int) -> RealTest:
    """A discharge at so many times 30.6 A."""
    return until(leaf_cell.discharge(folder, times), FLOWN)


def samsungs(cell: str) -> Recordings:
    """Of S001 or S002; pulses of a third one, in a chamber at 40 degC."""
    fast = {name: partial(samsung_test, name=name, cell=cell) for name in ("2C", "3C", "4C")}
    return {**fast, "pulses 40 degC": samsung.warm_pulses}


def lg_m50s() -> Recordings:
    """Of the first cells, each rate from one of its own."""
    names = [("0.5C", 10), ("1C", 0), ("1C", 10), ("1C", 25), ("2C", 0), ("2C", 10), ("2C", 25)]
    return {f"{name} {degrees} degC": _lg_m50(name, degrees) for name, degrees in names}


def lg_m50_warm() -> Recordings:
    """Of three more, in a chamber at 45 degC."""
    return {f"{name} 45 degC": _lg_m50(name, 45) for name in ("0.5C", "1C", "1.5C")}


def lg_m50_others() -> Recordings:
    """Of cells 786 and 796; 0.5C was drawn twice."""
    half = {
        f"0.5C {degrees} degC, {which + 1}": partial(
            lg_m50_other, cell=786, name="0.5C", degrees=degrees, which=which
        )
        for degrees in (0, 10)
        for which in (0, 1)
    }
    return {**half, "2C 25 degC": partial(lg_m50_other, cell=796, name="2C", degrees=25)}


def _lg_m50(name: str, degrees: int) -> Callable[[Path], RealTest]:
    def read(folder: Path) -> RealTest:
        raw = matlab(recording(folder, lg_m50.RATES))
        return until(lg_m50.rate(raw, degrees, name), FLOWN)

    return read


def lg_m50_other(folder: Path, cell: int, name: str, degrees: int, which: int = 0) -> RealTest:
    """Of cell 786 or 796, `which` as it counts equal ones from 0."""
    return until(lg_m50.other(folder, cell, name, degrees, which), FLOWN)


def panasonics() -> Recordings:
    """Drive cycles, and pulses in the cold."""
    cycles = {name: partial(panasonic.cycle, name=name) for name in panasonic.HELD_OUT}
    return {**cycles, "pulses 0 degC": partial(panasonic.pulses, degrees=0)}


def about_energies(chemistry: str) -> Recordings:
    """Of the pouch (`nmc`) or of the 18650 (`lfp`)."""

    def read(folder: Path, name: str) -> RealTest:
        return about_energy.read(folder, chemistry, name, files[name])

    files = about_energy.FIT | about_energy.HELD_OUT
    return {name: partial(read, name=name) for name in ("1C", "2C", "drive cycle")}


def melastas() -> Recordings:
    """Its faster discharges."""
    return {name: partial(melasta_test, name=name) for name in ("2C", "5C", "9.1C")}


def leafs() -> Recordings:
    """Its faster discharges, and its pulses in the cold and in the warm."""
    fast = {f"{k}C": partial(leaf_test, times=k) for k in (2, 3)}
    pulsed = {f"pulses {d} degC": partial(leaf_cell.pulses, degrees=d) for d in (10, 40)}
    return {**fast, **pulsed}


def steady(test: RealTest) -> RealTest:
    """A sample every STEP_S; of pulses the first."""
    return pulsed(test) if _pulses(test) else every(test, STEP_S)


def driven(test: RealTest) -> RealTest:
    """The first DRIVEN_S, in means over DRIVE_S; of pulses the first."""
    if _pulses(test):
        return pulsed(test)
    return binned(test.part(slice(0, int(np.searchsorted(test.time_s, DRIVEN_S)))), DRIVE_S)


def as_it_is(test: RealTest) -> RealTest:
    """All of it."""
    return test


def either(test: RealTest) -> RealTest:
    """A drive cycle in means over DRIVE_S, a discharge every STEP_S."""
    return binned(test, DRIVE_S) if test.name == "drive cycle" else every(test, STEP_S)


def pulsed(test: RealTest) -> RealTest:
    """Discharges as they are; of pulses the first."""
    if not _pulses(test):
        return test
    return spaced(test.part(slice(0, int(np.searchsorted(test.time_s, PULSED_S)))), PULSE_S)


def _pulses(test: RealTest) -> bool:
    return test.name.startswith("pulses")
