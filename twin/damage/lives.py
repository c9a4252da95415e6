"""How long a pack lasts: as flown, by each motion alone, gently, left standing; and how sure it is.

A motion alone draws the charge of the flight that was recorded, so that lives compare. The interval
of a life is a confidence, of its logarithm: what the segments leave open of their motion, what is
not known of cell and ageing (lives of other packs that may be this one), and the error of the
steps. What no interval holds is that ageing is what the twin has it be.
"""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import exp

import numpy as np
import numpy.typing as npt

from twin.ageing import Regime
from twin.damage.assess import Assessed
from twin.damage.error import UNKNOWN_ERROR, Error, together
from twin.damage.measures import Part
from twin.damage.projection import Projection, life
from twin.damage.waveform import limited
from twin.load import Load
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

SOON_S, DAY_S = 1800.0, 43200.0
"""Rests before and after a charge: one flight soon after the other, and about one a day."""
MOST_LOG = 700.0  # the exponential of more is no number
SHARE = 0.8  # of the first capacity: where a life ends


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lifetime:
    """Flights to the end of a life.

    Attributes:
        projection: the life.
        error: of the logarithm of the number of flights.
    """

    projection: Projection
    error: Error

    @property
    def reached(self) -> float:
        """Flights; NaN if the life ends before."""
        return self.projection.reached

    @property
    def interval_95(self) -> tuple[float, float]:
        """The truth lies in it in 95 % of cases; NaN if not known."""
        half = exp(min(self.error.half_95, MOST_LOG))
        return self.reached / half, self.reached * half


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lives:
    """Flights to `share` of the first capacity if the pack is always flown like this.

    Attributes:
        share: of the first capacity.
        soon: the flight as it was flown, with SOON_S of rest before and after each charge.
        daily: with DAY_S: the same pack, left standing.
        most_A: limit on the current of
        gentle: the same flight, as in `soon`, without its peaks.
        motions: name -> flights of that motion alone, as long as they draw the same charge.
        by_shares: flights that follow from `motions` for a mix like that of the flight: one over
            the mean of one over flights, by the charge each motion draws. M. A. Miner, J. Appl.
            Mech. 12, A159 (1945): damage adds up whatever the order.
        packs: other packs that may be this one, which the intervals are of.
    """

    share: float
    soon: Lifetime
    daily: Lifetime
    most_A: float
    gentle: Lifetime
    motions: Mapping[str, Lifetime]
    by_shares: float
    packs: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mix:
    """A flight and the motions in it.

    Attributes:
        load: of the flight.
        motions: by name, as they were assessed.
        drawn_C: name -> charge that the motion drew in the flight.
    """

    load: Load
    motions: Mapping[str, Assessed]
    drawn_C: Mapping[str, float]


def project(pack: Pack, mix: Mix, *, others: Sequence[Pack] = (), share: float = SHARE) -> Lives:
    """Lives of a pack that ages, to `share` of its first capacity.

    `others` are packs that may be `pack` as well.
    """
    load, motions = mix.load, mix.motions
    most_A = gentle_limit_A(load)
    soon = Regime(load=load, rest_s=SOON_S)
    gentle = replace(load, current_A=limited(load.current_A, most_A, weights_s(load)))
    charge_C = load.charge_C()
    regimes = [soon, replace(soon, rest_s=DAY_S), replace(soon, load=gentle)]
    regimes += [
        replace(soon, load=own.manoeuvre.waveform.drawing(charge_C, load.ambient_K))
        for own in motions.values()
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        told = pool.map(lambda r: life(pack, r, share=share), regimes)
        beside = pool.map(lambda p: life(p, soon, share=share), others)
        flown, daily, limited_, *alone = told
        by_pack = _by_pack(flown, list(beside)) if others else UNKNOWN_ERROR
    each = {
        name: _lifetime(p, by_pack, _of_segments(own))
        for p, (name, own) in zip(alone, motions.items(), strict=True)
    }
    return Lives(
        share=share,
        soon=_lifetime(flown, by_pack),
        daily=_lifetime(daily, by_pack),
        most_A=most_A,
        gentle=_lifetime(limited_, by_pack),
        motions=each,
        by_shares=_by_shares(each, mix.drawn_C),
        packs=len(others),
    )


def _lifetime(projection: Projection, *errors: Error) -> Lifetime:
    steps = Error(std=projection.error / projection.reached)
    return Lifetime(projection=projection, error=together(steps, *errors))


def _by_pack(own: Projection, others: Sequence[Projection]) -> Error:
    """Of the logarithm of flights: how far the lives of other packs lie from this one's.

    Of a life that ends before the share that was asked for, the flights up to there, one at least.
    """
    flights = [p.reached if np.isfinite(p.reached) else max(p.flights[-1], 1.0) for p in others]
    away = np.log(np.array(flights) / own.reached)
    return Error(std=float(np.sqrt(np.mean(away**2))), freedom=away.size)


def _of_segments(own: Assessed) -> Error:
    """Relative, of the lithium a flight of the motion costs."""
    ratio = own.excess[Part.WHOLE]["lithium"]
    return ratio.error * (1 / ratio.value)


def _by_shares(each: Mapping[str, Lifetime], drawn_C: Mapping[str, float]) -> float:
    whole_C = sum(drawn_C.get(name, 0.0) for name in each)
    if not whole_C > 0:
        return float("nan")
    return 1 / sum(drawn_C.get(name, 0.0) / whole_C / own.reached for name, own in each.items())


def weights_s(load: Load) -> FloatArray:
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
