"""`twin replay`: one load or a sweep, written as tables and a drawing."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from analyze.checks import WrongUse, checked_pack, make_writable
from analyze.columns import as_csv, as_parquet
from analyze.interrupt import asked_to_stop
from analyze.pack_choice import PackChoice
from analyze.workbench.cases import (
    HEADER,
    Answer,
    Case,
    answers,
    load_cases,
    rate_cases,
    sample_columns,
    summary_columns,
    summary_rows,
)
from analyze.workbench.drawn import Ask, beyond, pack_alone, pack_lines, read_drawn, refusing
from analyze.workbench.listing import print_table
from analyze.workbench.plots import replay_svg
from analyze.workbench.watch import watching
from twin.whole_file import write_whole

OF_A_LOAD = frozenset({"source", "scale", "between", "sensor", "battery"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Request(Ask):
    """The command line; an empty sweep is None, and `given` are the names that stand on it."""

    ambient_c: tuple[float, ...] | None = None
    c_rate: tuple[float, ...] | None = None
    scale: tuple[float, ...] | None = None
    given: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if self.c_rate and self.given & OF_A_LOAD:
            raise WrongUse(
                "--c-rate draws constant currents: it takes no load and no --scale, --between, "
                "--sensor or --battery"
            )
        if not self.c_rate and not self.source:
            raise WrongUse("nothing to draw: name a log or a LOAD.csv, or give --c-rate")


def run(request: Request) -> int:
    """Simulate, write and tell; the exit code."""
    choice = checked_pack(request.pack)
    with refusing():
        cases = _cases(request, choice)
    make_writable(request.out)
    done: list[Answer] = []
    with asked_to_stop("case") as stop, watching(len(cases), "cases") as tell:
        for answer in answers(cases):
            done.append(answer)
            tell(len(done), answer.case.name)
            if stop():
                break
    with refusing():
        _write(request.out, done)
    _tell(request.out, done)
    if len(done) < len(cases):
        click.echo(f"Interrupted: {len(done)} of {len(cases)} cases are done.", err=True)
        return 130
    return 0 if all(a.complete for a in done) else 1


def _cases(request: Request, choice: PackChoice) -> tuple[Case, ...]:
    ambient_C = request.ambient_c or ()
    if request.c_rate:
        pack, use, doubts = pack_alone(choice)
        cases = rate_cases(pack, use.ambient_K, ambient_C, request.c_rate)
    else:
        drawn = read_drawn(request, choice)
        use, doubts = drawn.use, drawn.doubts
        cases = load_cases(drawn, ambient_C, request.scale or ())
    click.echo(pack_lines(use))
    for text in (*doubts, *beyond(choice, ((case.pack, case.load) for case in cases))):
        click.echo(f"doubtful {text}", err=True)
    return cases


def _write(out: Path, done: Sequence[Answer]) -> None:
    samples = sample_columns(done)
    write_whole(out / "replay.csv", as_csv(samples))
    write_whole(out / "replay.parquet", as_parquet(samples))
    write_whole(out / "summary.csv", as_csv(summary_columns(done)))
    write_whole(out / "replay.svg", replay_svg(done))


def _tell(out: Path, done: Sequence[Answer]) -> None:
    print_table(HEADER, summary_rows(done))
    early = [a for a in done if not a.complete]
    for status in dict.fromkeys(a.replay.solution.status for a in early):
        names = "; ".join(a.case.name for a in early if a.replay.solution.status is status)
        click.echo(f"{names}: {status.value}.")
    where = click.format_filename(out)
    click.echo(f"written to {where}: replay.csv, replay.parquet, summary.csv, replay.svg")
