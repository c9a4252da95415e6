"""The assessment of damage: its time, how it settles with the cycles, what sampling does to it.

    python -m benchmarks.damage [time] [settle] [sampling]      (all: 3 min on two cores)

time      the quick and the thorough study of sample_logs/s500.ulg, the kernel warm
settle    how far the normalised numbers move from N cycles to twice as many, largest of all motions
sampling  damage of each motion of synthetic flights whose current is known at 50 Hz, from every
          5th and every 10th sample, over that from all of them
"""

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from analyze.assessing import manoeuvres_of, others_of, spans_of
from analyze.pipeline import Source, read_flight
from analyze.replaying import load_of
from analyze.start import pack_of
from sample_logs.airframe import S500
from sample_logs.synthetic import STEP_s, SyntheticFlight, fly
from segment import cut, periodic_profiles
from segment.segment import Motion
from twin.builtin import load_cell
from twin.damage import (
    MEASURES,
    Assessment,
    Cycled,
    Manoeuvre,
    Part,
    Protocol,
    Span,
    Waveform,
    ageing,
    assess,
    cycle,
    number,
    study,
)
from twin.load import Load
from twin.pack import Pack

LOG = Path(__file__).parents[1] / "sample_logs" / "s500.ulg"
JUDGED = (Motion.HOVER, Motion.VERTICAL, Motion.HORIZONTAL)
SEEDS = (3, 4, 5)


def flown() -> tuple[Pack, Load, tuple[Manoeuvre, ...], list[Span]]:
    """What `analyze` hands to the study."""
    sensor = LOG.with_suffix(".sensor.csv")
    flight = read_flight(Source(log=LOG, sensor=sensor, pack=None, battery=None))
    segments = cut(flight.recording)
    profiles = periodic_profiles(flight.recording, segments)
    return (
        pack_of(flight.use, flight.cell),
        load_of(flight.recording, flight.use),
        manoeuvres_of(flight.recording, segments, profiles),
        spans_of(segments),
    )


def times() -> None:
    """Wall and processor time, second call."""
    pack, load, manoeuvres, spans = flown()
    print("| study | runs | wall s | processor s | aim s |\n|---|---|---|---|---|")
    for thorough, aim in ((False, 3), (True, 20)):
        study(pack, load, manoeuvres[:1], spans, thorough=False)
        began, used = time.perf_counter(), time.process_time()
        others = others_of(pack, None) if thorough else None
        found = study(pack, load, manoeuvres, spans, thorough=thorough, others=others)
        wall, processor = time.perf_counter() - began, time.process_time() - used
        motions = found.assessment.motions.values()
        runs = len(found.assessment.baselines.cycled)
        runs += sum(1 + len(own.counterfactuals) for own in motions)
        name = "thorough" if thorough else "quick"
        print(f"| {name} | {runs} | {wall:.1f} | {processor:.1f} | {aim} |", flush=True)


def normalised(found: Assessment) -> np.ndarray:
    """(measures, motions and baselines) of flight and charge."""
    runs = [own.cycled for own in found.motions.values()] + list(found.baselines.cycled)
    first = found.baselines.reference
    of = [number(name, Part.WHOLE) for name in MEASURES]
    return np.array([[f(run) / f(first) for run in runs] for f in of])


def settle() -> None:
    """From 2 cycles to 32."""
    pack, load, manoeuvres, _ = flown()
    print(f"| cycles | {' | '.join(MEASURES)} | (change to twice as many, %)")
    print("|---" * (len(MEASURES) + 1) + "|")
    before = None
    for cycles in (2, 4, 8, 16, 32):
        now = normalised(
            assess(pack, manoeuvres, Protocol(ambient_K=load.ambient_K, cycles=cycles))
        )
        if before is not None:
            change = 100 * np.abs(now / before - 1).max(axis=1)
            print(f"| {cycles // 2} | {' | '.join(f'{c:.2f}' for c in change)} |", flush=True)
        before = now


def waves(flight: SyntheticFlight) -> Mapping[str, Waveform]:
    """Each judged motion's 50 Hz current, its segments one after the other."""
    out = {}
    for motion in JUDGED:
        inside = np.zeros(flight.time_s.size, dtype=bool)
        for span in flight.truth:
            if span.motion is motion:
                inside |= (flight.time_s >= span.start_s) & (flight.time_s < span.stop_s)
        size = inside.sum() // 10 * 10
        if size:
            out[motion.value] = Waveform(current_A=flight.current_A[inside][:size], sample_s=STEP_s)
    return out


def sampled(wave: Waveform, every: int) -> Waveform:
    """Every so many samples, moved to the mean of all: a profile keeps the mean of its segments."""
    few = wave.current_A[::every]
    return Waveform(current_A=few + wave.mean_A - few.mean(), sample_s=every * wave.sample_s)


def sampling() -> None:
    """Worst of SEEDS, with its sign."""
    pack = ageing(Pack(cell=load_cell("lipo_2200"), series=4))
    protocol = replace(Protocol(), cycles=2)
    print(f"| motion, rate | {' | '.join(MEASURES)} | (error of flight and charge, %)")
    print("|---" * (len(MEASURES) + 1) + "|")
    flights = [waves(fly(S500, seed=seed)) for seed in SEEDS]
    for motion in JUDGED:
        kept = [f[motion.value] for f in flights if motion.value in f]
        truth = [cycle(pack, wave, protocol) for wave in kept]
        for every in (5, 10):
            cycled = [cycle(pack, sampled(wave, every), protocol) for wave in kept]
            errors = np.array([_errors(number(n, Part.WHOLE), cycled, truth) for n in MEASURES])
            most = errors[np.arange(len(errors)), np.abs(errors).argmax(axis=1)]
            label = f"{motion.value}, {1 / (every * STEP_s):g} Hz"
            print(f"| {label} | {' | '.join(f'{e:+.2f}' for e in most)} |", flush=True)


def _errors(of: Callable[[Cycled], float], got: list[Cycled], truth: list[Cycled]) -> list[float]:
    """Of each [%]."""
    return [100 * (of(c) / of(t) - 1) for c, t in zip(got, truth, strict=True)]


if __name__ == "__main__":
    ALL = {"time": times, "settle": settle, "sampling": sampling}
    for chosen in sys.argv[1:] or list(ALL):
        ALL[chosen]()
