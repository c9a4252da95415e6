"""The stored reference solutions, and the twin on the same load."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tests.reference.loads import ReferenceLoad
from twin.builtin import load_cell
from twin.effects.self_heating import SelfHeating
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]
HERE = Path(__file__).parent
CELLS = (HERE.parents[1] / "twin" / "cells", HERE)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """One load on one cell by PyBaMM, extrapolated to the limit of fine meshes.

    Attributes:
        cell: name of its file, see `cell_file`.
        kind: of load.
        heated: one lumped temperature; else held at 25 degC.
        load: the current.
        voltage_V: (n,) at the samples.
        temperature_K: (n,) at the samples.
        own_error_rms_mV: bound on the error of `voltage_V`.
    """

    cell: str
    kind: str
    heated: bool
    load: ReferenceLoad
    voltage_V: FloatArray
    temperature_K: FloatArray
    own_error_rms_mV: float

    @classmethod
    def read(cls, name: str) -> "Reference":
        """The stored case `cell-load-thermal`."""
        cell, kind, thermal = name.split("-")
        with np.load(HERE / f"{name}.npz") as file:
            return cls(
                cell=cell,
                kind=kind,
                heated=thermal == "lumped",
                load=ReferenceLoad(
                    time_s=file["time_s"], current_A=file["current_A"], hold=bool(file["hold"])
                ),
                voltage_V=file["voltage_V"],
                temperature_K=file["temperature_K"],
                own_error_rms_mV=float(file["own_error_rms_mV"]),
            )


def cell_file(cell: str) -> Path:
    """Of a built-in cell, or of one that is only solved here."""
    (file,) = (f for folder in CELLS if (f := folder / f"{cell}.bpx.json").exists())
    return file


def twin_pack(reference: Reference) -> Pack:
    """One cell as the reference has it: full, at rest, heat transfer from its BPX file."""
    text = cell_file(reference.cell).read_text(encoding="utf-8")
    environment = json.loads(text)["State"]["Thermal environment"]
    transfer = environment["Heat transfer coefficient [W.m-2.K-1]"]
    effects = (SelfHeating(heat_transfer_W_m2_K=transfer),) if reference.heated else ()
    return Pack(cell=load_cell(cell_file(reference.cell)), effects=effects)


def twin_load(load: ReferenceLoad) -> Load:
    """The same load for the twin."""
    between = Between.HOLD if load.hold else Between.LINEAR
    return Load(time_s=load.time_s, current_A=load.current_A, between=between)


def simulate_reference(reference: Reference) -> Solution:
    """The twin's answer to the same load."""
    return simulate(twin_pack(reference), twin_load(reference.load))
