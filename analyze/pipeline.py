"""One flight from its files to a finished `FlightReport`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from analyze.names import printable
from analyze.pack_choice import DEFAULT_CELL, PackChoice, cell_of
from analyze.replaying import gaps_of, replay
from analyze.start import pack_use
from analyze.version import version
from flightlogs.align import AlignedSensor, AlignmentRefused, align
from flightlogs.assemble import assemble
from flightlogs.errors import LogError, LogWarning, Refusal
from flightlogs.log import FlightLog
from flightlogs.read import read_log
from flightlogs.recording import Recording
from flightlogs.sensor import read_sensor
from reports.flight import FlightReport, PackUse, Provenance
from segment import cut, periodic_profiles
from twin.replay import Replay


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """The files and options of one analysis; `sha256` is of all of them and the version."""

    log: Path
    log_sha256: str
    sensor: Path | None
    sensor_sha256: str
    pack: PackChoice | None
    battery: int | None
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """What became of the sensor's recording: aligned, or why not, and what is doubtful in it."""

    aligned: AlignedSensor | None = None
    refusal: str = ""
    warnings: tuple[LogWarning, ...] = ()


def analyse(inputs: Inputs, *, clock: Callable[[], float]) -> FlightReport:
    """Read, align, cut, replay.

    Args:
        inputs: files and options.
        clock: seconds that pass, for the report's own duration.

    Raises:
        LogError: the log cannot be read, or (`Refusal`) its flight cannot be analysed.
        OSError: a file cannot be opened.
    """
    began = clock()
    with inputs.log.open("rb") as stream:
        log = read_log(stream, name=printable(inputs.log.name))
    sensor = _sensor(inputs, log)
    recording = _recording(inputs, log, sensor)
    segments = cut(recording)
    reference = inputs.pack.cell if inputs.pack else DEFAULT_CELL
    cell, remarks = cell_of(reference)
    use = pack_use(
        recording,
        inputs.pack.file if inputs.pack else None,
        cell,
        builtin=isinstance(reference, str),
    )
    doubts = (*recording.warnings, *_doubts(recording, use, sensor, remarks))
    played = replay(recording, use, cell)
    return FlightReport(
        log=log,
        recording=replace(recording, warnings=doubts),
        segments=segments,
        profiles=periodic_profiles(recording, segments),
        alignment_refusal=sensor.refusal,
        gaps=gaps_of(recording),
        pack=use,
        replay=played,
        provenance=_provenance(inputs, played, clock() - began),
    )


def _sensor(inputs: Inputs, log: FlightLog) -> Sensor:
    """The sensor's recording on the log's clock; a refusal leaves the autopilot's current."""
    if inputs.sensor is None:
        return Sensor()
    warnings: tuple[LogWarning, ...] = ()
    try:
        with inputs.sensor.open("rb") as stream:
            recorded = read_sensor(stream, name=printable(inputs.sensor.name))
        warnings = recorded.warnings
        aligned = align(recorded, log, battery=inputs.battery)
    except AlignmentRefused as e:
        return Sensor(refusal=f"{e} ({e.code})", warnings=warnings)
    except LogError as e:
        return Sensor(refusal=str(e))
    return Sensor(aligned=aligned, warnings=warnings)


def _recording(inputs: Inputs, log: FlightLog, sensor: Sensor) -> Recording:
    """As `assemble` gives it; a refusal also says why the sensor could not help."""
    try:
        return assemble(log, battery=inputs.battery, sensor=sensor.aligned)
    except Refusal as e:
        if not sensor.refusal:
            raise
        text = f"{e}. The sensor's recording was not used: {sensor.refusal}"
        raise Refusal(e.code, text) from e


def _doubts(
    recording: Recording, use: PackUse, sensor: Sensor, remarks: tuple[str, ...]
) -> tuple[LogWarning, ...]:
    """What is doubtful beyond the log itself."""
    out = [*sensor.warnings]
    out += [LogWarning(code="cell_parameters", message=text) for text in remarks]
    if use.series != recording.series:
        known = "inferred from the voltage" if recording.series_inferred else "as the log says"
        text = (
            f"The pack file has {use.series} cells in series, the log {recording.series} ({known})."
        )
        out.append(LogWarning(code="series_disagree", message=text))
    if sensor.refusal:
        text = f"The sensor's recording was not used: {sensor.refusal}"
        out.append(LogWarning(code="sensor_not_used", message=text))
    return tuple(out)


def _provenance(inputs: Inputs, played: Replay, seconds: float) -> Provenance:
    solution = played.solution
    return Provenance(
        sha256=inputs.log_sha256,
        sensor_name=printable(inputs.sensor.name) if inputs.sensor else "",
        sensor_sha256=inputs.sensor_sha256,
        pack_sha256=inputs.pack.sha256 if inputs.pack else "",
        inputs_sha256=inputs.sha256,
        version=version(),
        solver=(
            f"P2D, one implicit step a sample: {solution.steps} steps, "
            f"{solution.retried_steps} repeated in smaller ones; {solution.status.name.lower()}"
        ),
        seconds=seconds,
    )
