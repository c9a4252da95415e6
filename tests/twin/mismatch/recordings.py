"""Recordings of a pack that is the twin's, but for what is put into it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.reference.loads import flight as reference_flight
from twin.builtin import load_cell
from twin.effects import AnyEffect
from twin.load import Load
from twin.mismatch import Flight
from twin.pack import Pack
from twin.simulate import simulate

NOISE_V, NOISE_A = 8e-3, 0.08


def pack() -> Pack:
    """The twin as configured."""
    return Pack(cell=load_cell("lipo_2200"), series=4)


def flown(
    truth: Sequence[AnyEffect] = (),
    *,
    seed: int = 0,
    seconds: float = 120.0,
    noise_V: float = NOISE_V,
) -> Flight:
    """One flight of that pack with `truth` in it, as a sensor and an autopilot record it."""
    random = np.random.default_rng([seed, 1])  # other numbers than those of the gusts
    load = reference_flight(2.2, mean=8.0, peak=16.0, duration_s=120.0, seed=seed)
    n = int(10 * seconds) + 1
    true = Load(time_s=load.time_s[:n], current_A=load.current_A[:n])
    solution = simulate(replace(pack(), effects=tuple(truth)), true).require()
    recorded = replace(true, current_A=true.current_A + random.normal(0.0, NOISE_A, n))
    return Flight(
        name=f"flight {seed}",
        pack=pack(),
        load=recorded,
        voltage_V=solution.voltage_V + random.normal(0.0, noise_V, n),
        judged=np.ones(n, dtype=bool),
        motion=np.where(true.time_s < seconds / 2, "hover", "vertical"),
    )


def discharged(twin: Pack, truth: Pack, seed: int, rate: float) -> Flight:
    """Steadily, every 10 s, nearly empty."""
    time_s = np.arange(0.0, 3250.0 / rate, 10.0)
    load = Load(
        time_s=time_s, current_A=np.full(time_s.size, 5.0 * rate), ambient_K=truth.initial_K
    )
    noise = np.random.default_rng(seed).normal(0.0, 1e-3, time_s.size)
    return Flight(
        name=f"discharge {seed}",
        pack=twin,
        load=load,
        voltage_V=simulate(truth, load).require().voltage_V + noise,
        judged=np.ones(time_s.size, dtype=bool),
        motion=np.full(time_s.size, ""),
    )
