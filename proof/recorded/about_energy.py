"""NMC111 pouch, 12.5 Ah, and LFP 18650, 2 Ah, each with the BPX set measured on it.

Recordings and sets: About:Energy, CC BY-SA 4.0. No temperature was measured, and the publisher's
own validation is isothermal; so is the replay.
"""

import warnings
from pathlib import Path

import numpy as np

from proof.recorded.measured import RealCell, RealTest, recording, wide
from twin.bpx_file import CellWarning
from twin.builtin import load_cell
from twin.pack import Pack

FIT = {"C/20": "Co20", "C/2": "Co2", "1C": "1C"}
HELD_OUT = {"2C": "2C", "drive cycle": "DriveCycle"}


def read(folder: Path, chemistry: str, name: str, file: str) -> RealTest:
    """One test at 25 degC."""
    where = f"battery/about_energy_{chemistry}/{chemistry.upper()}_25degC_{file}.csv"
    path = recording(folder, where)
    time_s, current_A, voltage_V = np.genfromtxt(path, delimiter=",", skip_header=1).T
    return RealTest(name=name, time_s=time_s, current_A=-current_A, voltage_V=voltage_V)


def _cell(folder: Path, chemistry: str, name: str, bpx: str) -> RealCell:
    path = recording(folder, f"battery/about_energy_{chemistry}/{bpx}_cell_BPX.json")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CellWarning)  # an old version of the format
        published = load_cell(path)
    return RealCell(
        name=name,
        fit=tuple(read(folder, chemistry, *pair) for pair in FIT.items()),
        held_out=tuple(read(folder, chemistry, *pair) for pair in HELD_OUT.items()),
        baseline=Pack(cell=wide(published)),
        source=f"About:Energy, {path.name}",
        published=True,
    )


def nmc(folder: Path) -> RealCell:
    """The pouch: an isothermal DFN fits it well."""
    return _cell(folder, "nmc", "NMC111 pouch 12.5 Ah", "nmc_pouch")


def lfp(folder: Path) -> RealCell:
    """The phosphate cell: physics is in it that no homogeneous DFN has."""
    return _cell(folder, "lfp", "LFP 18650 2 Ah", "lfp_18650")
