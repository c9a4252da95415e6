"""Verdicts beside the truth: which are right, and the tables of `benchmarks/mismatch.py`."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations
from typing import Any

import numpy as np

from proof.compare import MOST_EQUIVALENT
from proof.simulated.effects import true_value_in
from tests.mismatch_cases.case import Case

NEAR_FLOOR = 1.5  # of the noise, held out
BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.001)  # of probabilities
WITHIN = 2.0  # stated deviations
OUTCOMES = ("right", "part", "wrong", "ambiguous", "unknown", "none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """One verdict.

    Attributes:
        name: of the case.
        truth: ids of what was in it.
        kind: `control`, `foreign`, `poor`, or the strength; `pair 3x` of a pair.
        outcome: one of OUTCOMES; `right` where it says what it should (for a control and for
            what is foreign: `none` and `unknown`).
        named: ids that were named, "a|b" where b is an equivalent.
        sure: probability and rightness of each effect that was named.
        sized: effect, found minus true in stated deviations, of those named that were in it.
        held_out: after, over the noise.
        seconds: of the verdict.
    """

    name: str
    truth: tuple[str, ...]
    kind: str
    outcome: str
    named: tuple[str, ...]
    sure: tuple[tuple[float, bool], ...]
    sized: tuple[tuple[str, float], ...]
    held_out: float
    seconds: float

    def line(self) -> str:
        """For a log."""
        named = " + ".join(self.named) or "-"
        return (
            f"{self.outcome:9s} {self.name:44s} {named:70s} held out {self.held_out:5.2f} x noise "
            f"{self.seconds:4.0f} s"
        )


def judged(case: Case, verdict: Mapping[str, Any]) -> Judged:
    """A case and what `mismatch.json` says of it."""
    effects = verdict["effects"]
    lists = [(e["id"], *e["equivalent"]) for e in effects]
    own = [e["id"] for e in effects if {e["id"], *e["equivalent"]} & set(case.truth)]
    said = verdict["verdict"]
    outcome = _outcome(case, said, lists)
    errors = verdict["rmse_mv"]
    return Judged(
        name=case.name,
        truth=case.truth,
        kind=_kind(case),
        outcome=outcome,
        named=tuple("|".join(ids) for ids in lists),
        sure=tuple((e["probability"], e["id"] in own) for e in effects if said == "named"),
        sized=tuple(_sized(case, effects)),
        held_out=errors["holdout_after"] / (1e3 * case.noise_V),
        seconds=verdict["seconds"],
    )


def _sized(case: Case, effects: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, float]]:
    known = dict(zip(case.truth, zip(case.sizes, case.flavours, strict=True), strict=True))
    for e in effects:
        if e["id"] in known and (true := true_value_in(case.told, e["id"], *known[e["id"]])):
            for own in e["parameters"]:  # only what the recordings tell
                if own["name"] == true[0]:
                    yield e["id"], (own["value"] - true[1]) / own["std"]


def _kind(case: Case) -> str:
    if case.variant not in ("plain", "quantised"):
        return "poor"
    if not case.truth:
        return "control"
    if case.truth[0].startswith("foreign"):
        return f"foreign {case.strength}"
    return case.strength if len(case.truth) == 1 else f"pair {case.strength}"


def _outcome(case: Case, said: str, lists: Sequence[tuple[str, ...]]) -> str:
    expected = "unknown" if any(e.startswith("foreign") for e in case.truth) else "named"
    if not case.truth:
        expected = "none"
    if said != "named":
        return "right" if said == expected else said
    if expected != "named":
        return "wrong"
    short = [ids for ids in lists if len(ids) <= 1 + MOST_EQUIVALENT]
    meant = _matched(case.truth, short)
    if meant == len(case.truth) == len(lists):
        return "right"
    return "part" if meant == len(lists) else "wrong"


def _matched(truth: Sequence[str], lists: Sequence[tuple[str, ...]]) -> int:
    """How many of the truths have a list of their own."""
    slots = max(len(truth), len(lists))
    padded = [*lists, *[()] * (slots - len(lists))]
    return max(
        sum(t in ids for t, ids in zip(truth, order, strict=False))
        for order in permutations(padded)
    )


def tables(done: Sequence[Judged]) -> str:
    """All of them as text."""
    parts = (_by_kind, _confusion, _calibration, _sizes, _held_out, _missed)
    return "\n".join(part(done) for part in parts)


def _by_kind(done: Sequence[Judged]) -> str:
    lines = [f"\n{'':14s}" + "".join(f"{o:>11s}" for o in (*OUTCOMES, "of"))]
    for kind in sorted({j.kind for j in done}):
        own = [j.outcome for j in done if j.kind == kind]
        counts = Counter(own)
        row = "".join(f"{counts[o]:11d}" for o in OUTCOMES)
        lines.append(f"{kind:14s}{row}{len(own):11d}")
    return "\n".join(lines) + "\n"


def _confusion(done: Sequence[Judged]) -> str:
    """Single effects: truth by row, what was named by count."""
    lines = ["truth -> what was said"]
    for truth in sorted({j.truth for j in done}):
        own = Counter((" + ".join(j.named) or j.outcome) for j in done if j.truth == truth)
        said = ", ".join(f"{name} ({n})" for name, n in own.most_common())
        lines.append(f"  {' + '.join(truth) or 'nothing':45s} {said}")
    return "\n".join(lines) + "\n"


def _calibration(done: Iterable[Judged]) -> str:
    pairs = np.array([pair for j in done for pair in j.sure], dtype=float).reshape(-1, 2)
    lines = ["probability given: effects named, share right"]
    for low, high in pairwise(BINS):
        own = pairs[(pairs[:, 0] >= low) & (pairs[:, 0] < high)]
        if own.size:
            lines.append(
                f"  {low:.2f} to {min(high, 1):.2f}  {len(own):4d}  {own[:, 1].mean():.2f}"
            )
    return "\n".join(lines) + "\n"


def _sizes(done: Sequence[Judged]) -> str:
    every = [z for j in done for z in j.sized]
    lines = ["sizes found minus true, in stated deviations: effect, how many, rms, largest"]
    for effect in sorted({e for e, _ in every}):
        z = np.array([z for e, z in every if e == effect])
        rms, most = np.sqrt(np.mean(z**2)), np.abs(z).max()
        lines.append(f"  {effect:30s} {z.size:3d} {rms:6.2f} {most:6.2f}")
    if every:
        within = np.abs([z for _, z in every]) < WITHIN
        lines.append(f"  within {WITHIN:.0f}: {np.mean(within):.0%} of {len(every)}")
    return "\n".join(lines) + "\n"


def _held_out(done: Iterable[Judged]) -> str:
    own = np.array([j.held_out for j in done if j.named])
    if not own.size:
        return ""
    near = np.mean(own <= NEAR_FLOOR)
    return (
        f"held out after, over the noise: median {np.median(own):.2f}, largest {own.max():.2f}; "
        f"within {NEAR_FLOOR} in {near:.0%} of {own.size} named\n"
    )


def _missed(done: Sequence[Judged]) -> str:
    seconds = np.array([j.seconds for j in done] or [0.0])
    lines = [f"time a verdict: median {np.median(seconds):.0f} s, most {seconds.max():.0f} s"]
    lines += [j.line() for j in done if j.outcome != "right"]
    return "\n".join(lines) + "\n"
