"""All that is said of one flight's damage: `study` puts assessment, attribution and life together.

Quick: each motion beside constant currents, and the flight as flown. Thorough: more cycles, every
motion without each of its features, and how long the pack lasts.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from twin.ageing import Regime
from twin.damage.assess import Assessment, Manoeuvre, ageing, assess
from twin.damage.attribution import Attribution, Span, attribute
from twin.damage.cycles import Protocol
from twin.damage.loss import Ledger
from twin.damage.projection import Projection, life
from twin.damage.waveform import limited
from twin.load import Load
from twin.pack import Pack

QUICK_CYCLES, THOROUGH_CYCLES = 4, 8
SOON_S, DAY_S = 1800.0, 43200.0
"""Rests before and after a charge: one flight soon after the other, and about one a day."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lives:
    """Flights to `share` of the first capacity if the pack is always flown like this.

    Attributes:
        share: of the first capacity.
        soon: with SOON_S of rest before and after each charge.
        daily: with DAY_S: the same pack, left standing.
        most_A: limit on the current of
        gentle: the same flight, as in `soon`, without its peaks; None if no limit was asked for.
    """

    share: float
    soon: Projection
    daily: Projection
    most_A: float
    gentle: Projection


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """What a flight did to its pack.

    Attributes:
        assessment: each motion repeated, beside constant currents.
        attribution: the flight as it was flown.
        lives: only if it was thorough.
        cyclable_C: lithium in the particles of the new pack, which shares of it are of.
    """

    assessment: Assessment
    attribution: Attribution
    lives: Lives | None
    cyclable_C: float


def study(
    pack: Pack,
    load: Load,
    manoeuvres: Sequence[Manoeuvre],
    spans: Sequence[Span],
    *,
    thorough: bool = False,
) -> Study:
    """Of one flight.

    Args:
        pack: as it began the flight; effects of ageing it lacks are added with their defaults.
        load: of the flight.
        manoeuvres: its motions, one or more.
        spans: of the load, by motion.
        thorough: see above.

    Raises:
        CannotCycle: the pack cannot be cycled with constant currents like these.
    """
    protocol = Protocol(
        ambient_K=load.ambient_K, cycles=THOROUGH_CYCLES if thorough else QUICK_CYCLES
    )
    found = assess(pack, manoeuvres, protocol, counterfactuals=thorough)
    names = {m.name: m.waveform for m in manoeuvres if m.name in found.motions}
    flown = attribute(
        ageing(pack), load, spans, formed=found.baselines.reference.end_state, waveforms=names
    )
    lives = project(ageing(pack), load) if thorough else None
    return Study(
        assessment=found,
        attribution=flown,
        lives=lives,
        cyclable_C=Ledger(found.pack).cyclable_C,
    )


def project(pack: Pack, load: Load, *, share: float = 0.8) -> Lives:
    """Flights to `share` of the first capacity of a pack that ages."""
    most_A = gentle_limit_A(load)
    soon = Regime(load=load, rest_s=SOON_S)
    gentle = replace(load, current_A=limited(load.current_A, most_A, weights_s(load)))
    regimes = soon, replace(soon, rest_s=DAY_S), replace(soon, load=gentle)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        first, second, third = pool.map(lambda r: life(pack, r, share=share), regimes)
    return Lives(share=share, soon=first, daily=second, most_A=most_A, gentle=third)


def weights_s(load: Load) -> np.ndarray:
    """(n,) time that each sample of a load (straight between samples) stands for."""
    dt = np.diff(load.time_s)
    return np.asarray(np.append(dt, 0.0) / 2 + np.insert(dt, 0, 0.0) / 2)


def gentle_limit_A(load: Load) -> float:
    """Half way from the mean of the load to its 99th percentile, over time."""
    weights, order = weights_s(load), np.argsort(load.current_A)
    mean_A = load.charge_C() / float(weights.sum())
    share = np.cumsum(weights[order]) / weights.sum()
    high_A = float(load.current_A[order][np.searchsorted(share, 0.99)])
    return (mean_A + high_A) / 2
