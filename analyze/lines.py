"""What the terminal says, one line at a time."""

import click

from analyze.find import Found
from analyze.job import Done
from reports.fleet import Failure
from reports.quantity import fixed, minutes
from reports.result import Result

INDENT = "\n    "


def done_line(done: Done) -> str:
    """One flight, and where its page is."""
    result, page = done.result, click.format_filename(done.job.folder / "report.html")
    verb = "kept    " if done.kept else "analysed"
    return (
        f"{verb}  {done.job.shown}: {minutes(result.flight.in_air_s)} min in flight"
        f"{_motions(result)}; {_replay(result)}{_warnings(result)}{INDENT}{page}"
    )


def failed_line(failure: Failure) -> str:
    """One log that was not analysed, and why."""
    return f"failed    {failure.file}: {failure.reason} ({failure.code})"


def closing_line(done: int, kept: int, failed: int, found: Found) -> str:
    """The sum of it."""
    parts = [f"{done} analysed"]
    if kept:
        parts.append(f"{kept} up to date and kept (--force analyses again)")
    if failed:
        parts.append(f"{failed} failed")
    if found.passed_over:
        parts.append(f"{len(found.passed_over)} passed over (no logs)")
    if found.linked:
        parts.append(f"linked folders not searched: {len(found.linked)} (name them to search them)")
    return ", ".join(parts) + "."


def _motions(result: Result) -> str:
    named = {
        "hover": result.motions.hover,
        "vertical": result.motions.vertical,
        "horizontal": result.motions.horizontal,
    }
    parts = [f"{name} {fixed(part.time_s, 0)} s" for name, part in named.items() if part]
    return f" ({', '.join(parts)})" if parts else ""


def _replay(result: Result) -> str:
    replay = result.replay
    early = "" if replay.status == "done" else f"ended early ({replay.status})"
    if replay.voltage_rmse_mv is not None:
        error = f"replay error {fixed(replay.voltage_rmse_mv, 1)} mV RMS"
        return f"{error}, {early}" if early else error
    return f"replay {early}, before any voltage" if early else "no voltage to compare with"


def _warnings(result: Result) -> str:
    codes = sorted({w.code for w in result.quality.warnings})
    return f"; doubts: {', '.join(codes)}" if codes else ""
