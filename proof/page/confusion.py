"""What was said of each single effect: a matrix."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from matplotlib.patches import Rectangle

from proof.compare import hit
from proof.outcome import Judged, Outcome, Proof
from proof.page.words import WORST_FIRST, plural, short
from proof.tally import STRONG, control, recorded, simulated, weak
from proof.truth import RECORDED
from reports.mismatch.words import NAMES, name
from reports.plots import MEASURED, panels, to_svg
from reports.section import Figure, Section

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NOTHING, FOREIGN, SEVERAL = "nothing", "not in the library", "several effects"
SAID = {"none": NOTHING, "unknown": FOREIGN, "ambiguous": "not settled"}
LAST = (FOREIGN, "not settled", SEVERAL, NOTHING)  # after the effects
COLOURS = {
    Outcome.RIGHT: "#9fd8c4",
    Outcome.PART: "#d9d9d9",
    Outcome.MISSED: "#d9d9d9",
    Outcome.WRONG: "#f2a97a",
}
WORST = (*WORST_FIRST, Outcome.RIGHT)
ALIKE = "≈"
CELL_IN = 0.29
LEAST_WIDE = 16  # cells that there is room for, so that few do not become large
NAMES_IN = 1.9  # above the columns


@dataclass(frozen=True, slots=True, kw_only=True)
class Count:
    """Trials of one truth of which one thing was said; of `alike` a name that looks the same."""

    trials: int
    alike: int
    worst: Outcome


Matrix = Mapping[tuple[str, str], Count]
Sort = Callable[[Judged], str]


def confusion(proof: Proof) -> Section | None:
    """A matrix of what is strong enough to be named, one of what is not, one of real cells."""
    single = [t for t in proof.trials if t.truth.kind in ("single", "foreign", "control")]
    figures = []
    for place, (own, which) in enumerate((
        ([t for t in single if not weak(t)], f"{STRONG:.0f} × noise or more, and controls"),
        ([t for t in single if weak(t)], f"below {STRONG:.0f} × noise"),
    )):  # fmt: skip
        if own:
            figures.append(_figure(matrix(own), f"One effect, or nothing: {which}", place))
    if real := [t for t in proof.trials if recorded(t)]:
        counts = matrix(real, put_in=concealed, said=said_of_concealed)
        figures.append(_figure(counts, "Recorded on real cells, by what was concealed", 2))
    if not figures:
        return None
    return Section(
        id="confusion",
        title="What was taken for what",
        lead=(
            "A row is what was put in, a column what was said, a number how many trials. Counted "
            "under its truth is also what these recordings cannot tell from it, if the tool said "
            f"so; of such there are as many as the number after {ALIKE}. On real cells a row is a "
            "kind of trial, and right is what was named for what it conceals. Green: right. Red: "
            "something was named that is not there. Grey: too little, or nothing, was named.",
        ),
        figures=tuple(figures),
    )


def matrix(
    trials: Iterable[Judged], *, put_in: Sort | None = None, said: Sort | None = None
) -> Matrix:
    """Truth and what was said -> how often; by themselves those of one effect."""
    row, column = put_in or effect, said or said_of_effect
    found: dict[tuple[str, str], list[Judged]] = defaultdict(list)
    for t in trials:
        found[row(t), column(t)].append(t)
    return {
        key: Count(
            trials=len(own),
            alike=sum(_alike(t) for t in own),
            worst=next(o for o in WORST if any(t.outcome is o for t in own)),
        )
        for key, own in found.items()
    }


def effect(t: Judged) -> str:
    """The row of a trial with one effect, or none."""
    if t.truth.effects:
        return t.truth.effects[0][0]
    return FOREIGN if t.truth.kind == "foreign" else NOTHING


def said_of_effect(t: Judged) -> str:
    """Its column."""
    return _said(t, effect(t))


def concealed(t: Judged) -> str:
    """The row of a trial on a real cell."""
    return NOTHING if control(t) else t.truth.kind


def said_of_concealed(t: Judged) -> str:
    """Its column."""
    return _said(t, concealed(t))


def _said(t: Judged, row: str) -> str:
    if t.verdict != "named":
        return SAID.get(t.verdict, t.verdict)
    if len(t.named) != 1:
        return SEVERAL
    own = t.named[0]
    return row if any(hit(own, a) for a in t.truth.effects) else own.id


def _alike(t: Judged) -> bool:
    """Right by a name that is not that of its truth."""
    if len(t.named) != 1 or said_of_effect(t) != effect(t):
        return False
    own = {effect(t)} if simulated(t) else {i for alike in t.truth.effects for i in alike}
    return t.named[0].id not in own


def ordered(ids: Iterable[str]) -> list[str]:
    """Effects as they are listed elsewhere, then what is none."""
    order = [*RECORDED, *NAMES]
    own = set(ids)
    known = [i for i in order if i in own]
    rest = sorted(own - set(order) - set(LAST))
    return [*known, *rest, *(i for i in LAST if i in own)]


def _figure(counts: Matrix, which: str, place: int) -> Figure:
    rows = ordered(row for row, _ in counts)
    columns = ordered([*rows, *(column for _, column in counts)])
    canvas, (ax,) = panels([NAMES_IN + CELL_IN * len(rows)])
    for y, row in enumerate(rows):
        for x, column in enumerate(columns):
            edge = "#8c8c8c" if row == column else "none"
            ax.add_patch(_square(x, y, facecolor="#f5f5f5", edgecolor=edge, linewidth=0.8))
    for (row, column), count in counts.items():
        _cell(ax, columns.index(column), rows.index(row), count)
    ax.set_xticks(range(len(columns)), [short(name(c)) for c in columns], rotation=50, ha="left",
                  rotation_mode="anchor", parse_math=False)  # fmt: skip
    ax.xaxis.tick_top()
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    ax.grid(visible=False)
    ax.set_xlim(-0.5, max(len(columns), LEAST_WIDE) - 0.5)
    ax.set_yticks(range(len(rows)), [short(name(r)) for r in rows], parse_math=False)
    ax.set_ylim(len(rows) - 0.5, -0.5)
    read = "; ".join(
        f"{name(row)} said to be {name(column)}: {c.trials}" for (row, column), c in counts.items()
    )
    return Figure(
        caption=f"{which}; {plural(sum(c.trials for c in counts.values()), 'trial')}.",
        description=f"Matrix of truth and verdict, {which}. {read}.",
        svg=to_svg(canvas, f"confusion{place}"),
    )


def _square(x: int, y: int, **how: object) -> Rectangle:
    return Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, **how)  # type: ignore[arg-type]


def _cell(ax: "Axes", x: int, y: int, count: Count) -> None:
    ax.add_patch(_square(x, y, facecolor=COLOURS[count.worst], linewidth=0))
    text = f"{count.trials} {ALIKE}{count.alike}" if count.alike else f"{count.trials}"
    ax.text(x, y, text, ha="center", va="center", fontsize=9, color=MEASURED)
