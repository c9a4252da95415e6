"""Faults put into recordings of a real cell, whose twin errs by less, but not as noise does.

The NMC pouch of About:Energy with the parameters measured on it: within a second the twin loses
7.8 mOhm and the cell 5.6, over 100 s they lose the same. It misses these recordings by 10 mV.
"""

import warnings
from pathlib import Path

import numpy as np
import pytest

from proof.compare import MOST_EQUIVALENT
from proof.recorded import about_energy
from proof.recorded.measured import RealTest, recording
from twin.bpx_file import CellWarning
from twin.builtin import load_cell
from twin.load import Load
from twin.mismatch import Flight, Verdict, explain
from twin.pack import Pack

SHARED = Path(__file__).parents[3] / ".." / "shared"
pytestmark = pytest.mark.skipif(
    not SHARED.exists(), reason="needs the measured cells in ../shared/battery"
)
STATED_V = 0.016
WARM_K, COLD_K = 298.15, 273.15


def flights(current: float, ohm: float, told_K: float) -> list[Flight]:
    """2000 s of the drive cycle and 2400 s of 1C: the current as much larger, lost in series."""
    path = recording(SHARED, "battery/about_energy_nmc/nmc_pouch_cell_BPX.json")
    files = {"DriveCycle": slice(2001), "1C": slice(0, 2401, 4)}
    tests = [(about_energy.read(SHARED, "nmc", f, f), rows) for f, rows in files.items()]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CellWarning)  # an old version of the format
        pack = Pack(cell=load_cell(path), initial_K=told_K)

    def flight(test: RealTest, rows: slice) -> Flight:
        time_s, current_A = test.time_s[rows], test.current_A[rows]
        return Flight(
            name=test.name,
            pack=pack,
            load=Load(time_s=time_s, current_A=current * current_A, ambient_K=told_K),
            voltage_V=test.voltage_V[rows] - ohm * current_A,
            judged=np.ones(time_s.size, dtype=bool),
            motion=np.full(time_s.size, ""),
        )

    return [flight(*own) for own in tests]


def test_what_the_twin_errs_by_is_nothing() -> None:
    drive, steady = flights(1.0, 0.0, WARM_K)
    assert explain([drive], [steady], slow_V=STATED_V).verdict is Verdict.NONE


@pytest.mark.parametrize(
    ("fault", "current", "ohm", "told_K"),
    [
        pytest.param("current_gain", 1.15, 0.0, WARM_K, marks=pytest.mark.long),
        pytest.param("series_resistance", 1.0, 0.006, WARM_K, marks=pytest.mark.long),
        pytest.param("cold_pack", 1.0, 0.0, COLD_K, marks=pytest.mark.long),
    ],
)
def test_a_fault_is_found_beside_what_the_twin_errs_by(
    fault: str, current: float, ohm: float, told_K: float
) -> None:
    """Alone: seconds that the twin never follows are no second effect, and hide none."""
    drive, steady = flights(current, ohm, told_K)
    (named,) = explain([drive], [steady], slow_V=STATED_V).effects
    assert fault in {named.id, *named.equivalent[:MOST_EQUIVALENT]}
