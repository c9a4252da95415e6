"""Melasta SLPBA842124HV, LiPo pouch of a drone, 6.55 Ah, 4.35 V.

Recordings: SINTEF, via battery-data-alliance/battery-data-format.
"""

from pathlib import Path

import numpy as np

from proof.recorded.measured import RealCell, RealTest, nearest, recording
from twin.constants import ZERO_CELSIUS_K

FILE = "battery/melasta_lipo/SLPBA842124HV_rate_25degC_time_repaired.csv"
STEPS = {"C/10": 4, "1C": 8, "2C": 12, "5C": 16, "9.1C": 21}
"""Test -> `step_index` of its discharge."""
SWITCHED_S = 0.025


def tests(folder: Path) -> dict[str, RealTest]:
    """The discharges of STEPS, from the last sample at rest.

    The row in which the current is first told still has the voltage of the rest; the next, if it
    comes within SWITCHED_S, one between that and the cell's, and is left out. Temperature: the
    second thermocouple, the hottest.
    """
    raw = np.genfromtxt(recording(folder, FILE), delimiter=",", names=True)
    out = {}
    for name, step in STEPS.items():
        rows = raw[raw["step_index"] == step]
        rows = rows[1:][np.diff(rows["test_time_second"]) > 0]
        since_s = rows["test_time_second"] - rows["test_time_second"][0]
        told = (since_s == 0.0) | (since_s > SWITCHED_S)
        rows, since_s = rows[told], since_s[told]
        out[name] = RealTest(
            name=name,
            time_s=since_s,
            current_A=np.where(since_s > 0.0, -rows["current_ampere"], 0.0),
            voltage_V=rows["voltage_volt"],
            temperature_K=rows["temperature_t2_celsius"] + ZERO_CELSIUS_K,
            mount="chamber",
        )
    return out


def cell(folder: Path) -> RealCell:
    """Fitted on what a bench measures, judged at the rates of a drone."""
    measured = tests(folder)
    fit = tuple(measured[name] for name in ("C/10", "1C", "2C"))
    baseline, source = nearest("lipo_2200", fit[0])
    return RealCell(
        name="Melasta LiPo 6.55 Ah",
        fit=fit,
        held_out=tuple(measured[name] for name in ("5C", "9.1C")),
        baseline=baseline,
        source=source,
        published=False,
    )
