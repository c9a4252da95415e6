"""`twin calibrate`: reference tests to a calibrated pack file."""

import hashlib
import io
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import click

from analyze.checks import WrongUse, check_pack_name, checked_pack, is_log, writable
from analyze.interrupt import Asked, asked_to_stop
from analyze.names import printable
from analyze.workbench.aged import Life, run_life
from analyze.workbench.calibrated_files import (
    Files,
    Frame,
    in_the_way,
    keep_search,
    of_another,
    write_fit,
    write_page,
)
from analyze.workbench.calibrated_words import print_files, print_found, print_tests
from analyze.workbench.cells import tell_cells
from analyze.workbench.drawn import pack_alone, pack_lines, refusing
from analyze.workbench.search_file import going_on, read_journal
from analyze.workbench.watch import watching
from reports.calibration import SourceFile
from twin.ageing import Regime
from twin.calibrate.objective import Problem
from twin.calibrate.polish import MOST_STEPS
from twin.calibrate.reference import ReferenceTest, reference_test
from twin.calibrate.run import SEARCH, Calibration, Progress, conclusions, fit, problem_of
from twin.calibrate.search import Journal, SearchError
from twin.calibrate.table import read_test
from twin.calibrate.unlike import part
from twin.load import Between
from twin.mismatch.tested import by_calibration
from twin.pack import Pack

LEAST_SQUARES = MOST_STEPS, "steps"
SAVED_EVERY_S = 5.0  # the search, while it goes on
OF_TESTS = ("one_mount", "evaluations", "seed", "resume")
OF_LIFE = ("repeat", "rest_s", "charge_rate", "until_rate", "charge_to")


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """The command line; `out` is the pack file to write, `given` the names that stand on it."""

    tests: tuple[Path, ...]
    pack: Path
    out: Path
    between: str
    one_mount: bool
    resume: bool
    seed: int
    evaluations: int
    aged: Path | None
    cycle: Path | None
    repeat: bool
    rest_s: float
    charge_rate: float
    until_rate: float
    charge_to: float | None
    given: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not self.tests and self.aged is None:
            raise WrongUse("nothing to calibrate from: give reference tests, or a life with --aged")
        if (self.aged is None) != (self.cycle is None):
            raise WrongUse("--aged and --cycle belong together: what was found, and what was flown")
        self._refuse_idle(OF_TESTS, "a TEST.csv", there=bool(self.tests))
        self._refuse_idle(OF_LIFE, "--aged", there=self.aged is not None)
        check_pack_name("--out", self.out, self.pack)

    def refuse_others(self) -> None:
        """WrongUse if what is there is not of an earlier calibration like this one."""
        shown = click.format_filename(self.out)
        try:
            self._refuse_others(shown)
        except OSError as e:
            raise WrongUse(f"--out {shown}: cannot be made: {e.strerror}") from e

    def _refuse_others(self, shown: str) -> None:
        if folder := in_the_way(self.files):
            raise WrongUse(f"{click.format_filename(folder)} is a folder: move it out of the way")
        if other := of_another(self.files):
            raise WrongUse(
                f"{click.format_filename(other)} is there and not from an earlier calibration "
                f"(there is no {self.files.fit.name} beside it), and --out {shown} would replace "
                "it: give another name"
            )
        if not self.tests and self.files.fit.exists():
            raise WrongUse(
                f"--out {shown} has the fit of an earlier calibration beside it "
                f"({self.files.fit.name}), which a life alone does not replace: give another name"
            )

    @property
    def files(self) -> Files:
        """What is written."""
        return Files(self.out)

    def _refuse_idle(self, names: Sequence[str], what: str, *, there: bool) -> None:
        """WrongUse if one of these options is given and what it is for is not."""
        idle = [f"--{name.replace('_', '-')}" for name in names if name in self.given]
        if idle and not there:
            raise WrongUse(f"{', '.join(idle)}: nothing to do without {what}")


