"""Sony-Murata US18650VTC6, 3 Ah: one cell over 268 missions of an electric aircraft, to 93 %.

Recordings: Carnegie Mellon's eVTOL set (Bills et al., Sci. Data 10, 344 (2023)) as resampled to
30 s by mjihoon930. A check-up every 50 missions: from 4.2 V to 2.5 V at C/5 with two pauses.
Missions start at 4.0 V.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from proof.recorded.calibrated import Calibrated, calibrated, to_digits
from proof.recorded.measured import FloatArray, RealTest, recording
from twin.builtin import load_cell
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating
from twin.load import Between
from twin.pack import Pack

FILE = "battery/evtol_vtc6/VAH07_resampled.csv"
CAPACITY_C = 3.0 * 3600
DRAWN_A = 0.2  # more is a discharge
MISSION_A, CHECK_A = 4.0, (0.55, 0.65)  # median current of a mission; of a check-up
FREE = (
    "negative.stoichiometry_max",
    "positive.stoichiometry_max",
    "negative.stoichiometry_min",
    "capacity_C",
    "negative.diffusivity_m2_s",
    "positive.diffusivity_m2_s",
    "series_resistance_ohm",
)
"""Of the cell; C/5 tells no more."""
BEFORE, AFTER = 3, 20  # samples of rest kept around a discharge
HEAT_J_K, SURFACE_m2 = 44.0, 4.2e-3
"""46.6 g (data sheet) with 950 J/kg/K, usual of 18650 (Steinhardt et al., J. Energy Storage 52,
104869 (2022)); a cylinder of 18 mm and 65 mm."""


@dataclass(frozen=True, eq=False)
class Life:
    """All that was recorded.

    Attributes:
        whole: from the first sample to the last.
    """

    whole: RealTest

    @cached_property
    def _discharges(self) -> npt.NDArray[np.int64]:
        """(m, 2) first row and the one after the last of each stretch."""
        drawn = np.concatenate([[0], (self.whole.current_A > DRAWN_A).astype(int), [0]])
        return np.flatnonzero(np.diff(drawn)).reshape(-1, 2)

    @cached_property
    def _medians_A(self) -> FloatArray:
        return np.array([np.median(self.whole.current_A[a:b]) for a, b in self._discharges])

    @cached_property
    def missions(self) -> tuple[slice, ...]:
        """Rows of each, without the rests."""
        own = self._discharges[self._medians_A > MISSION_A]
        return tuple(slice(a, b) for a, b in own.tolist())

    @cached_property
    def check_ups(self) -> tuple[tuple[int, slice], ...]:
        """Missions before each, and its rows with its pauses."""
        slow = (self._medians_A > CHECK_A[0]) & (self._medians_A < CHECK_A[1])
        flown = np.cumsum(self._medians_A > MISSION_A)
        rows: dict[int, list[int]] = {}
        for (a, b), n in zip(self._discharges[slow].tolist(), flown[slow].tolist(), strict=True):
            rows.setdefault(n, [a, b])[1] = b
        return tuple((n, slice(a, b)) for n, (a, b) in rows.items())

    def test(self, name: str, rows: slice, after: int = AFTER) -> RealTest:
        """With the rest before, and so many samples of what comes after."""
        whole = self.whole.part(slice(rows.start - BEFORE, rows.stop + after))
        return replace(whole, name=name)


def life(folder: Path) -> Life:
    """All of the file; NotHere."""
    table = np.loadtxt(recording(folder, FILE), delimiter=",", skiprows=1).T
    return Life(
        whole=RealTest(
            name="life",
            time_s=table[0],
            current_A=table[1],
            voltage_V=table[2],
            temperature_K=table[3] + ZERO_CELSIUS_K,
        )
    )


def cooling_W_m2_K(mission: RealTest, room_K: float) -> float:
    """From the surface to the air, by how the cell cools in the rest after a mission."""
    assert mission.temperature_K is not None
    landed = int(np.flatnonzero(mission.current_A > DRAWN_A)[-1]) + 1
    above_K = mission.temperature_K[landed:] - room_K
    slope_1_s = np.polyfit(mission.time_s[landed:], np.log(above_K), 1)[0]
    return to_digits(-slope_1_s * HEAT_J_K / SURFACE_m2)


def fresh(own: Life, cache: Path) -> Calibrated:
    """The cell by its first check-up; full, in air as warm as it was.

    Not by its missions: at 15 A, 5C, the LG M50, from which a fit has to start, is at its cut-off
    after a minute, and 75 s are flown at that. How it cools is that of the first one.
    """
    check_up = own.test("check-up", own.check_ups[0][1])
    mission = own.test("mission", own.missions[0])
    assert mission.temperature_K is not None
    room_K = float(mission.temperature_K[0])
    cell = load_cell("lg_m50")
    scale = CAPACITY_C / cell.nominal_capacity_C
    body = replace(
        cell, heat_capacity_J_K=HEAT_J_K / scale, cooling_area_m2=SURFACE_m2 / scale ** (2 / 3)
    )
    heating = SelfHeating(heat_transfer_W_m2_K=cooling_W_m2_K(mission, room_K))
    pack = Pack(cell=body, capacity_C=CAPACITY_C, initial_K=room_K, effects=(heating,))
    test = check_up.reference(ambient_K=room_K, between=Between.LINEAR)
    return calibrated(pack, [test], cache, only=FREE)
