"""A finding in words, and the report of it."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from analyze.pack_choice import PackChoice
from analyze.version import version
from analyze.workbench.drawn import Drawn
from analyze.workbench.listing import print_table
from reports.mismatch import MismatchReport, Recorded, headline
from twin.mismatch import Finding, Value

SHOWN = 6
HEADER = ("left out", "probability", "held out, mV", "evidence lost")


def print_finding(finding: Finding) -> None:
    """The sentence, then the numbers."""
    errors = finding.errors
    click.echo(f"verdict  {finding.verdict.value}: {headline(finding)}")
    for e in finding.effects:
        click.echo(f"effect   {e.id} ({e.probability:.0%}): {_values(e.parameters)}")
        for other in e.equivalent:  # which these recordings cannot tell from it
            click.echo(f"or       {other}: {_values(e.instead[other])}")
    for t in finding.terms:
        click.echo(f"depends  on {t.quantity}: {1e3 * t.size_V:+.1f} mV per standard deviation")
    click.echo(
        f"error    {1e3 * errors.held_out_before:.1f} mV before, "
        f"{1e3 * errors.held_out_after:.1f} mV after on what was held out; "
        f"noise {1e3 * errors.noise:.1f} mV"
    )
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


def _values(values: Sequence[Value]) -> str:
    return ", ".join(f"{v.name} {v.shown:.4g} ± {v.std:.2g}" for v in values)


def report_of(
    choice: PackChoice, files: Mapping[str, Path], drawn: Mapping[str, Drawn], finding: Finding,
    adopted: Path | None,
) -> MismatchReport:  # fmt: skip
    """What the page is made of but for channels concealed and revealed."""
    first = next(iter(drawn.values()))
    return MismatchReport(
        finding=finding,
        pack=choice.file.pack.name,
        layout=f"{first.use.series}S{first.use.parallel}P",
        physics=first.use.effect_ids,
        recordings=tuple(
            Recorded(name=name, sha256=hashlib.sha256(path.read_bytes()).hexdigest())
            for name, path in files.items()
        ),
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
