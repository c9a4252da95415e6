"""Fits to one flight: do the intervals hold the truth, and what does a fit cost?

`python -m benchmarks.flight_fit [packs]`: 40 s for 20 packs on 2 cores.
Hidden packs are drawn from the priors, flown on random plans of the synthetic quadrotor (about
300 s), recorded at 10 Hz with 8 mV and 0.08 A of noise, and fitted from a start that is 3 % of
charge off. The twin is its own truth: what a wrong model adds is not in the intervals. The cost is
that of 600 s at 10 Hz; without a compiler on the PATH it is that of the virtual machine.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sample_logs.airframe import S500
from sample_logs.synthetic import fly
from twin.builtin import load_cell
from twin.calibrate.flight import FlightFit, NotFitted, fit_flight
from twin.calibrate.flight_problem import Flown, Known
from twin.effects import (
    ElectrolyteTransport,
    ReactionKinetics,
    SelfHeating,
    SeriesResistance,
    SolidDiffusionNegative,
    SolidDiffusionPositive,
)
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

GUESS = Pack(
    cell=load_cell("lipo_2200"), series=4, capacity_C=2.2 * 3600, initial_soc=0.95,
    effects=(SelfHeating(),),
)  # fmt: skip
KNOWN = Known(soc=True, capacity=True, temperature=False, scale=True, charge=True)
NOISE_V, NOISE_A, PERIOD_S = 0.008, 0.08, 0.1


def hidden(rng: np.random.Generator) -> tuple[Pack, dict[str, float]]:
    """A pack, and its numbers by the names of the fit."""
    capacity, wind, kinetics, electrolyte, diffusion = np.exp(
        np.array([0.12, 0.4, 0.5, 0.3, 0.5]) * rng.standard_normal(5)
    ).tolist()
    true = {
        "capacity_C": GUESS.capacity_C * capacity if GUESS.capacity_C else 0.0,
        "initial_soc": rng.uniform(0.85, 0.99),
        "initial_K": 298.15 + 8 * rng.standard_normal(),
        "series_resistance_ohm": abs(0.02 * rng.standard_normal()),
        "heat_transfer_W_m2_K": 12.0 * wind,
        "reaction_kinetics": kinetics,
        "electrolyte_transport": electrolyte,
        "solid_diffusion": diffusion,
    }
    effects = (
        SelfHeating(heat_transfer_W_m2_K=true["heat_transfer_W_m2_K"]),
        SeriesResistance(resistance_ohm=true["series_resistance_ohm"]),
        ReactionKinetics(negative_factor=kinetics, positive_factor=kinetics),
        ElectrolyteTransport(diffusivity_factor=electrolyte, conductivity_factor=electrolyte),
        SolidDiffusionNegative(diffusivity_factor=diffusion),
        SolidDiffusionPositive(diffusivity_factor=diffusion),
    )
    start = {name: true[name] for name in ("capacity_C", "initial_soc", "initial_K")}
    return replace(GUESS, effects=effects, **start), true


def recorded(pack: Pack, seed: int, rng: np.random.Generator) -> Flown | None:
    """A flight of `pack` as a logger has it; None if the pack cannot fly it."""
    flight = fly(S500, seed=seed)
    load = Load(time_s=flight.time_s, current_A=flight.current_A, ambient_K=pack.initial_K)
    solution = simulate(pack, load)
    if solution.time_s.size < load.time_s.size:
        return None
    t = np.arange(0.0, float(flight.time_s[-1]), PERIOD_S)
    current, voltage, in_air = (
        np.interp(t, flight.time_s, values)
        for values in (flight.current_A, solution.voltage_V, flight.in_air.astype(float))
    )
    return Flown(
        load=Load(time_s=t, current_A=current + NOISE_A * rng.standard_normal(t.size)),
        voltage_V=voltage + NOISE_V * rng.standard_normal(t.size),
        in_air=in_air > 0.5,
    )


def judged(seed: int) -> tuple[FlightFit | None, dict[str, float], str]:
    """The fit, the truth, and a line about them."""
    rng = np.random.default_rng([seed, 7])
    pack, true = hidden(rng)
    flown = recorded(pack, seed, rng)
    if flown is None:
        return None, true, "the pack is too small for this flight"
    start = replace(GUESS, initial_soc=min(1.0, pack.initial_soc + 0.03 * rng.standard_normal()))
    found = fit_flight(start, flown, KNOWN)
    if isinstance(found, NotFitted):
        return None, true, found.reason
    before, after = 1e3 * found.held_out_before_V, 1e3 * found.held_out_after_V
    return found, true, f"held out {before:.1f} -> {after:.1f} mV"


def coverage(packs: int) -> None:
    """How often the 90 % intervals hold the truth, and how far off the values are."""
    inside: dict[str, list[bool]] = {}
    off: dict[str, list[float]] = {}
    for seed in range(packs):
        found, true, line = judged(seed)
        print(f"pack {seed}: {line}", flush=True)
        for e in found.estimates if found else ():
            inside.setdefault(e.name, []).append(e.lower <= true[e.name] <= e.upper)
            off.setdefault(e.name, []).append((e.value - true[e.name]) / e.std)
    print("quantity | inside | mean and spread of the error in standard errors")
    for name, hits in inside.items():
        z = np.array(off[name])
        print(f"{name} | {sum(hits)} of {len(hits)} | {z.mean():.2f}, {z.std():.2f}")
    whole = np.concatenate([*inside.values()])
    print(f"all | {100 * whole.mean():.1f} % of {whole.size} (90 % stated)")


def cost() -> None:
    """Of a fit to 600 s at 10 Hz, beside its replay."""
    rng = np.random.default_rng(0)
    pack, _ = hidden(rng)
    t = np.arange(0.0, 600.0, PERIOD_S)
    load = Load(time_s=t, current_A=8.0 + 2 * np.sin(t / 3) + rng.standard_normal(t.size))
    voltage = simulate(pack, load).require().voltage_V
    flown = Flown(
        load=load, voltage_V=voltage + NOISE_V * rng.standard_normal(t.size), in_air=t > 10
    )
    for name, work in (
        ("replay", lambda: simulate(GUESS, load)),
        ("fit", lambda: fit_flight(GUESS, flown, KNOWN)),
    ):
        print(f"{name}: {_seconds(work)}")


def _seconds(work: Callable[[], object]) -> str:
    work()
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return f"{time.perf_counter() - wall:.2f} s, {time.process_time() - cpu:.2f} s of one core"


if __name__ == "__main__":
    cost()
    coverage(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
