"""A flight of the samples and what its pack did: the truth that every format takes its share of."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sample_logs.airframe import Airframe
from sample_logs.instruments import AutopilotFlaws, AutopilotSamples, autopilot
from sample_logs.pack_trace import PackTrace
from sample_logs.plan import Leg
from sample_logs.synthetic import SyntheticFlight, fly
from twin.builtin import load_cell
from twin.effects.self_heating import SelfHeating
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

VOLTAGE_NOISE_V, VOLTAGE_STEP_V = 0.008, 0.001


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """What the log does not tell about its pack.

    Attributes:
        cell: built-in cell that answers.
        initial_soc: at the start of the log.
        ambient_K: of the air, and of the pack at the start.
        heat_transfer_W_m2_K: from the cells to the air.
    """

    cell: str = "lipo_2200"
    initial_soc: float
    ambient_K: float
    heat_transfer_W_m2_K: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One flight and how it is recorded.

    Attributes:
        airframe: what flies.
        seed: of all its random numbers.
        plan: its legs.
        hidden: about its pack.
        autopilot: errors of the autopilot's current.
    """

    airframe: Airframe
    seed: int
    plan: tuple[Leg, ...]
    hidden: Hidden
    autopilot: AutopilotFlaws


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flown:
    """A sample after the flight: the truth from which each instrument takes its share."""

    sample: Sample
    flight: SyntheticFlight
    pack: Solution

    def seen(self, battery_period_s: float, motion_period_s: float) -> AutopilotSamples:
        """What an autopilot records at these rates."""
        flaws = replace(
            self.sample.autopilot,
            battery_period_s=battery_period_s,
            motion_period_s=motion_period_s,
        )
        return autopilot(self.flight, flaws, seed=self.sample.seed)

    def trace(self, seen: AutopilotSamples, boot_s: float) -> PackTrace:
        """Current, voltage and charge counter as the autopilot measured them."""
        t, current = seen.battery_time_s, seen.current_A
        rng = np.random.default_rng([self.sample.seed, t.size])
        true_V = np.interp(t, self.pack.time_s, self.pack.voltage_V)
        noisy = true_V + VOLTAGE_NOISE_V * rng.standard_normal(t.size)
        steps = np.diff(t) * (current[1:] + current[:-1]) / 2
        return PackTrace(
            time_s=boot_s + t,
            voltage_V=np.round(noisy / VOLTAGE_STEP_V) * VOLTAGE_STEP_V,
            current_A=current,
            charge_C=np.concatenate([[0.0], np.cumsum(steps)]),
        )

    def mode_at(self, time_s: FloatArray, numbers: Mapping[str, int]) -> npt.NDArray[np.int64]:
        """(n,) number of the flight mode at each time."""
        out = np.zeros(time_s.size, dtype=np.int64)
        for span in self.flight.modes:
            out[time_s >= span.start_s] = numbers[span.name]
        return out


def fly_sample(sample: Sample) -> Flown:
    """Fly it, and let the twin answer to its current."""
    flight = fly(sample.airframe, seed=sample.seed, plan=sample.plan)
    hidden = sample.hidden
    pack = Pack(
        cell=load_cell(hidden.cell),
        series=sample.airframe.series,
        capacity_C=sample.airframe.capacity_C,
        initial_soc=hidden.initial_soc,
        initial_K=hidden.ambient_K,
        effects=(SelfHeating(heat_transfer_W_m2_K=hidden.heat_transfer_W_m2_K),),
    )
    load = Load(time_s=flight.time_s, current_A=flight.current_A, ambient_K=hidden.ambient_K)
    solution = simulate(pack, load, backend=Backend.VIRTUAL_MACHINE)  # the same bytes everywhere
    return Flown(sample=sample, flight=flight, pack=solution.require())