def run(request: Request) -> int:
    """Fit, write and tell; the exit code."""
    with writable(request.out.parent):
        request.refuse_others()
        return _fitted_to_all(request)


def _of_a_cycle(request: Request) -> str | None:
    """How the current of PROFILE.csv runs; of a log nothing is said, nor where nothing was."""
    if "between" not in request.given or request.cycle is None:
        return None
    if not is_log(request.cycle):
        return request.between
    if not request.tests:
        shown = click.format_filename(request.cycle)
        raise WrongUse(
            f"--between: {shown} is a flight log, which says itself how its current runs"
        )
    return None


def _fitted_to_all(request: Request) -> int:
    """To the tests, then to the life."""
    code = _of_tests(request) if request.tests else 0
    if request.aged is not None and code == 0:
        life = Life(
            check_ups=request.aged,
            cycle=request.cycle,
            pack=request.out if request.tests else request.pack,
            out=request.out,
            between=_of_a_cycle(request),
            regime=partial(
                Regime,
                repeat=request.repeat,
                rest_s=request.rest_s,
                charge_rate=request.charge_rate,
                until_rate=request.until_rate,
                full_V=request.charge_to,
            ),
        )
        with refusing():
            return run_life(life)
    return code


def _of_tests(request: Request) -> int:
    choice = checked_pack(request.pack)
    if isinstance(choice.cell, Path) and choice.cell.resolve() == request.files.cell.resolve():
        raise WrongUse(
            f"--out {click.format_filename(request.out)}: the calibrated cell would replace "
            f"{click.format_filename(choice.cell)}, which the pack file starts from: give another "
            "name"
        )
    with refusing():
        pack, use, doubts = pack_alone(choice)
        read = [_read(path, pack, request.between, use.ambient_K) for path in request.tests]
        _refuse_copies([file for _, file in read])
        mount = "one" if request.one_mount else ""
        tests = [replace(test, mount=mount) for test, _ in read]
        problem = problem_of(pack, tests)
    if request.one_mount and sum(map(problem.warming, range(len(tests)))) < 2:
        raise WrongUse(
            "--one-mount: nothing tells mounts apart: expected two tests or more with a column of "
            "temperatures, and self_heating in the physics of the pack file"
        )
    start, journal = _earlier(request)
    click.echo(pack_lines(use))
    for text in doubts:
        click.echo(f"doubtful {text}", err=True)
    print_tests(tests)
    files = tuple(file for _, file in read)
    frame = Frame(pack=pack, file=choice.file, tests=files, seed=request.seed, doubts=doubts)
    with asked_to_stop("step") as stop, refusing():
        best = _fitted(request, problem, start, journal, stop)
        whole = not stop()
        parted = part(best, tests, parallel=pack.parallel, soc=use.shown_soc) if whole else None
        if parted:
            best, tests = parted.best, list(parted.tests)
            frame = replace(frame, unlike=parted.unlike)
        found = _concluded(request, best, tests, frame, journal, stop)
        write_page(request.files, found, frame, journal)
    if parted:
        tell_cells(parted.unlike)
    print_found(found, tests)
    print_files(request.files)
    if whole and not found.missing:
        return 0
    click.echo("Interrupted: this is the best so far. --resume goes on from it.", err=True)
    return 130


def _read(
    path: Path, pack: Pack, between: str, ambient_K: float
) -> tuple[ReferenceTest, SourceFile]:
    name, content = printable(path.stem), path.read_bytes()
    text = io.TextIOWrapper(io.BytesIO(content), encoding="utf-8-sig", newline="")
    table = read_test(text, name=name)
    test = reference_test(table, pack, between=Between(between), ambient_K=ambient_K)
    return test, SourceFile(name=name, sha256=hashlib.sha256(content).hexdigest())


def _refuse_copies(files: Sequence[SourceFile]) -> None:
    """WrongUse if one test is there twice: each would be predicted by itself."""
    first: dict[str, str] = {}
    for file in files:
        if (other := first.setdefault(file.sha256, file.name)) != file.name:
            raise WrongUse(f"{file.name} is a copy of {other}: no test counts twice")


