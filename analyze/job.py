"""One log to be analysed, what came of it, and the function that turns the one into the other.

All of it can be pickled: a job runs in this process or on a worker.
"""

import hashlib
import re
import threading
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path

from analyze.names import printable
from analyze.output import kept_result, write_flight
from analyze.pack_choice import PackChoice
from analyze.pipeline import Inputs, analyse
from analyze.version import OF_A_REPORT, code_sha256
from flightlogs.errors import LogError, Refusal
from reports.fleet import Failure
from reports.result import Result

REPORT_IT = "This is a fault of the program, not of the log: please report it with the log."


ONE_AT_A_TIME = threading.Lock()
"""Of a process: CasADi and the warning filters are not thread-safe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What is to be done with one log.

    Attributes:
        log: path of the log.
        shown: the path as the user would write it, safe to print.
        folder: where the results go.
        sensor: recording of the current sensor, or None.
        sensor_named: it was asked for; one that was only found may turn out to be unreadable.
        pack: the pack file, or None.
        battery: instance of the battery, None for the one that carries the flight.
        force: analyse again what is up to date.
        thorough: judge the damage in full.
        serial: of the pack, where neither log nor pack file has one.
    """

    log: Path
    shown: str
    folder: Path
    sensor: Path | None = None
    sensor_named: bool = False
    pack: PackChoice | None = None
    battery: int | None = None
    force: bool = False
    thorough: bool = False
    serial: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """An analysed log.

    Attributes:
        job: what was asked.
        result: the numbers.
        kept: True if an earlier result was up to date.
        remarks: warnings of the program itself, for `-v`.
    """

    job: Job
    result: Result
    kept: bool
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Failed:
    """A log that was not analysed; `details` is a traceback if the program is at fault."""

    job: Job
    failure: Failure
    details: str = ""


Outcome = Done | Failed


def run(job: Job) -> Outcome:
    """Analyse one log and write its results; what goes wrong costs this log only.

    Workers of several threads do one job after the other.
    """
    try:
        with ONE_AT_A_TIME, warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result, kept = _run(job)
        remarks = tuple(f"{w.category.__name__}: {w.message}" for w in caught)
        return Done(job=job, result=result, kept=kept, remarks=remarks)
    except Refusal as e:
        return _failed(job, e.code, str(e))
    except (LogError, OSError) as e:
        return _failed(job, _snake_case(type(e).__name__), str(e))
    except Exception as e:
        text = f"{type(e).__name__}: {e}. {REPORT_IT}"
        return _failed(job, "unexpected", text, details=traceback.format_exc())


def _run(job: Job) -> tuple[Result, bool]:
    inputs = _inputs(job)
    if not job.force and (kept := kept_result(job.folder, inputs.sha256)):
        return kept, True
    report = analyse(inputs, clock=time.perf_counter)
    return write_flight(job.folder, report), False


def _inputs(job: Job) -> Inputs:
    sensor_sha256 = _sensor_sha256(job)
    log_sha256 = sha256_of(job.log)
    pack_sha256 = job.pack.sha256 if job.pack else ""
    options = f"{job.battery} {job.thorough} {job.sensor is not None} {job.serial}"
    everything = (log_sha256, sensor_sha256, pack_sha256, options, code_sha256(*OF_A_REPORT))
    return Inputs(
        log=job.log,
        log_sha256=log_sha256,
        sensor=job.sensor,
        sensor_sha256=sensor_sha256,
        pack=job.pack,
        battery=job.battery,
        sha256=hashlib.sha256("\0".join(everything).encode()).hexdigest(),
        thorough=job.thorough,
        serial=job.serial,
    )


def _sensor_sha256(job: Job) -> str:
    """Nothing if there is none, or if one that was not asked for cannot be read: why is told."""
    try:
        return sha256_of(job.sensor) if job.sensor else ""
    except OSError:
        if job.sensor_named:
            raise
        return ""


def sha256_of(path: Path) -> str:
    """Of the file's content, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _failed(job: Job, code: str, reason: str, details: str = "") -> Failed:
    reason = reason.removeprefix(f"{printable(job.log.name)}: ")  # the path is said before it
    return Failed(
        job=job, failure=Failure(file=job.shown, code=code, reason=reason), details=details
    )


def _snake_case(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()
