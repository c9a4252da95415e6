"""A recording that begins under load: what may have flowed before, by what flowed in it.

A twin begins at rest. A pack that had flown before does not: its salt and its particles are uneven,
as they are after a stretch of the same recording. Whether it had, and how long, is not recorded.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from twin.effects import (
    AnyEffect,
    ElectrolyteTransport,
    SelfHeating,
    SolidDiffusionNegative,
    SolidDiffusionPositive,
)
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import flowed

FIRST = 5  # samples that tell whether it begins under load
UNDER_LOAD = 0.1  # of the mean of all: at rest avionics draw less, motors in a descent more
LONGEST_S = 300.0  # flown before; much longer, and what is uneven is as it was
SLOWER = (0.3, 0.55, 0.74)
"""Diffusivities: the slowest with which the recording could have been flown. With salt of 0.3 an LG
M50 that gives 1.3C runs out of it, which changes its voltage by hundreds of millivolts a cell: of
the few shapes of all that may have flowed before none was left for what had."""
LEAST_S = 10.0  # at the mean current, that has to have been possible


def begins_under_load(pack: Pack, load: Load) -> bool:
    """It draws a current at once; none whose steps were programmed, nor one of a full pack."""
    mean_A = float(np.mean(load.current_A))
    at_once = float(np.mean(load.current_A[:FIRST])) > UNDER_LOAD * mean_A > 0.0
    return load.between is not Between.HOLD and at_once and _room_C(pack) > LEAST_S * mean_A


def preceded(pack: Pack, load: Load, random: np.random.Generator) -> tuple[Pack, Load, int]:
    """With a stretch of `load` before it, drawn by chance, and so many samples more.

    The pack begins with what that draws besides, so that it is as full where the recording begins.
    The stretch, as if the recording had been flown again and again, is of any length up to
    LONGEST_S, and no longer than from a full pack.
    """
    t, again = load.time_s, _again(load)
    length_s = random.uniform(0.0, LONGEST_S)
    last = int(np.searchsorted(again.time_s, random.uniform(length_s, again.time_s[-1])))
    drawn_C, end_s = flowed(pack, again).drawn_C(), again.time_s[last]
    possible = again.time_s >= end_s - length_s
    possible &= drawn_C[last] - drawn_C <= _room_C(pack)
    first = int(np.argmax(possible))
    before_s = again.time_s[first:last] - end_s + t[0]
    whole = replace(
        load,
        time_s=np.append(before_s, t),
        current_A=np.append(again.current_A[first:last], load.current_A),
    )
    more_C = float(flowed(pack, whole).drawn_C()[before_s.size])
    return pack.emptier(-min(more_C, _room_C(pack))), whole, before_s.size


def _again(load: Load) -> Load:
    """The same again and again from 0 s, for longer than LONGEST_S and once more."""
    t = load.time_s - load.time_s[0]
    lasts_s = float(t[-1] + np.median(np.diff(t)))
    times = 1 + int(LONGEST_S // lasts_s) + 1
    starts_s = lasts_s * np.arange(times)
    return replace(
        load,
        time_s=(starts_s[:, None] + t).ravel(),
        current_A=np.tile(load.current_A, times),
    )


def slower(pack: Pack) -> Iterator[tuple[Pack, ...]]:
    """As it is, then with transport of one kind that is SLOWER, the slowest first.

    Without the heat of its losses: how warm it is where a recording begins is known.
    """
    kinds = (SolidDiffusionNegative, SolidDiffusionPositive, ElectrolyteTransport)
    yield (_instead(pack, SelfHeating.id),)
    for kind in kinds:
        yield tuple(
            _instead(pack, SelfHeating.id, kind(diffusivity_factor=slow)) for slow in SLOWER
        )


def _instead(pack: Pack, left_out: str, *effects: AnyEffect) -> Pack:
    """With these effects in place of their own kinds and of the one that is left out."""
    out = {left_out, *(e.id for e in effects)}
    return replace(pack, effects=(*(e for e in pack.effects if e.id not in out), *effects))


def _room_C(pack: Pack) -> float:
    """That may have been drawn before, from when the fullest of its cells was full.

    Nor did it ever state to be more than full, whatever it was.
    """
    fullest, now = pack.charged().initial_soc, pack.numbers()["initial_soc"]
    return max(min(fullest - now, 1.0 - pack.initial_soc), 0.0) * pack.window_C
