"""Whether the stated intervals of damage hold, on flights nothing was chosen by.

    python -m benchmarks.damage_intervals [orders] [ratios] [--flights 30] [--first-seed 300]

orders  the flight as flown: how often the same segments in yet another order change what a motion
        costs per charge by less than is stated (2 min on one core)
ratios  damage over constant current of the same mean: how often the interval from the two or three
        segments of one flight holds the ratio of the motion as all flights fly it (4 min)

Synthetic flights of 300 s, plans drawn at random; segments are where the plan has them.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from analyze.assessing import manoeuvres_of, spans_of
from flightlogs.recording import Recording
from sample_logs.airframe import S500
from sample_logs.recorded import to_recording
from sample_logs.synthetic import fly
from segment import Segment, periodic_profiles
from segment.segment import Basis, Motion
from segment.statistics import load_statistics
from twin.builtin import load_cell
from twin.damage import (
    MEASURES,
    Baselines,
    Cost,
    Error,
    Part,
    Protocol,
    Span,
    Waveform,
    ageing,
    assess,
    attribute,
    constant,
    cycle,
    number,
)
from twin.damage.attribution import between, started
from twin.damage.cost import drawn, total
from twin.damage.loss import Ledger
from twin.load import Load
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

JUDGED = (Motion.HOVER, Motion.VERTICAL, Motion.HORIZONTAL)
SHOWN = ("lithium", "negative", "sei", "sei_on_cracks", "plating")
ORDERS = 8  # held out, of each flight
PROTOCOL = Protocol(cycles=1)
SAMPLE_S = 0.1
STRETCH_S = 200.0  # of all segments one after the other: a period the pack can fly twice
LEVELS = (0.68, 0.95)


def recorded(seed: int) -> tuple[Recording, tuple[Segment, ...]]:
    """A flight at 10 Hz, cut as it was planned."""
    flight = fly(S500, seed=seed)
    recording = to_recording(flight, seed=seed)
    t, segments = recording.time_s, []
    for span in flight.truth:
        inside = (t >= span.start_s) & (t < span.stop_s)
        if inside.sum() < 3:
            continue
        segments.append(
            Segment(
                motion=span.motion,
                start_s=span.start_s,
                stop_s=min(span.stop_s, float(t[-1])),
                basis=Basis.SETPOINT,
                load=load_statistics(t[inside], recording.current_A[inside], t[inside] * np.nan),
            )
        )
    return recording, tuple(segments)


def held_out(
    pack: Pack, load: Load, spans: Sequence[Span], state: FloatArray, seed: int
) -> Iterator[dict[int, Cost]]:
    """Span -> its cost, in ORDERS orders of the movable ones."""
    random, ledger = np.random.default_rng([seed, 1]), Ledger(pack)
    loads = [between(load, s.start_s, s.stop_s) for s in spans]
    movable = np.flatnonzero([s.movable for s in spans])
    for _ in range(ORDERS):
        places = np.arange(len(spans))
        places[movable] = random.permutation(movable)
        costs, _ = drawn(pack, ledger, [loads[p] for p in places], state)
        yield dict(zip(places.tolist(), costs, strict=False))


def orders(seeds: Sequence[int]) -> None:
    """Share of the changes within what is stated."""
    pack = ageing(Pack(cell=load_cell("lipo_2200"), series=4))
    formed = cycle(pack, constant(15.0, 1.0), PROTOCOL).end_state
    found: dict[tuple[str, str], list[tuple[float, Error]]] = {}
    for seed in seeds:
        recording, segments = recorded(seed)
        load = Load(time_s=recording.time_s, current_A=recording.current_A)
        spans = spans_of(segments)
        flown = attribute(pack, load, spans, formed=formed, waveforms={})
        state = started(pack, formed, load.ambient_K)
        for costs in held_out(pack, load, spans, state, seed):
            for motion in JUDGED:
                own = [k for k, s in enumerate(spans) if s.name == motion.value]
                for name in SHOWN if own else ():
                    change = _per_C(costs, own, name) / _per_C(
                        dict(enumerate(flown.costs)), own, name
                    )
                    error = flown.order_error(motion.value, name)
                    found.setdefault((motion.value, name), []).append((change - 1, error))
    _tell("changed by less, in another order", found)


def _per_C(costs: Mapping[int, Cost], own: Sequence[int], measure: str) -> float:
    whole = total([costs[k] for k in own])
    return MEASURES[measure](whole.loss) / whole.drawn_C


def ratios(seeds: Sequence[int]) -> None:
    """Share of the flights whose interval holds the ratio of the motion."""
    pack = Pack(cell=load_cell("lipo_2200"), series=4)
    flights = [recorded(seed) for seed in seeds]
    truth = {m.value: _truth(pack, flights, m) for m in JUDGED}
    found: dict[tuple[str, str], list[tuple[float, Error]]] = {}
    for recording, segments in flights:
        profiles = periodic_profiles(recording, segments)
        manoeuvres = [
            m
            for m in manoeuvres_of(recording, segments, profiles)
            if len(m.pieces) > 1 and m.name in truth
        ]
        if not manoeuvres:
            continue
        for motion, own in assess(pack, manoeuvres, PROTOCOL).motions.items():
            for name in SHOWN:
                ratio = own.excess[Part.WHOLE][name]
                found.setdefault((motion, name), []).append(
                    (ratio.value - truth[motion][name], ratio.error)
                )
    _tell("interval holds the motion's ratio", found)


def _truth(
    pack: Pack, flights: Sequence[tuple[Recording, tuple[Segment, ...]]], motion: Motion
) -> Mapping[str, float]:
    """Of all segments of all flights, over constant current at their mean."""
    whole = ageing(pack)
    everything = np.concatenate([p for f in flights for p in _parts(*f, motion)])
    mean_A = float(everything.mean())
    stretches = np.array_split(everything, round(everything.size * SAMPLE_S / STRETCH_S))
    steady = Baselines(
        tuple(cycle(whole, constant(f * mean_A, SAMPLE_S), PROTOCOL) for f in (0.98, 1.0, 1.02))
    )
    flown = [cycle(whole, Waveform(current_A=i, sample_s=SAMPLE_S), PROTOCOL) for i in stretches]
    return {
        name: float(np.mean([of(c) for c in flown])) / steady.at(mean_A, of)
        for name in SHOWN
        if (of := number(name, Part.WHOLE))
    }


def _parts(recording: Recording, segments: Sequence[Segment], motion: Motion) -> list[FloatArray]:
    """Samples of each segment."""
    t = recording.time_s
    return [
        np.interp(np.arange(s.start_s, s.stop_s, SAMPLE_S), t, recording.current_A)
        for s in segments
        if s.motion is motion
    ]


def _tell(what: str, found: Mapping[tuple[str, str], Sequence[tuple[float, Error]]]) -> None:
    """A row a motion and measure: shares of LEVELS, and half of the 95 % interval."""
    print(f"\n| {what} | cases | of 68 % | of 95 % | half of the 95 % interval, median |")
    print("|---|---|---|---|---|")
    everything = []
    for (motion, name), cases in found.items():
        known = [(off, e) for off, e in cases if np.isfinite(e.std)]
        everything += known
        _row(f"{motion}, {name}", known)
    _row("all", everything)


def _row(label: str, cases: Sequence[tuple[float, Error]]) -> None:
    shares = [np.mean([abs(off) < e.half(level) for off, e in cases]) for level in LEVELS]
    half = np.median([e.half_95 for _, e in cases])
    told = " | ".join(f"{100 * s:.0f} %" for s in shares)
    print(f"| {label} | {len(cases)} | {told} | {100 * half:.1f} % |", flush=True)


ALL: Mapping[str, Callable[[Sequence[int]], None]] = {"orders": orders, "ratios": ratios}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("parts", nargs="*", choices=[[], *ALL])
    parser.add_argument("--flights", type=int, default=30)
    parser.add_argument("--first-seed", type=int, default=300)
    given = parser.parse_args()
    for part in given.parts or list(ALL):
        ALL[part](range(given.first_seed, given.first_seed + given.flights))
