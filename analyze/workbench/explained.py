"""A finding in words, and the report of it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from analyze.pack_choice import PackChoice
from analyze.version import version
from analyze.workbench.drawn import Drawn, pack_lines
from analyze.workbench.listing import print_table
from reports.flight import PackUse
from reports.mismatch import MismatchReport, Recorded, headline
from reports.mismatch.candidates import EVIDENCE
from reports.mismatch.summary import errors_of, mV
from reports.quantity import fixed, significant, to_error
from twin.mismatch import Finding, Span, Value, Verdict

SHOWN = 6
LARGEST = 2  # spans in a line
HEADER = ("left out", "probability", "held out, mV", EVIDENCE)


def print_packs(uses: Mapping[str, PackUse]) -> None:
    """The pack, once for all recordings of which the same is known, below their names."""
    whose: dict[str, list[str]] = {}
    for name, use in uses.items():
        whose.setdefault(pack_lines(use), []).append(name)
    for lines, names in whose.items():
        click.echo(f"{', '.join(names)}\n{lines}")


def print_finding(finding: Finding) -> None:
    """The sentence, then the numbers."""
    click.echo(f"verdict  {finding.verdict.value}: {headline(finding)}")
    for e in finding.effects:
        click.echo(f"effect   {e.id} ({e.probability:.0%}): {_values(e.parameters)}")
        for other in e.equivalent:  # which these recordings cannot tell from it
            click.echo(f"or       {other}: {_values(e.instead[other])}")
    if finding.verdict is Verdict.UNKNOWN and finding.spans:
        click.echo(f"where    {_where(finding.spans)}")
    for t in finding.terms:
        click.echo(f"depends  on {t.quantity}: {1e3 * t.size_V:+.1f} mV per standard deviation")
    errors = ", ".join(f"{mV(error_V)} mV {twin}" for twin, error_V in errors_of(finding))
    click.echo(f"error    on what was held out: {errors}; noise {mV(finding.errors.noise)} mV")
    rows = [
        (
            " + ".join(c.ids) or "nothing",
            f"{c.probability:.2f}",
            f"{1e3 * c.held_out_rms_V:.1f}",
            f"{c.delta_bic:.1f}",
        )
        for c in finding.candidates[:SHOWN]
    ]
    print_table(HEADER, rows)
    for text in finding.remarks:
        click.echo(f"doubtful {text}", err=True)
    if finding.advice:
        click.echo(f"further  {finding.advice}")


def _where(spans: Sequence[Span]) -> str:
    """The largest: they come first."""
    said = (
        f"{mV(s.mean_V)} mV in {s.flight} from {fixed(s.start_s, 1)} to {fixed(s.stop_s, 1)} s "
        f"({fixed(100 * s.share, 0)} % of the mismatch)"
        for s in spans[:LARGEST]
    )
    return f"recorded minus simulated is {', '.join(said)}"


def _values(values: Sequence[Value]) -> str:
    return ", ".join(
        f"{v.name} {to_error(v.shown, v.std, 4)} ± {significant(v.std, 2)}" for v in values
    )


def report_of(
    choice: PackChoice, recorded: tuple[Recorded, ...], drawn: Mapping[str, Drawn],
    finding: Finding, adopted: Path | None,
) -> MismatchReport:  # fmt: skip
    """What the page is made of but for channels concealed and revealed."""
    first = next(iter(drawn.values()))
    return MismatchReport(
        finding=finding,
        pack=choice.file.pack.name,
        layout=f"{first.use.series}S{first.use.parallel}P",
        physics=first.use.effect_ids,
        recordings=recorded,
        adopted=adopted.name if adopted else "",
        doubts=doubts_of(drawn),
        version=version(),
    )


def doubts_of(drawn: Mapping[str, Drawn]) -> tuple[str, ...]:
    """Each with the name of its recording; what is doubtful of all of them once, without."""
    texts = dict.fromkeys(text for d in drawn.values() for text in d.doubts)
    out: list[str] = []
    for text in texts:
        whose = [name for name, d in drawn.items() if text in d.doubts]
        of_all = len(whose) == len(drawn) > 1
        out += [text] if of_all else [f"{name}: {text}" for name in whose]
    return tuple(out)
