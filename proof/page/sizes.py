"""Numbers of effects beside their true values, in the deviations that the tool states."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from proof.outcome import Judged, Proof, Sized
from proof.page.spread import aside
from proof.page.words import between, plural, points, short
from proof.tally import Share
from reports.mismatch.words import name, number, unit
from reports.plots import COMMANDED, MEASURED, SIMULATED, named_rows, panels, to_svg
from reports.quantity import MISSING, fixed, significant
from reports.section import Cell, Column, Figure, Section, Table

LARGEST = 6.0  # deviations that are drawn to scale; what is farther off lies on the edge
EXPECTED = ((1.0, 68), (2.0, 95))  # deviations either way, percent of a normal law
FAR = 3.0  # deviations, beyond which three of a thousand lie
LONGEST_LABEL = 60  # letters
ROW_IN = 0.36
COLUMNS = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="effect", numeric=False),
    Column(title="number", numeric=False),
    Column(title="true"),
    Column(title="found"),
    Column(title="stated deviation"),
    Column(title="unit", numeric=False),
    Column(title="off by [stated deviations]"),
    Column(title="off by [%]"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """A number of a trial.

    Attributes:
        trial: name of it.
        of: the number.
        off: found minus true in stated deviations; None without them.
        renamed: the name stands second, after one that looks the same.
    """

    trial: str
    of: Sized
    off: float | None
    renamed: bool


def sizes(proof: Proof) -> Section | None:
    """A drawing and a table; None if no true number is known."""
    own = [_size(t, s) for t in proof.trials for s in t.sized]
    if not own:
        return None
    told = [s for s in own if s.off is not None]
    absent = len(own) - len(told)
    lead = [
        "A stated deviation is a promise: if it is honest, 68 of 100 numbers lie within one of the "
        "truth and 95 of 100 within two."
    ]
    lead += [_held(told)] if told else []
    if absent:
        lead.append(
            f"{plural(absent, 'number')} without a figure: the effect was not named, or the "
            "recordings do not tell that number of it."
        )
    return Section(
        id="sizes",
        title="Sizes found and true",
        lead=tuple(lead),
        figures=(_figure(told),) if told else (),
        tables=(
            Table(
                caption="Numbers whose true value is known", columns=COLUMNS,
                rows=tuple(_row(s) for s in own),
            ),
        ),
    )  # fmt: skip


def _size(t: Judged, s: Sized) -> Size:
    off = None
    if s.found is not None and s.std is not None and s.std > 0:
        off = (s.found - s.true) / s.std
    return Size(
        trial=t.name, of=s, off=off if off is not None and isfinite(off) else None,
        renamed=any(s.effect in n.equivalent for n in t.named),
    )  # fmt: skip


def _held(told: Sequence[Size]) -> str:
    parts = []
    for within, expected in EXPECTED:
        share = Share(count=sum(abs(s.off or 0.0) <= within for s in told), of=len(told))
        parts.append(
            f"{share.count} of {share.of} within {within:.0f} ({points(share.value)} %, interval "
            f"{between(share)} %; {expected} % expected)"
        )
    far = sum(abs(s.off or 0.0) > FAR for s in told)
    parts.append(f"{far} of {len(told)} beyond {FAR:.0f} (0.3 % expected)")
    return f"Here: {'; '.join(parts)}."


def _figure(told: Sequence[Size]) -> Figure:
    rows = sorted({_label(s) for s in told})
    canvas, (ax,) = panels([0.75 + ROW_IN * len(rows)])
    ax.axvspan(-1, 1, color="#8c8c8c", alpha=0.3, linewidth=0)
    ax.axvspan(-2, 2, color="#8c8c8c", alpha=0.15, linewidth=0)
    ax.axvline(0.0, color=MEASURED, linewidth=0.8)
    for k, row in enumerate(rows):
        off = [s.off for s in told if _label(s) == row and s.off is not None]
        for i, x in enumerate(off):
            drawn = float(np.clip(x, -LARGEST, LARGEST))
            beyond = ("<", ">")[x > 0] if abs(x) > LARGEST else "o"
            colour = SIMULATED if abs(x) <= EXPECTED[-1][0] else COMMANDED
            ax.plot(drawn, k + aside(i), beyond, color=colour, markersize=5, clip_on=False)
    ax.set_xlim(-LARGEST, LARGEST)
    ax.set_xlabel("found − true [stated deviations]")
    named_rows(ax, rows)
    return Figure(
        caption="Found minus true, in the deviations that were stated. Grey: one and two of them. "
        f"Arrows: more than {LARGEST:.0f}.",
        description="; ".join(f"{s.trial}, {_label(s)}: {fixed(s.off, 1)}" for s in told),
        svg=to_svg(canvas, "sizes"),
    )


def _label(s: Size) -> str:
    return short(f"{name(s.of.effect)}: {number(s.of.name)}", LONGEST_LABEL)


def _off(s: Size) -> str:
    if s.of.found is None:
        return "not told" if s.renamed else "not named"
    return fixed(s.off, 1)


def _row(s: Size) -> tuple[Cell, ...]:
    of = s.of
    effect = name(of.effect) + ", as what looks the same" * s.renamed
    shown, factor = unit(of.unit)
    numbers = [
        MISSING if v is None else significant(factor * v, digits)
        for v, digits in ((of.true, 3), (of.found, 3), (of.std, 2))
    ]
    relative = None if of.found is None or not of.true else 100 * (of.found / of.true - 1)
    far = s.off is None or abs(s.off) > EXPECTED[-1][0]
    return (
        *(Cell(text=x) for x in (s.trial, effect, number(of.name), *numbers, shown)),
        Cell(text=_off(s), doubt=far),
        Cell(text=fixed(relative, 0)),
    )