def _earlier(request: Request) -> tuple[Mapping[str, float] | None, Journal]:
    """The values of the fit that is gone on from, and its search.

    A run that ended before it had a fit may have left a search alone: then the least squares are
    made again, which gives the same, and the search is gone on with.
    """
    if not request.resume:
        return None, Journal()
    with _refusing_search(request):
        journal = read_journal(request.files.search)
    if len(journal) and not request.files.fit.exists():
        return None, journal
    shown = click.format_filename(request.files.fit)
    try:
        values = json.loads(request.files.fit.read_text(encoding="utf-8"))["values"]
        return {str(name): float(value) for name, value in values.items()}, journal
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as e:
        raise WrongUse(f"--resume: {shown} holds no earlier fit: {e}") from e


def _fitted(
    request: Request, problem: Problem, start: Mapping[str, float] | None, journal: Journal,
    stop: Asked,
) -> Progress:  # fmt: skip
    """The best, or the best so far if a person asked to stop; the search is saved as it goes."""
    search = going_on(journal) if request.evaluations else None
    steps = fit(
        problem, start=start, search=search, evaluations=request.evaluations, seed=request.seed
    )
    best, saved_s = None, time.monotonic()
    with _refusing_search(request), _watched(request.evaluations) as tell:
        for best in steps:
            tell(best)
            if best.stage == SEARCH and time.monotonic() - saved_s > SAVED_EVERY_S:
                keep_search(request.files, journal)
                saved_s = time.monotonic()
            if stop():
                break
    assert best is not None  # the first comes before anything can stop it
    return best


@contextmanager
def _watched(evaluations: int) -> Iterator[Callable[[Progress], None]]:
    """Yields what shows a fit as it goes: a bar for each stage, a line when it is over."""
    with ExitStack() as bars:
        tell = bars.enter_context(watching(*LEAST_SQUARES))
        tell(0, "windows and capacity")
        shown: list[Progress] = []  # of the stage at work

        def show(best: Progress) -> None:
            nonlocal tell
            if shown and best.stage != shown[-1].stage:
                bars.close()
                _say(shown[-1])
                shown.clear()
                total = (evaluations, "evaluations") if best.stage == SEARCH else LEAST_SQUARES
                tell = bars.enter_context(watching(*total))
            shown.append(best)
            by = f", {best.algorithm}" if best.algorithm else ""
            tell(best.evaluations or len(shown), f"{best.stage}{by}: {_error(best)}")

        yield show
        bars.close()
        if shown:
            _say(shown[-1])


def _say(best: Progress) -> None:
    after = f", {best.evaluations} evaluations" if best.evaluations else ""
    click.echo(f"fitted   {best.stage}{after}: {_error(best)}")


def _error(best: Progress) -> str:
    return f"{1e3 * best.rms_V:.2f} mV a cell, samples averaged"


def _concluded(  # noqa: PLR0913
    request: Request, best: Progress, tests: Sequence[ReferenceTest], frame: Frame,
    journal: Journal, stop: Asked,
) -> Calibration:  # fmt: skip
    """What the fit tells, as much as is waited for; what is known first is written at once."""
    steps = conclusions(best.problem, best.q, tests)
    total = 1 + len(tests)
    with watching(total, "results") as tell:
        tell(0, "standard errors")
        found = next(steps)
        write_fit(request.files, found, frame, journal)
        while found.missing and not stop():
            tell(total - len(found.missing), found.missing[0])
            found = next(steps)
        if not found.missing:
            tell(total, "what the tests say of effects")
            frame = replace(frame, standard_errors=by_calibration(found, tests))
    write_fit(request.files, found, frame, journal)
    return found


@contextmanager
def _refusing_search(request: Request) -> Iterator[None]:
    try:
        yield
    except SearchError as e:
        if not request.resume:
            raise
        shown = click.format_filename(request.files.search)
        raise WrongUse(f"--resume: {shown}: {e}; remove it to search anew from the fit") from e
