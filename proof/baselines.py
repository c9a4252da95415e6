"""What a sceptic asks for: would anything else have mended the voltage as well?

Three, each fitted to the fitted recordings alone and judged on those held out, as the verdict is:
numbers of the base twin without new physics; a correction of the voltage without physics; an effect
drawn by chance with as many numbers as what was named.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from analyze.checks import checked_pack
from analyze.workbench.explain import Request, drawn_of, flights_of
from proof.correction import Answered, corrected
from proof.outcome import Baseline
from proof.question import PACK, Question
from twin.mismatch import HYPOTHESES, Flight, Hypothesis
from twin.mismatch.explain import begun
from twin.mismatch.fit import Data, Known, fit
from twin.mismatch.search import again, flown_before
from twin.mismatch.split import sharpened, split
from twin.pack import Pack

BASE = (
    "electrolyte_transport",
    "solid_diffusion_negative",
    "solid_diffusion_positive",
    "reaction_kinetics",
    "series_resistance",
    "initial_soc",
    "active_material_loss_negative",
    "active_material_loss_positive",
    "lithium_inventory_loss",
)
"""Numbers that the base twin has: transport, diffusion, kinetics, resistance, and capacities with
the start of charge. Where one of them is what is wrong, this baseline holds the truth too."""


def baselines(question: Question, verdict: Mapping[str, Any]) -> Iterator[Baseline]:
    """Of a verdict that names something; none of another."""
    if verdict["verdict"] != "named":
        return
    data = split(*recordings(question), slow_V=question.floor_V)
    named = [e["id"] for e in verdict["effects"]]
    alike = [i for e in verdict["effects"] for i in e["equivalent"]]
    own = [h for h in HYPOTHESES if h.id in named]
    data = _as_judged(data, own, stated=question.floor_V is not None)
    yield _fitted(data, "refit", _known(BASE), "all numbers of the base twin at once", near(data))
    yield _corrected(data)
    if chosen := by_chance(named, _seed(question), question.pack, alike):
        what = " + ".join(h.id for h in chosen)
        yield _fitted(data, "random", chosen, what)


def recordings(question: Question) -> tuple[list[Flight], list[Flight]]:
    """Fitted and held out, read from the files of the question and begun as `twin explain` does."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        question.write(folder)
        fitted, held_out = (
            tuple(folder / f"{r.name}.csv" for r in own)
            for own in (question.fitted, question.held_out)
        )
        request = Request(
            sources=fitted, holdout=held_out, pack=folder / PACK, out=folder, adopt=None,
            between=question.between.value, battery=None, conceal="", reveal=(),
        )  # fmt: skip
        choice = checked_pack(request.pack)
        flights = [begun(f) for f in flights_of(drawn_of(request, choice), choice)[0]]
    return flights[: len(fitted)], flights[len(fitted) :]


def _as_judged(data: Data, named: Sequence[Hypothesis], *, stated: bool) -> Data:
    """The recordings as `twin.mismatch.explain` saw them in the end, by what was named."""
    if not stated:
        data = flown_before(data, [fit(data, named)]) or data
    best = fit(data, named)
    finer = sharpened(data, best, stated=stated)
    return again(finer, [best]) if finer else data


def by_chance(
    named: Sequence[str], seed: int, pack: Pack, alike: Sequence[str] = ()
) -> tuple[Hypothesis, ...]:
    """For each effect that was named another with as many numbers, or about as many.

    None that the pack cannot have, or states within errors: it would be held, and no rival. None
    that the verdict itself calls `alike`: that is no other effect. As many as are left.
    """
    rng = np.random.default_rng(seed)
    sizes = {h.id: len(h.fitted) for h in HYPOTHESES}
    held = {*named, *alike, *pack.standard_errors, *(() if pack.series > 1 else ("weak_cell",))}
    left = [h for h in HYPOTHESES if h.id not in held]
    chosen: list[Hypothesis] = []
    for effect in named[: len(left)]:
        nearest = min(abs(len(h.fitted) - sizes[effect]) for h in left)
        fits = [h for h in left if abs(len(h.fitted) - sizes[effect]) == nearest]
        chosen.append(fits[int(rng.integers(len(fits)))])
        left.remove(chosen[-1])
    return tuple(chosen)


def near(data: Data) -> tuple[Known, ...]:
    """Where a fit of all of BASE may begin: each at its best alone, from all of its own starts.

    From the twin as it is a descent may end at the edge of what a cell can lose.
    """
    alone = [fit(data, (h,)) for h in HYPOTHESES if h.id in BASE]
    return tuple(own.problem.values(own.q) for own in alone)


def _known(ids: Sequence[str]) -> tuple[Hypothesis, ...]:
    """From the twin as it is: other starts of so many at once would multiply."""
    return tuple(replace(h, starts=h.starts[:1]) for h in HYPOTHESES if h.id in ids)


def _seed(question: Question) -> int:
    """Of the numbers of the recordings: the same question, the same draw."""
    return zlib.crc32(question.fitted[0].voltage_V.tobytes())


def _fitted(
    data: Data, name: str, chosen: Sequence[Hypothesis], what: str, known: Sequence[Known] = ()
) -> Baseline:
    best = fit(data, chosen, known)
    return Baseline(
        id=name,
        what=what,
        numbers=sum(len(h.fitted) for h in chosen),
        held_out_V=best.held_out_rms_V(),
    )


def _corrected(data: Data) -> Baseline:
    """Of the residuals of the twin as configured."""
    found = corrected([Answered.of(flight) for flight, _ in data.fitted])
    ahead = [Answered.of(flight) for flight, _ in data.held_out]
    left_V = np.concatenate([
        whiten.settled(own.residual_V - found.at(own))
        for own, (_, whiten) in zip(ahead, data.held_out, strict=True)
    ])  # fmt: skip
    return Baseline(
        id="correction",
        what=f"sparse regression on {', '.join(found.names) or 'nothing'}",
        numbers=len(found.names) + 1,
        held_out_V=float(np.sqrt(np.nanmean(left_V**2))),
    )
