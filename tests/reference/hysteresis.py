"""The M50 with two branches in each electrode, and a load that turns, for the twin and PyBaMM."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tests.reference.loads import ReferenceLoad
from tests.reference.stored import twin_load
from twin.bpx_file import read_bpx
from twin.builtin import builtin_text
from twin.effects import AnyEffect, OcvHysteresis, SelfHeating
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

HERE = Path(__file__).parent
CELL = "lg_m50"
START_SOC = 0.5
THERMAL = ("isothermal", "lumped")
HALF_GAP_V = {"Negative": "(0.03 - 0.02 * x)", "Positive": "(0.01 + 0.01 * x)"}
BELOW_OCP_V = {"Negative": "0.004", "Positive": "0.002"}  # of the middle of the branches
DECAY = {"Negative": 15.0, "Positive": 30.0}
START = {"Negative": -1.0, "Positive": 0.5}
TRANSFER_W_m2_K = 10.0


def text() -> str:
    """The BPX file: the branches are no mirror images of the OCP, and as far apart as silicon's."""
    document = json.loads(builtin_text(CELL))
    document["State"]["Thermal environment"]["Heat transfer coefficient [W.m-2.K-1]"] = (
        TRANSFER_W_m2_K
    )
    for side, gap in HALF_GAP_V.items():
        electrode = document["Parameterisation"][f"{side} electrode"]
        middle = f"({electrode['OCP [V]']}) - {BELOW_OCP_V[side]}"
        electrode["OCP (lithiation) [V]"] = f"{middle} - {gap}"
        electrode["OCP (delithiation) [V]"] = f"{middle} + {gap}"
        electrode["OCP hysteresis decay constant"] = DECAY[side]
        state = document["State"]["Initial conditions"]
        state[f"Initial hysteresis state: {side} electrode"] = START[side]
    return json.dumps(document)


def load() -> ReferenceLoad:
    """1C out for 400 s, 1C in for 400 s, then 2C either way ever faster, a sample a second."""
    t = np.arange(1201.0)
    turn = np.interp(t, [0, 20, 400, 440, 800, 820], [0, 5, 5, -5, -5, 0])
    swing = 10.0 * np.sin(2 * np.pi * (t - 820) * (1 + (t - 820) / 200) / 120)
    return ReferenceLoad(time_s=t, current_A=np.where(t > 820, swing, turn), hold=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferenceHysteresis:
    """PyBaMM's answer, extrapolated to the limit of fine meshes.

    Attributes:
        heated: one lumped temperature; else held at 25 degC.
        load: the current.
        voltage_V: (n,) at the samples.
        temperature_K: (n,) at the samples.
        without_V: (n,) voltage with the OCP alone.
        own_error_rms_mV: bound on the error of `voltage_V`.
    """

    heated: bool
    load: ReferenceLoad
    voltage_V: FloatArray
    temperature_K: FloatArray
    without_V: FloatArray
    own_error_rms_mV: float

    @classmethod
    def read(cls, thermal: str) -> "ReferenceHysteresis":
        """The stored case."""
        with np.load(HERE / f"hysteresis-{thermal}.npz") as file:
            stored = load()
            np.testing.assert_allclose(file["current_A"], stored.current_A, rtol=0, atol=1e-12)
            return cls(
                heated=thermal == "lumped",
                load=stored,
                voltage_V=file["voltage_V"],
                temperature_K=file["temperature_K"],
                without_V=file["without_V"],
                own_error_rms_mV=float(file["own_error_rms_mV"]),
            )

    def twin(self) -> Solution:
        """The twin on the same load."""
        start = {f"{side.lower()}_start": value for side, value in START.items()}
        effects: tuple[AnyEffect, ...] = (OcvHysteresis(**start),)
        if self.heated:
            effects += (SelfHeating(heat_transfer_W_m2_K=TRANSFER_W_m2_K),)
        cell = read_bpx(text(), name="hysteresis.bpx.json")
        pack = Pack(cell=cell, initial_soc=START_SOC, effects=effects)
        return simulate(pack, twin_load(self.load))
