"""The calibration cases that are stored here, or were made elsewhere with `make.py`."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

HERE = Path(__file__).parent
NOISE_V = 2e-3  # of a cell's voltage, standard deviation: what a good cycler shows
STORED = (
    "lipo_2200-0-isothermal", "lipo_2200-1-isothermal", "lipo_2200-2-isothermal",
    "lipo_2200-3-isothermal", "lg_m50-4-isothermal", "lg_m50-10-isothermal",
    "lipo_2200-0-lumped",
)  # fmt: skip
FIT, HELD_OUT = ("0.1C", "2C", "pulses"), ("flight",)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellTest:
    """One test of one cell, from full and at rest; (n,) each, without noise.

    Attributes:
        time_s: samples.
        current_A: discharge positive.
        voltage_V: by PyBaMM; where the current jumps, just after it.
        temperature_K: of the cell.
        hold: the current holds from sample to sample; else it runs straight.
        finer_mesh_rms_mV: how far the finer of two meshes is from `voltage_V`, their limit.
    """

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    temperature_K: FloatArray
    hold: bool
    finer_mesh_rms_mV: float

    def noisy_V(self, seed: int) -> FloatArray:
        """(n,) the voltage as it would be measured."""
        random = np.random.default_rng(seed)
        return self.voltage_V + NOISE_V * random.standard_normal(self.voltage_V.size)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CalibrationCase:
    """A hidden cell and what was measured on it.

    Attributes:
        name: `cell-seed-thermal`.
        cell: the built-in cell near which it lies: what a calibration may start from.
        bpx: the hidden cell's file.
        heated: one lumped temperature in air of 25 degC; else held at 25 degC.
        numbers: the truth by the kernel's names (`draw.py`).
        tests: FIT and HELD_OUT by name.
    """

    name: str
    cell: str
    bpx: Path
    heated: bool
    numbers: Mapping[str, float]
    tests: Mapping[str, CellTest]

    @classmethod
    def read(cls, name: str, folder: Path = HERE) -> "CalibrationCase":
        """The case `cell-seed-thermal` of a folder."""
        cell, seed, thermal = name.split("-")
        with np.load(folder / f"{name}.npz") as file:
            return cls(
                name=name,
                cell=cell,
                bpx=folder / f"{cell}-{seed}.bpx.json",
                heated=thermal == "lumped",
                numbers=dict(zip(file["names"].tolist(), file["numbers"].tolist(), strict=True)),
                tests={test: _test(file, test) for test in (*FIT, *HELD_OUT)},
            )


def _test(file: Mapping[str, FloatArray], test: str) -> CellTest:
    time_s = file[f"{test}.time_ds"] / 10
    warm = f"{test}.temperature_K"
    return CellTest(
        time_s=time_s,
        current_A=file[f"{test}.current_A"].astype(float),
        voltage_V=file[f"{test}.voltage_V"].astype(float),
        temperature_K=file[warm].astype(float) if warm in file else np.full(time_s.size, 298.15),
        hold=bool(file[f"{test}.hold"]),
        finer_mesh_rms_mV=float(file[f"{test}.finer_mesh_mV"][0]),
    )
