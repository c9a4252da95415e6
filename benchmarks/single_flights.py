"""One flight to the end of a battery: is what was left out named by that flight alone?

    python -m benchmarks.single_flights

Four cells in series, the twin's own, with one effect in it or none; 8C on average (17.6 A)
until the weakest cell is empty, 5 Hz, 8 mV and 0.08 A of noise. All effects are looked for. At the
end three packs out of balance, of whose charge the twin knows what their voltage at rest says.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from tests.reference.loads import flight
from tests.twin.mismatch.recordings import NOISE_A, NOISE_V, pack
from twin.at_rest import soc_at_rest
from twin.effects import (
    ActiveMaterialLossNegative,
    ActiveMaterialLossPositive,
    AnyEffect,
    CurrentGain,
    CurrentOffset,
    LithiumInventoryLoss,
    SeriesResistance,
    WeakCell,
)
from twin.load import Load
from twin.mismatch import Flight, explain
from twin.simulate import simulate

TRUTHS: tuple[AnyEffect | None, ...] = (
    WeakCell(capacity_factor=0.93),
    WeakCell(soc_offset=-0.06),
    WeakCell(capacity_factor=0.95, resistance_ohm=0.004),
    LithiumInventoryLoss(lost=0.05),
    ActiveMaterialLossPositive(lost=0.05),
    ActiveMaterialLossNegative(lost=0.06),
    CurrentGain(gain=1.05),
    None,
    WeakCell(capacity_factor=0.93),
    SeriesResistance(resistance_ohm=0.004),
    CurrentOffset(offset_A=0.4),
)
OUT_OF_BALANCE = (
    WeakCell(soc_offset=-0.06),
    WeakCell(soc_offset=-0.12),
    WeakCell(soc_offset=-0.12, capacity_factor=0.95),
)
LONGEST_S = 1200.0
FLOWN = 0.995  # of the samples until the pack is empty
EVERY = 2  # of samples at 10 Hz


def flown(truth: AnyEffect | None, seed: int, every: int = EVERY) -> Flight:
    """As a sensor and an autopilot record it, `every` so many samples at 10 Hz."""
    random = np.random.default_rng(seed)
    whole = flight(2.2, mean=8.0, peak=16.0, duration_s=LONGEST_S, seed=seed)
    drawn = Load(time_s=whole.time_s, current_A=whole.current_A)
    true = simulate(replace(pack(), effects=() if truth is None else (truth,)), drawn)
    own = slice(0, int(FLOWN * true.time_s.size), every)
    time_s = true.time_s[own]
    current_A = drawn.current_A[own] + random.normal(0.0, NOISE_A, time_s.size)
    return Flight(
        name="flight",
        pack=pack(),
        load=Load(time_s=time_s, current_A=current_A),
        voltage_V=true.voltage_V[own] + random.normal(0.0, NOISE_V, time_s.size),
        judged=np.ones(time_s.size, dtype=bool),
        motion=np.full(time_s.size, "hover"),
    )


def told_by_rest(own: Flight, truth: WeakCell) -> Flight:
    """The same beside a twin that starts by the voltage of the whole pack before take-off."""
    rested = replace(own.pack, effects=(truth,))
    before = Load(time_s=np.arange(2.0), current_A=np.zeros(2))
    mean_V = float(simulate(rested, before).voltage_V[0]) / rested.series
    soc = soc_at_rest(rested.cell, mean_V)
    return replace(own, pack=replace(own.pack, initial_soc=soc, soc_by_rest=True))


def main() -> None:
    """Two lines a flight."""
    flights = [(truth, flown(truth, seed)) for seed, truth in enumerate(TRUTHS)]
    flights += [
        (truth, told_by_rest(flown(truth, seed), truth))
        for seed, truth in enumerate(OUT_OF_BALANCE, start=len(TRUTHS))
    ]
    for truth, own in flights:
        began_s = perf_counter()
        finding = explain([own])
        named = "; ".join(
            " or ".join([e.id, *e.instead])
            + "".join(f", {p.name} {p.value:.4g} +- {p.std:.2g}" for p in e.parameters)
            for e in finding.effects
        )
        errors = finding.errors
        held_mV = f"{1e3 * errors.held_out_before:.1f} -> {1e3 * errors.held_out_after:.1f} mV"
        print(f"{truth or 'nothing'}, {own.time_s[-1]:.0f} s: {finding.verdict.value} {named}")
        print(
            f"    held out {held_mV}, noise {1e3 * errors.noise:.1f} mV, "
            f"{perf_counter() - began_s:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
