"""`twin explain`: recordings of a pack and its twin -> what was left out."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from analyze.checks import WrongUse, checked_pack, make_writable
from analyze.pack_choice import PackChoice
from analyze.workbench.drawn import Ask, Drawn, pack_lines, read_drawn, refusing
from analyze.workbench.listing import print_table
from analyze.workbench.watch import watching
from twin.mismatch import (
    Finding,
    Flight,
    MismatchError,
    adopted_text,
    explain,
    finding_json,
)
from twin.whole_file import write_whole

FILE = "mismatch.json"
SHOWN = 6
HEADER = ("left out", "probability", "held out, mV", "evidence lost")


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """The command line."""

    sources: tuple[Path, ...]
    holdout: tuple[Path, ...]
    pack: Path
    out: Path
    adopt: Path | None
    between: str
    battery: int | None

    def __post_init__(self) -> None:
        if self.adopt and self.adopt.suffix != ".toml":
            raise WrongUse(f"--adopt {click.format_filename(self.adopt)}: expected a name in .toml")


def run(request: Request) -> int:
    """Explain, write and tell; the exit code."""
    choice = checked_pack(request.pack)
    fitted = [_flight(path, request, choice) for path in request.sources]
    held_out = [_flight(path, request, choice) for path in request.holdout]
    make_writable(request.out)
    with watching(None, "models") as tell:
        looked_at = 0

        def progress(ids: Sequence[str]) -> None:
            nonlocal looked_at
            looked_at += 1
            tell(looked_at, " + ".join(ids))

        try:
            finding = explain(fitted, held_out, progress=progress)
        except MismatchError as e:
            raise WrongUse(str(e)) from e
    write_whole(request.out / FILE, json.dumps(finding_json(finding), indent=1) + "\n")
    _tell(finding, request.out)
    if request.adopt:
        _adopt(finding, request.adopt, choice)
    return 0


def _adopt(finding: Finding, path: Path, choice: PackChoice) -> None:
    """The pack file with what was named; its cell stays where it is."""
    cell = choice.cell
    named = cell if isinstance(cell, str) else os.path.relpath(cell, path.resolve().parent)
    try:
        text = adopted_text(finding, choice.file, cell=Path(named).as_posix())
    except MismatchError as e:
        raise WrongUse(str(e)) from e
    make_writable(path.resolve().parent)
    write_whole(path, text)
    click.echo(f"adopted  {click.format_filename(path)}")


def _flight(path: Path, request: Request, choice: PackChoice) -> Flight:
    ask = Ask(
        source=path, pack=request.pack, out=request.out, between=request.between, sensor=None,
        battery=request.battery,
    )  # fmt: skip
    with refusing():
        drawn = read_drawn(ask, choice)
    click.echo(f"{drawn.name}\n{pack_lines(drawn.use)}")
    for text in drawn.doubts:
        click.echo(f"doubtful {text}", err=True)
    return flight_of(drawn)


def flight_of(drawn: Drawn) -> Flight:
    """As the engine takes it; motions are not cut here."""
    return Flight(
        name=drawn.name,
        pack=drawn.pack,
        load=drawn.load,
        voltage_V=drawn.recorded_V,
        judged=drawn.judged,
        motion=np.full(drawn.load.time_s.size, ""),
    )


def _tell(finding: Finding, out: Path) -> None:
    errors = finding.errors
    click.echo(f"verdict  {finding.verdict.value}")
    for e in finding.effects:
        values = ", ".join(f"{v.name} {v.value:.4g} ± {v.std:.2g}" for v in e.parameters)
        alike = f"; these recordings cannot tell it from {', '.join(e.equivalent)}" * bool(
            e.equivalent
        )
        click.echo(f"effect   {e.id} ({e.probability:.0%}): {values}{alike}")
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
    if finding.advice:
        click.echo(f"further  {finding.advice}")
    click.echo(f"written  {click.format_filename(out / FILE)}")
