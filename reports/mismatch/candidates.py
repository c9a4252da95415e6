"""All that was tried, ranked, and why it was not taken."""

from reports.mismatch.report import MismatchReport
from reports.mismatch.summary import mV
from reports.mismatch.words import name
from reports.plots import MEASURED, ROW_IN, SIMULATED, named_rows, panels, to_svg
from reports.quantity import fixed
from reports.section import Cell, Column, Figure, Section, Table
from twin.mismatch import Candidate, Finding, Verdict

DRAWN = 12
AS_GOOD = 1.1  # times the held-out error of the best
BY_CHANCE = 0.01
EVIDENCE = "evidence lost (6 is strong)"
WEIGHED = (
    "Evidence lost against the best is a difference of BIC, twice the logarithm of the odds: "
    "2 to 6 speaks against a candidate, 6 to 10 strongly, more very strongly (Kass and Raftery, "
    "J. Am. Stat. Assoc. 90, 773 (1995), doi:10.1080/01621459.1995.10476572)."
)
COLUMNS = (
    Column(title="left out of the twin", numeric=False),
    Column(title="held-out error [mV]"),
    Column(title=EVIDENCE),
    Column(title="probability [%]"),
    Column(title="outcome", numeric=False),
)


def candidates(report: MismatchReport) -> Section | None:
    """A drawing of the best and a table of all."""
    finding = report.finding
    if not finding.candidates:
        return None
    rows = tuple(row(c, finding) for c in finding.candidates)
    tables = [Table(caption="The best candidates", columns=COLUMNS, rows=rows[:DRAWN])]
    if rest := rows[DRAWN:]:
        text = f"{len(rest)} more that were tried"
        tables.append(Table(caption=text, columns=COLUMNS, rows=rest, folded=True))
    return Section(
        id="candidates",
        title="What was tried",
        lead=(
            "Every effect the twin may lack, alone and in combinations, fitted on equal terms; "
            "instruments and wrong start values among them. Ranked by evidence: how probable the "
            "recordings are with it, fitted numbers paid for.",
        ),
        figures=(_figure(finding),),
        tables=tuple(tables),
        notes=(WEIGHED,),
    )


def label(ids: tuple[str, ...]) -> str:
    """Of a model; without effects it has only the starts to fit."""
    return " + ".join(name(i) for i in ids) or "nothing"


def outcome(c: Candidate, finding: Finding) -> str:
    """Taken, as good, or the first reason against it."""
    first = finding.candidates[0]
    taken = tuple(sorted(e.id for e in finding.effects))
    if tuple(sorted(c.ids)) == taken and finding.verdict is not Verdict.UNKNOWN:
        return "taken" if finding.verdict is not Verdict.AMBIGUOUS else "likeliest, not settled"
    if finding.verdict is Verdict.UNKNOWN:
        return "leaves more than noise"
    if c.probability >= BY_CHANCE:
        return "possible"
    if c.held_out_rms_V > AS_GOOD * first.held_out_rms_V:
        return "rejected: misses what was held out"
    if len(c.ids) > len(taken):
        return "rejected: more effects than are needed"
    return "rejected: less evidence"


def row(c: Candidate, finding: Finding) -> tuple[Cell, ...]:
    """In the order of COLUMNS."""
    numbers = mV(c.held_out_rms_V), fixed(c.delta_bic, 1), fixed(100 * c.probability, 1)
    return tuple(Cell(text=t) for t in (label(c.ids), *numbers, outcome(c, finding)))


def _figure(finding: Finding) -> Figure:
    shown = finding.candidates[:DRAWN]
    canvas, (ax,) = panels([0.6 + ROW_IN * len(shown)])
    errors_mV = [1e3 * c.held_out_rms_V for c in shown]
    noise_mV = 1e3 * finding.errors.noise
    for k, error in enumerate(errors_mV):
        ax.plot([0.0, error], [k, k], color="#e3e3e3", linewidth=7, solid_capstyle="butt")
    ax.plot(errors_mV, range(len(shown)), "o", color=SIMULATED)
    ax.axvline(noise_mV, color=MEASURED, linewidth=0.8, linestyle="--")
    ax.annotate(
        "noise", (noise_mV, 1.0), xycoords=("data", "axes fraction"), fontsize=8, ha="center",
        va="bottom",
    )  # fmt: skip
    ax.set_xlim(left=0.0)
    ax.set_xlabel("error on what was held out [mV]")
    named_rows(ax, [label(c.ids) for c in shown])
    return Figure(
        caption="The best candidates by evidence, with their error on what was held out.",
        description="; ".join(f"{label(c.ids)} {mV(c.held_out_rms_V)} mV" for c in shown),
        svg=to_svg(canvas, "candidates"),
    )
