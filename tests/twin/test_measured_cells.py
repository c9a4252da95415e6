"""Measured cells with complete published parameters: our error must be that of the published model.

About:Energy's NMC111 pouch and LFP 18650 come with BPX files and with the RMSE of a DFN model of
another make on the same recordings. Agreement checks the reading of BPX and the model at once.
"""

import warnings
from pathlib import Path

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

FOLDER = Path(__file__).parents[2] / ".." / "shared" / "battery"
pytestmark = pytest.mark.skipif(
    not FOLDER.exists(), reason="needs the measured cells in ../shared/battery"
)


@pytest.mark.parametrize(
    ("chemistry", "file", "test", "published_mV"),
    [
        ("nmc", "nmc_pouch_cell_BPX.json", "Co2", 12.3),
        ("nmc", "nmc_pouch_cell_BPX.json", "1C", 13.4),
        ("nmc", "nmc_pouch_cell_BPX.json", "2C", 24.7),
        ("nmc", "nmc_pouch_cell_BPX.json", "DriveCycle", 18.8),
        ("lfp", "lfp_18650_cell_BPX.json", "Co2", 102.0),
        ("lfp", "lfp_18650_cell_BPX.json", "1C", 133.0),
        ("lfp", "lfp_18650_cell_BPX.json", "2C", 95.0),
        ("lfp", "lfp_18650_cell_BPX.json", "DriveCycle", 69.0),
    ],
)
def test_error_is_that_of_the_published_model(
    chemistry: str, file: str, test: str, published_mV: float
) -> None:
    folder = FOLDER / f"about_energy_{chemistry}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the files are BPX 0.x and say so
        cell = load_cell(folder / file)
    name = f"{chemistry.upper()}_25degC_{test}.csv"
    time_s, current_A, voltage_V = np.genfromtxt(folder / name, delimiter=",", skip_header=1).T
    keep = np.concatenate([[True], np.diff(time_s) > 0])
    load = Load(time_s=time_s[keep], current_A=-current_A[keep])
    solution = simulate(Pack(cell=cell), load)
    assert solution.stopped_s > 0.99 * time_s[-1]  # published runs stop at the cut-off too
    error = solution.voltage_V - voltage_V[keep][: solution.time_s.size]
    rms_mV = 1e3 * np.sqrt(np.mean(error**2))
    assert rms_mV == pytest.approx(published_mV, rel=0.02)  # published to three digits
