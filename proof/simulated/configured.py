"""The twin as configured: all that an engine is told of the pack."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.builtin import load_cell
from twin.effects import SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]

END_SOC: Mapping[str, tuple[float, float]] = {"lipo_2200": (0.15, 0.30), "lg_m50": (0.47, 0.51)}
"""Least and most after a flight. This airframe cannot empty the M50 pack in six minutes, and at the
current that could, meshes on either side that are not very fine miss a millivolt."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Configured:
    """Numbers of a pack file.

    Attributes:
        cell: name of a built-in cell.
        series: cells in series.
        parallel: strings.
        start_soc: 0..1; by rest, more than 1 is a voltage above that of a full cell, as of `Pack`.
        start_K: temperature of the cells at the start.
        ambient_K: of the air.
        heat_transfer_W_m2_K: to the air, with self-heating switched on; None: isothermal.
        soc_by_rest: `start_soc` is by the voltage at rest.
    """

    cell: str
    series: int
    parallel: int
    start_soc: float
    start_K: float
    ambient_K: float
    heat_transfer_W_m2_K: float | None = None
    soc_by_rest: bool = False

    @property
    def physics(self) -> tuple[str, ...]:
        """Effects switched on."""
        return () if self.heat_transfer_W_m2_K is None else (SelfHeating.id,)

    @property
    def full_C(self) -> float:
        """Nominal charge of the pack."""
        return self.parallel * load_cell(self.cell).nominal_capacity_C

    def pack(self) -> Pack:
        """The twin's."""
        heat = self.heat_transfer_W_m2_K
        return Pack(
            cell=load_cell(self.cell),
            series=self.series,
            parallel=self.parallel,
            initial_soc=self.start_soc,
            soc_by_rest=self.soc_by_rest,
            initial_K=self.start_K,
            effects=() if heat is None else (SelfHeating(heat_transfer_W_m2_K=heat),),
        )

    def begun(self, share: float) -> "Configured":
        """When that share of its nominal charge was drawn; a state of charge is one of a window."""
        spent = share * self.full_C / self.pack().window_C
        return replace(self, start_soc=self.start_soc - spent)

    def rested(self, soc: float) -> "Configured":
        """When its voltage at rest is that of so full a pack."""
        return replace(self, start_soc=soc, soc_by_rest=True)

    def voltage_V(self, time_s: FloatArray, current_A: FloatArray) -> FloatArray:
        """(n,) what the twin makes of a current; NaN beyond where it cannot go on."""
        load = Load(time_s=time_s, current_A=current_A, ambient_K=self.ambient_K)
        answer = simulate(self.pack(), load).voltage_V
        return np.concatenate([answer, np.full(time_s.size - answer.size, np.nan)])
