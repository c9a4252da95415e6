"""Each effect that was left out: equation, source, numbers."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib import get_data_path
from matplotlib.font_manager import fontManager
from matplotlib.mathtext import MathTextParser

from reports.mismatch.report import MismatchReport
from reports.mismatch.summary import of_effect, sizes_V
from reports.mismatch.words import clause, name, number, percent, sentence, unit
from reports.plots import MEASURED, panels, to_svg
from reports.quantity import significant, to_error
from reports.section import Figure, Row, Section
from twin.effects import SelfHeating
from twin.mismatch import NamedEffect, Value, Verdict

HEIGHT_IN = 0.75
SIZE = 16.0  # points


def effects(report: MismatchReport) -> tuple[Section, ...]:
    """A section for each."""
    sizes = sizes_V(report.finding)
    settled = report.finding.verdict is Verdict.NAMED
    found = report.finding.effects
    return tuple(
        _section(
            e,
            of_effect(e, sizes.get(e.id)) if settled else _if(e, sizes.get(e.id)),
            _in_file(report, found if settled else (e,), e),
            k,
        )
        for k, e in enumerate(found, start=1)
    )


def _if(e: NamedEffect, size_V: float | None) -> str:
    return f"not settled; if it is this, {of_effect(e, size_V)}"


def _in_file(report: MismatchReport, on: Sequence[NamedEffect], e: NamedEffect) -> Row:
    """All that the pack file then switches on: the list stands in place of the one it has."""
    ids = dict.fromkeys((*report.physics, *(other.pack_id for other in on)))
    listed = ", ".join(f'"{i}"' for i in ids)
    table = "environment" if e.pack_id == SelfHeating.id else f"effects.{e.pack_id}"
    numbers = ", ".join(f"{v.name} = {v.value:.6g}" for v in e.parameters)
    whole = f"; {report.adopted} has all of it" if report.adopted else "; --adopt writes all of it"
    return Row(
        label="In a pack file",
        value=f"[twin] physics = [{listed}]",
        note=f"and [{table}] {numbers}" + whole * (report.finding.verdict is Verdict.NAMED),
    )


def _section(e: NamedEffect, said: str, in_file: Row, place: int) -> Section:
    drawing = equation(e.equation, f"equation{place}")
    rows = [
        Row(
            label="Probability",
            value=percent(e.probability),
            note="that it, or what looks like it, is part of what was left out",
        )
    ]
    rows += [_parameter(v) for v in e.parameters]
    rows += [
        Row(label="Looks the same here", value=name(other), note=clause(other, e.instead[other]))
        for other in e.equivalent
    ]
    if drawing is None:
        rows.append(Row(label="Equation", value=e.equation))
    rows += [
        in_file,
        Row(label="Source", value=e.source),
    ]
    return Section(
        id=f"effect-{e.id}",
        title=sentence(name(e.id))[:-1],
        lead=(sentence(said), f"What it leaves in a recording: {e.signature}."),
        figures=() if drawing is None else (drawing,),
        rows=tuple(rows),
        notes=("± is one standard deviation, from the fitted recordings and the prior.",),
    )


def _parameter(v: Value) -> Row:
    shown, factor = unit(v.unit)
    return Row(
        label=sentence(number(v.name))[:-1],
        value=to_error(factor * v.shown, factor * v.std),
        sd=significant(factor * v.std, 2),
        unit=shown,
    )


def equation(latex: str, place: str) -> Figure | None:
    """`latex` as a drawing; None if it holds what cannot be set."""
    _know_own_fonts()
    text = f"${latex.replace(chr(92) + 'tfrac', chr(92) + 'frac')}$"
    try:
        MathTextParser("path").parse(text)
    except ValueError:
        return None
    canvas, (ax,) = panels([HEIGHT_IN])
    ax.set_axis_off()
    ax.text(0.0, 0.5, text, fontsize=SIZE, color=MEASURED, va="center", math_fontfamily="stix")
    svg = to_svg(canvas, place, text_as_paths=True)
    return Figure(caption="", description=f"Equation, in LaTeX: {latex}", svg=svg)


def _know_own_fonts() -> None:
    """Add the fonts that come with matplotlib where its list lacks them.

    A user's installations share one list, kept on disk: it may be that of another, which had none.
    """
    known = {Path(font.fname) for font in fontManager.ttflist}
    for path in sorted(Path(get_data_path(), "fonts", "ttf").glob("*.ttf")):
        if path not in known:
            fontManager.addfont(path)
