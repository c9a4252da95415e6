"""One call of the command: find, run, tell, sum up."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import click

from analyze.alone import alone
from analyze.checks import WrongUse, check_sensor, checked_pack, is_log, writable
from analyze.find import Found, find, sensor_beside
from analyze.fleet import outcomes
from analyze.interrupt import Asked, remembered
from analyze.job import Done, Job, Outcome, sha256_of
from analyze.lines import closing_line, done_line, failed_line
from analyze.names import free_name, printable
from analyze.output import earlier_in, is_foreign, log_of, write_fleet
from analyze.pack_choice import PackChoice
from analyze.pack_folders import pack_folders
from analyze.progress import progress
from analyze.version import version
from reports.fleet import Failure, Fleet, earlier_results
from reports.fleet_flights import FleetFlight


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """The command line."""

    paths: tuple[Path, ...]
    pack: Path | None
    sensor: Path | None
    out: Path
    jobs: int
    scheduler: str | None
    force: bool
    battery: int | None
    thorough: bool
    pack_per_folder: bool
    quiet: bool
    verbose: bool


@dataclass(slots=True)
class Tally:
    """What came of the jobs so far."""

    done: list[Done] = field(default_factory=list)
    failed: list[Failure] = field(default_factory=list)

    @property
    def kept(self) -> int:
        """How many were up to date."""
        return sum(d.kept for d in self.done)


def run_session(options: Options) -> int:
    """Do all of it; the exit code: 0 all analysed, 1 some failed, 130 interrupted.

    It is 1, too, where the files of the fleet could not be written.
    """
    pack = checked_pack(options.pack) if options.pack else None
    found = _found(options)
    with writable(options.out), alone(options.out):
        return _done(options, pack, found)


def _done(options: Options, pack: PackChoice | None, found: Found) -> int:
    tally = Tally()
    of_folder = len(found.logs) > 1 or any(p.is_dir() for p in options.paths)
    try:
        for path, reason in found.unreadable:
            _note_failure(_unreadable(path, reason), tally)
        jobs = _jobs(found.logs, pack, options, tally)
        with remembered() as interrupted:
            _run(jobs, tally, options, interrupted)
    except KeyboardInterrupt:
        said = f"{_sum(tally, found)} What is written is whole."
        going_on = _going_on(options, of_folder=of_folder)
        click.echo(f"Interrupted: {said} {going_on}", err=True)
        return 130
    fleet = _fleet(tally, found, options.out)
    written = not of_folder or _fleet_written(options.out, fleet)
    if not options.quiet:
        click.echo(_sum(tally, found))
        if of_folder and written:
            click.echo(f"All of them on one page: {click.format_filename(options.out)}/index.html")
            click.echo(earlier_results(fleet.earlier), nl=bool(fleet.earlier))
    return 0 if written and not tally.failed else 1


def _going_on(options: Options, *, of_folder: bool) -> str:
    without = " without --force" if options.force else ""
    page = "index.html was not written. " if of_folder else ""
    return f"{page}The same command{without} goes on from there."


def _found(options: Options) -> Found:
    found = find(options.paths, besides=options.out, is_log=is_log)
    for path in found.passed_over if options.verbose else ():
        click.echo(f"    passed over (no log)  {click.format_filename(path)}", err=True)
    for path in found.linked if options.verbose else ():
        click.echo(f"    not searched (a link)  {click.format_filename(path)}", err=True)
    if not found.logs and not found.unreadable:
        where = ", ".join(click.format_filename(p) for p in options.paths)
        linked = f", linked folders not searched: {len(found.linked)}" if found.linked else ""
        looked = f"{len(found.passed_over)} files looked at{linked}"
        raise WrongUse(f"no flight log in {where} ({looked})")
    if options.sensor and len(found.logs) > 1:
        raise WrongUse(f"--sensor belongs to one log, but {len(found.logs)} are to be analysed")
    if options.sensor:
        check_sensor(options.sensor)
    return found


def _jobs(
    logs: Sequence[Path], pack: PackChoice | None, options: Options, tally: Tally
) -> tuple[Job, ...]:
    """A job for each log that can be opened, with a folder of its own."""
    used: set[str] = set()
    jobs = []
    serials = _serials(logs, options)
    for log in logs:
        try:
            digest = sha256_of(log)
        except OSError as e:
            _note_failure(_unreadable(log, e.strerror or str(e)), tally)
            continue
        sensor = options.sensor or sensor_beside(log)
        name = free_name(printable(log.stem), digest, _taken(options.out, digest, used))
        used.add(name.casefold())
        jobs.append(
            Job(
                log=log.absolute(),
                shown=click.format_filename(log),
                folder=options.out.absolute() / name,
                sensor=sensor.absolute() if sensor else None,
                sensor_named=options.sensor is not None,
                pack=pack,
                battery=options.battery,
                force=options.force,
                thorough=options.thorough,
                serial=serials.get(log, ""),
            )
        )
    return tuple(jobs)


def _serials(logs: Sequence[Path], options: Options) -> Mapping[Path, str]:
    """By the folders that the logs lie in, if that is asked for."""
    if not options.pack_per_folder:
        return {}
    packs = pack_folders(logs, options.paths)
    if packs.loose:
        names = ", ".join(sorted({f"'{packs.names[log]}'" for log in packs.loose}))
        click.echo(
            f"--pack-per-folder: {len(packs.loose)} of the logs lie in no folder below PATH: taken "
            f"for flights of one pack, {names}. If they are of several, give each its folder.",
            err=True,
        )
    return packs.names


def _taken(out: Path, digest: str, used: set[str]) -> Callable[[str], bool]:
    """Whether a folder name belongs to another log, of this run or an earlier one, or to the user.

    A folder in which a run was interrupted belongs to the log of that name.
    """

    def taken(name: str) -> bool:
        if name.casefold() in used or is_foreign(out / name):
            return True
        return log_of(out / name) not in (None, digest)

    return taken


def _run(jobs: Sequence[Job], tally: Tally, options: Options, interrupted: Asked) -> None:
    """All jobs; KeyboardInterrupt at Ctrl-C, at the latest after the job that lost it.

    A job that lost it may have failed of that: such a failure says nothing of the log.
    """
    running = outcomes(jobs, workers=options.jobs, scheduler=options.scheduler)
    with closing(running), progress(len(jobs), wanted=not options.quiet) as step:
        for outcome in running:
            if isinstance(outcome, Done) or not interrupted():
                with step():
                    _note(outcome, tally, options)
            if interrupted():
                raise KeyboardInterrupt


def _note(outcome: Outcome, tally: Tally, options: Options) -> None:
    """Count it and say it; what failed is said even if nothing else is."""
    if isinstance(outcome, Done):
        tally.done.append(outcome)
        if not options.quiet:
            click.echo(done_line(outcome))
        more: Sequence[str] = outcome.remarks
    else:
        _note_failure(outcome.failure, tally)
        more = outcome.details.splitlines()
    if options.verbose:
        click.echo("".join(f"    {line}\n" for line in more), nl=False, err=True)


def _note_failure(failure: Failure, tally: Tally) -> None:
    tally.failed.append(failure)
    click.echo(failed_line(failure), err=True)


def _unreadable(path: Path, reason: str) -> Failure:
    return Failure(file=click.format_filename(path), code="unreadable", reason=reason)


def _sum(tally: Tally, found: Found) -> str:
    analysed = len(tally.done) - tally.kept
    return closing_line(analysed, tally.kept, len(tally.failed), found)


def _fleet_written(out: Path, fleet: Fleet) -> bool:
    """Whether the files of the fleet could be written; if not, why is said."""
    try:
        write_fleet(out, fleet)
    except OSError as e:
        text = "index.html, fleet.parquet and failures.json could not all be written"
        click.echo(f"{click.format_filename(out)}: {text}: {e}", err=True)
        return False
    return True


def _fleet(tally: Tally, found: Found, out: Path) -> Fleet:
    return Fleet(
        flights=tuple(
            FleetFlight(folder=d.job.folder.name, log=d.job.shown, result=d.result)
            for d in tally.done
        ),
        failures=tuple(tally.failed),
        passed_over=len(found.passed_over),
        version=version(),
        linked=len(found.linked),
        earlier=earlier_in(out, besides={d.job.folder.name for d in tally.done}),
    )
