"""Make the cases: `python -m tests.mismatch_cases.make FOLDER [--split S] [--only E] [--jobs N]`.

FOLDER/<split>/<name>.npz each (`case.py`), `<name>.skipped` with the reason where an effect cannot
be so strong; FOLDER/solves keeps PyBaMM's answers. What is there is not made again.
"""

import argparse
import multiprocessing
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from proof.simulated.effects import ALL
from proof.simulated.flights import PERIOD_S, TrueFlight, true_flight
from proof.simulated.flown import fly
from proof.simulated.instruments import NOISE_V
from proof.simulated.pack_truth import PackTruth
from proof.simulated.solves import OutOfReachError, Solves
from proof.simulated.strength import missed_V, size_for
from segment.segment import Motion
from tests.mismatch_cases.case import Case
from tests.mismatch_cases.catalogue import PLANS, STRENGTHS, Spec, specs
from tests.mismatch_cases.record import record

HOP_S = 20.0


@cache
def kept_flight(plan: str, seed: int, *, full_C: float, drawn: tuple[float, float]) -> TrueFlight:
    """A true flight; a `hop` is the first seconds around the take-off of a mixed one."""
    if plan != "hop":
        return true_flight(plan, seed, full_C=full_C, drawn=drawn)
    whole = true_flight("mixed", seed, full_C=full_C, drawn=drawn)
    first = int(np.argmax(whole.motion != Motion.GROUND.value)) - round(5.0 / PERIOD_S)
    span = slice(first, first + round(HOP_S / PERIOD_S) + 1)
    current_A = whole.current_A[span]
    return TrueFlight(
        name=f"hop-{seed}",
        seed=seed,
        time_s=PERIOD_S * np.arange(current_A.size, dtype=float),
        current_A=current_A,
        motion=whole.motion[span],
    )


def make_case(spec: Spec, flights: Sequence[TrueFlight], solves: Solves) -> Case:
    """Find the sizes on the first flight, fly them all, record; OutOfReachError if too strong."""
    told, pack = spec.told, PackTruth.of(spec.told)
    sizes = tuple(
        size_for(ALL[e], spec.flavour(e), told, flights[0], STRENGTHS[spec.strength], solves)
        for e in spec.truth
    )
    for e, size in zip(spec.truth, sizes, strict=True):
        pack = ALL[e].make(pack, size, spec.flavour(e))
    flown = [fly(pack, flight, solves) for flight in flights]
    pieces = [
        record(f, spec.variant, np.random.default_rng([spec.seed, k])) for k, f in enumerate(flown)
    ]
    return Case(
        name=spec.name,
        split=spec.split,
        seed=spec.seed,
        truth=spec.truth,
        sizes=sizes,
        flavours=tuple(map(spec.flavour, spec.truth)),
        strength=spec.strength,
        plan=spec.plan,
        variant=spec.variant,
        noise_V=NOISE_V,
        missed_V=tuple(missed_V(told, f) for f in flown),
        told=told,
        recordings=tuple(recording for recording, _ in pieces),
        concealed=tuple(concealed for _, concealed in pieces),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """One case that was made or skipped, in words."""

    text: str
    seconds: float


def make_file(spec: Spec, folder: Path) -> Done:
    """Make one case into its file."""
    start = time.perf_counter()
    path = folder / spec.split / f"{spec.name}.npz"
    flights = [
        kept_flight(spec.plan, seed, full_C=spec.told.full_C, drawn=spec.drawn)
        for seed in spec.flights()
    ]
    try:
        case = make_case(spec, flights, Solves(folder=folder / "solves"))
    except OutOfReachError as e:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_suffix(".skipped").write_text(f"{e}\n")
        text = f"{spec.name}: skipped, {e}"
    else:
        case.save(path)
        missed = ", ".join(f"{1e3 * m:.1f}" for m in case.missed_V)
        sizes = ", ".join(f"{s:.3g}" for s in case.sizes)
        text = f"{spec.name}: size {sizes or '-'}, the twin misses {missed} mV"
    return Done(text=text, seconds=time.perf_counter() - start)


def wanted(folder: Path, splits: Sequence[str], only: Sequence[str]) -> list[Spec]:
    """Cases that are not there yet."""
    return [
        spec
        for split in splits
        for spec in specs(split)
        if (not only or any(e in spec.truth for e in only))
        and not any((folder / split / f"{spec.name}{end}").exists() for end in (".npz", ".skipped"))
    ]


def run(left: Sequence[Spec], folder: Path, jobs: int) -> Iterator[Done]:
    """Each as it is done."""
    work = partial(make_file, folder=folder)
    if jobs == 1:
        yield from map(work, left)
        return
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        yield from pool.imap_unordered(work, left)


def main() -> None:
    """Make what is not there."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--split", choices=tuple(PLANS), help="default: both")
    parser.add_argument("--only", nargs="+", default=[], choices=tuple(ALL), metavar="EFFECT")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    splits = (chosen.split,) if chosen.split else tuple(PLANS)
    left = wanted(chosen.folder, splits, chosen.only)
    sys.stdout.write(f"{len(left)} cases to make\n")
    for k, done in enumerate(run(left, chosen.folder, chosen.jobs), start=1):
        sys.stdout.write(f"{k}/{len(left)} {done.seconds:.0f} s {done.text}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
