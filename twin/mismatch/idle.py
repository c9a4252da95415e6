"""What a pack draws while it idles is steady: noise of its record there is left out, `steadied`.

A sensor for a hundred ampere has a noise of some tenths, and where little flows a cell answers to
them by more than in flight: the slower its reactions, the steeper its voltage about no current
(Butler and Volmer). Of a pack with reactions at half their rate, 30 samples on the ground, 0.2 A of
noise in them, missed by up to 90 mV where 2800 in flight missed by 7, and nothing was named. Of so
few samples the mean has noise too: `idle_ways`.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from twin.load import Between, Load
from twin.mismatch.flight import Flight, FloatArray, Idle
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import as_flowed, simulate_all

LITTLE = 0.05  # of what flows in flight
IN_FLIGHT = 95.0  # percentile of the current
LEAST = 8  # samples: of fewer a mean is noise as well
AS_NOISE = 1.0
"""Squares of changes over those about the mean, and more: 2 of noise, less of what goes on."""
MOST_WAYS = 8  # stretches of a recording, those that do most to its voltage


def steadied(flight: Flight) -> Flight:
    """Its mean for the current of each stretch that idles and varies as noise does.

    The charge drawn there stays as it was. Steps that were programmed are taken as they are.
    """
    load = flight.recorded_load
    if load.between is Between.HOLD:
        return flight
    current_A, found = load.current_A.copy(), []
    for own in _idling(load):
        about_A = load.current_A[own] - load.current_A[own].mean()
        if np.sum(np.diff(about_A) ** 2) > AS_NOISE * np.sum(about_A**2):
            current_A[own] -= about_A
            first_s, *_, last_s = load.time_s[own].tolist()
            found.append(Idle(first_s, last_s, float(about_A.std(ddof=1)), about_A.size))
    moved_A = np.interp(flight.time_s, load.time_s, current_A - load.current_A)
    steady = replace(flight.load, current_A=flight.load.current_A + moved_A)
    return replace(flight, load=steady, idle=tuple(found)) if found else flight


def _idling(load: Load) -> Iterator[slice]:
    """Stretches of the samples in which little flows, without those next to where more does."""
    most_A = LITTLE * float(np.percentile(np.abs(load.current_A), IN_FLIGHT))
    little = np.abs(load.current_A) < most_A
    little[1:-1] &= little[:-2] & little[2:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], little, [False]])))
    return (slice(a, b) for a, b in edges.reshape(-1, 2).tolist() if b - a >= LEAST)


def idle_ways(pack: Pack, flight: Flight) -> FloatArray:
    """(n, k) what the mean of each stretch may be off by does to the voltage there [V].

    By one standard deviation; of the MOST_WAYS that do most.
    """
    within = [(s.start_s <= flight.time_s) & (flight.time_s <= s.end_s) for s in flight.idle]
    if not within:
        return np.zeros((flight.time_s.size, 0))
    off_A = np.sum([s.mean_A * own for s, own in zip(flight.idle, within, strict=True)], axis=0)
    wide, load = as_flowed(beyond_cut_offs(pack), flight.load)
    moved = replace(load, current_A=load.current_A + off_A)
    as_is, other = (s.voltage_V for s in simulate_all([(wide, load), (wide, moved)]))
    n = min(as_is.size, other.size)
    change_V = np.zeros(flight.time_s.size)
    change_V[:n] = other[:n] - as_is[:n]
    ways_V = change_V[:, None] * np.column_stack(within)
    most = np.argsort(np.linalg.norm(ways_V[flight.judged], axis=0))[-MOST_WAYS:]
    return np.asarray(ways_V[:, np.sort(most)])


def spared_V(recorded: Flight, steady: Flight) -> float:
    """What the twin would have answered to that noise, rms over the samples there that count.

    Args:
        recorded: the flight before `steadied`.
        steady: after.
    """
    at = steady.judged & (recorded.load.current_A != steady.load.current_A)
    wide = beyond_cut_offs(steady.pack)
    one, other = (s.voltage_V for s in simulate_all([(wide, f.load) for f in (recorded, steady)]))
    n = min(one.size, other.size)
    answered_V = (one[:n] - other[:n])[at[:n]]
    return float(np.sqrt(np.mean(answered_V**2))) if answered_V.size else 0.0
