"""`twin calibrate`: reference tests to a calibrated pack file."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import click

from analyze.checks import WrongUse, checked_pack, make_writable
from analyze.interrupt import asked_to_stop
from analyze.names import printable
from analyze.workbench.drawn import pack_alone, pack_lines, refusing
from analyze.workbench.listing import print_table
from analyze.workbench.search_file import going_on, read_journal
from analyze.workbench.watch import watching
from reports.quantity import MISSING
from twin.calibrate.answer import Estimate
from twin.calibrate.objective import Problem
from twin.calibrate.out import cell_text, fit_text, pack_text
from twin.calibrate.polish import MOST_STEPS
from twin.calibrate.reference import ReferenceTest, reference_test
from twin.calibrate.run import SEARCH, Calibration, Progress, conclude, fit, problem_of
from twin.calibrate.search import Journal, SearchError
from twin.calibrate.table import CalibrationError, read_test
from twin.load import Between
from twin.pack import Pack
from twin.whole_file import write_whole

SHOWN_ADVICE = 3
LEAST_SQUARES = MOST_STEPS, "steps"


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """The command line; `out` is the pack file to write."""

    tests: tuple[Path, ...]
    pack: Path
    out: Path
    between: str
    resume: bool
    seed: int
    evaluations: int

    def __post_init__(self) -> None:
        if self.out.suffix != ".toml":
            raise WrongUse(f"--out {click.format_filename(self.out)}: expected a name in .toml")

    @property
    def cell_file(self) -> Path:
        """The calibrated cell, beside the pack file."""
        return self.out.with_suffix(".bpx.json")

    @property
    def fit_file(self) -> Path:
        """The fit, beside the pack file."""
        return self.out.with_suffix(".fit.json")

    @property
    def search_file(self) -> Path:
        """What the search has evaluated, beside the pack file."""
        return self.out.with_suffix(".search.json")


def run(request: Request) -> int:
    """Fit, write and tell; the exit code."""
    choice = checked_pack(request.pack)
    with _refusing():
        pack, use, doubts = pack_alone(choice)
        tests = [_read(path, pack, request.between, use.ambient_K) for path in request.tests]
        problem = problem_of(pack, tests)
    make_writable(request.out.parent)
    start, journal = _earlier(request)
    click.echo(pack_lines(use))
    for text in doubts:
        click.echo(f"doubtful {text}", err=True)
    best, interrupted = _fitted(request, problem, start, journal)
    found = conclude(best.problem, best.q, tests, cross_validate=not interrupted)
    with _refusing():
        write_whole(request.cell_file, cell_text(found))
        text = pack_text(found, pack, choice.file, cell=request.cell_file.name)
        write_whole(request.out, text)
        write_whole(request.fit_file, fit_text(found))
        _keep(request.search_file, journal)
    return _tell(request, found, interrupted=interrupted)


@contextmanager
def _refusing() -> Iterator[None]:
    try:
        with refusing():
            yield
    except CalibrationError as e:
        raise WrongUse(str(e)) from e


def _read(path: Path, pack: Pack, between: str, ambient_K: float) -> ReferenceTest:
    name = printable(path.stem)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            table = read_test(stream, name=name)
    except UnicodeDecodeError as e:
        raise CalibrationError(f"{name}: no CSV: {e}") from e
    return reference_test(table, pack, between=Between(between), ambient_K=ambient_K)


def _earlier(request: Request) -> tuple[Mapping[str, float] | None, Journal]:
    """The values of the fit that is gone on from, and its search."""
    if not request.resume:
        return None, Journal()
    shown = click.format_filename(request.fit_file)
    try:
        values = json.loads(request.fit_file.read_text(encoding="utf-8"))["values"]
        start = {str(name): float(value) for name, value in values.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as e:
        raise WrongUse(f"--resume: {shown} holds no earlier fit: {e}") from e
    with _refusing_search(request):
        return start, read_journal(request.search_file)


def _fitted(
    request: Request, problem: Problem, start: Mapping[str, float] | None, journal: Journal
) -> tuple[Progress, bool]:
    """The best, and whether a person stopped it there."""
    search = going_on(journal) if request.evaluations else None
    steps = fit(
        problem, start=start, search=search, evaluations=request.evaluations, seed=request.seed
    )
    best = None
    with asked_to_stop("step") as stop, _refusing_search(request):
        for stage, part in groupby(steps, key=lambda p: p.stage):
            total = (request.evaluations, "evaluations") if stage == SEARCH else LEAST_SQUARES
            with watching(*total) as tell:
                for done, best in enumerate(part, start=1):
                    tell(best.evaluations or done, _said(best))
                    if stop():
                        return best, True
            assert best is not None
            after = f", {best.evaluations} evaluations" if best.evaluations else ""
            click.echo(f"fitted   {best.stage}{after}: {_error(best)}")
    assert best is not None  # the first comes before anything can stop it
    return best, False


def _said(best: Progress) -> str:
    by = f", {best.algorithm}" if best.algorithm else ""
    return f"{best.stage}{by}: {_error(best)}"


def _error(best: Progress) -> str:
    return f"{1e3 * best.rms_V:.2f} mV a cell"


@contextmanager
def _refusing_search(request: Request) -> Iterator[None]:
    try:
        yield
    except SearchError as e:
        if not request.resume:
            raise
        shown = click.format_filename(request.search_file)
        raise WrongUse(f"--resume: {shown}: {e}; remove it to search anew from the fit") from e


def _keep(file: Path, journal: Journal) -> None:
    """The journal beside the fit it belongs to; none where nothing was searched."""
    if len(journal):
        write_whole(file, journal.to_json())
    else:
        file.unlink(missing_ok=True)


HEADER = ("parameter", "value", "std", "90 % from", "to", "unit", "of the prior's std", "")


def _rows(estimates: Sequence[Estimate]) -> list[tuple[str, ...]]:
    return [
        (
            e.name,
            f"{e.value:.5g}",
            f"{e.std:.2g}",
            f"{e.lower:.4g}",
            f"{e.upper:.4g}",
            e.unit or "1",
            f"{e.left_of_prior:.0%}",
            e.verdict.value,
        )
        for e in estimates
    ]


def _tell(request: Request, found: Calibration, *, interrupted: bool) -> int:
    """What came of it; the exit code."""
    print_table(HEADER, _rows((*found.answer.estimates, *found.answer.derived)))
    rows = [
        (
            f.name,
            f"{1e3 * f.rms_V:.2f}",
            MISSING if f.held_out_rms_V is None else f"{1e3 * f.held_out_rms_V:.2f}",
            f"{1e3 * f.noise_V:.2f}",
        )
        for f in found.fitted
    ]
    print_table(("rms per cell, mV", "fitted", "predicted from the others", "noise"), rows)
    for text in found.remarks:
        click.echo(f"note     {text}")
    for advice in found.advice[:SHOWN_ADVICE]:
        helped = "; ".join(f"{name} to {left:.0%}" for name, left in advice.helps)
        click.echo(
            f"further  {advice.name}: {advice.gain:.1f} nats"
            + (f" (standard errors: {helped})" if helped else "")
        )
    files = request.out, request.cell_file, request.fit_file, request.search_file
    names = ", ".join(click.format_filename(p) for p in files if p.exists())
    click.echo(f"written  {names}")
    if interrupted:
        click.echo("Interrupted: the best so far. --resume goes on from it.", err=True)
        return 130
    return 0
