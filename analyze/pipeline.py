"""One flight from its files to a finished `FlightReport`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from analyze.assessing import damage_of
from analyze.conceal import Channel, without
from analyze.fitting import doubts_of_fit, fitted
from analyze.mismatching import mismatch_of
from analyze.names import printable
from analyze.pack_choice import DEFAULT_CELL, PackChoice, beyond_tests, cell_of
from analyze.replaying import gaps_of, load_of, replay
from analyze.start import pack_of, pack_use
from analyze.version import version
from flightlogs.align import AlignedSensor, AlignmentRefused, align
from flightlogs.assemble import AH_C, MOST_DRAWN, assemble
from flightlogs.errors import LogError, LogWarning, Refusal
from flightlogs.holes import measured_charge_C
from flightlogs.log import FlightLog
from flightlogs.read import read_log
from flightlogs.recording import Recording
from flightlogs.sensor import read_sensor
from reports.flight import FlightReport, PackUse, Provenance
from segment import cut, periodic_profiles
from twin.cell import Cell
from twin.damage import ageing
from twin.kernel import Backend
from twin.pack import Pack, PackError
from twin.pack_file import effects_of
from twin.pack_model import begin
from twin.replay import Replay


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A log, and how it is to be read.

    Attributes:
        log: the file.
        sensor: recording of a separate current sensor.
        pack: the pack file.
        battery: which one of the log.
        concealed: channels that are taken as not measured.
    """

    log: Path
    sensor: Path | None
    pack: PackChoice | None
    battery: int | None
    concealed: frozenset[Channel] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs(Source):
    """The files and options of one analysis; `sha256` is of all of them and the version."""

    log_sha256: str
    sensor_sha256: str
    sha256: str
    thorough: bool = False
    serial: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """What became of the sensor's recording: aligned, or why not, and what is doubtful in it."""

    aligned: AlignedSensor | None = None
    refusal: str = ""
    warnings: tuple[LogWarning, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """What a log holds of one battery, and the pack that stands for it.

    Attributes:
        log: as it was read.
        recording: of the battery, with all that is doubtful among its warnings.
        alignment_refusal: why the sensor was not used, or "".
        use: the pack, and how each of its numbers is known.
        cell: its cells.
    """

    log: FlightLog
    recording: Recording
    alignment_refusal: str
    use: PackUse
    cell: Cell


def read_flight(source: Source) -> Flight:
    """Read and align, and say which pack it was.

    Raises:
        LogError: the log cannot be read, or (`Refusal`) its flight cannot be analysed.
        OSError: the log cannot be opened.
    """
    with source.log.open("rb") as stream:
        log = read_log(stream, name=printable(source.log.name))
    sensor = _sensor(source, log)
    recording = without(_recording(source, log, sensor), source.concealed)
    reference = source.pack.cell if source.pack else DEFAULT_CELL
    cell, remarks = cell_of(reference)
    use = pack_use(
        recording,
        source.pack.file if source.pack else None,
        cell,
        builtin=isinstance(reference, str),
    )
    try:
        pack = pack_of(use, cell)
    except PackError as e:
        raise Refusal("pack_cannot_start", f"{printable(source.log.name)}: {e}") from e
    doubts = (
        *_still_doubtful(recording, source.pack),
        *(_too_small(recording, use) if source.pack else ()),
        *_doubts(recording, use, sensor, remarks),
        *beyond_tests(source.pack, load_of(recording, use), pack),
    )
    return Flight(
        log=log,
        recording=replace(recording, warnings=doubts),
        alignment_refusal=sensor.refusal,
        use=use,
        cell=cell,
    )


def analyse(inputs: Inputs, *, clock: Callable[[], float]) -> FlightReport:
    """Read, align, cut, replay, compare, judge the damage; without a pack file a fit comes first.

    Args:
        inputs: files and options.
        clock: seconds that pass, for the report's own duration.

    Raises:
        LogError: the log cannot be read, or (`Refusal`) its flight cannot be analysed.
        OSError: the log cannot be opened.
    """
    began = clock()
    _compile_ahead(inputs.pack)
    flight = read_flight(inputs)
    segments = cut(flight.recording)
    use = replace(flight.use, serial=flight.use.serial or inputs.serial)
    played = replay(flight.recording, use, flight.cell)
    if inputs.pack is None:
        use, played = fitted(flight.recording, use, flight.cell, played)
    pack = pack_of(use, flight.cell)
    mismatch = mismatch_of(flight.recording, segments, use, pack, played, choice=inputs.pack)
    profiles = periodic_profiles(flight.recording, segments)
    damage, no_damage = damage_of(
        flight.recording,
        segments,
        profiles,
        (pack, played.load),
        thorough=inputs.thorough,
        pack=inputs.pack,
    )
    said = (*flight.recording.warnings, *doubts_of_fit(flight.recording, use))
    return FlightReport(
        log=flight.log,
        recording=replace(flight.recording, warnings=said),
        segments=segments,
        profiles=profiles,
        alignment_refusal=flight.alignment_refusal,
        gaps=gaps_of(flight.recording),
        pack=use,
        replay=played,
        provenance=_provenance(inputs, played, clock() - began),
        damage=damage,
        no_damage=no_damage,
        mismatch=mismatch,
    )


def _compile_ahead(choice: PackChoice | None) -> None:
    """Both kernels, side by side, while the log is read: that of the pack, and as it ages."""
    file = choice.file if choice else None
    cell, _ = cell_of(choice.cell if choice else DEFAULT_CELL)
    pack = Pack(cell=cell, effects=effects_of(file))
    for one in (pack, ageing(pack)):
        begin(one, None, Backend.AUTO)


def _sensor(source: Source, log: FlightLog) -> Sensor:
    """The sensor's recording on the log's clock; a refusal leaves the autopilot's current."""
    if source.sensor is None:
        return Sensor()
    warnings: tuple[LogWarning, ...] = ()
    try:
        with source.sensor.open("rb") as stream:
            recorded = read_sensor(stream, name=printable(source.sensor.name))
        warnings = recorded.warnings
        aligned = align(recorded, log, battery=source.battery)
    except AlignmentRefused as e:
        return Sensor(refusal=f"{e} ({e.code})", warnings=warnings)
    except LogError as e:
        return Sensor(refusal=str(e))
    except OSError as e:
        return Sensor(refusal=f"{printable(source.sensor.name)} cannot be read: {e.strerror or e}")
    return Sensor(aligned=aligned, warnings=warnings)


def _recording(source: Source, log: FlightLog, sensor: Sensor) -> Recording:
    """As `assemble` gives it; a refusal also says why the sensor could not help."""
    try:
        return assemble(log, battery=source.battery, sensor=sensor.aligned)
    except Refusal as e:
        if not sensor.refusal:
            raise
        text = f"{e}. The sensor's recording was not used: {sensor.refusal}"
        raise Refusal(e.code, text) from e


def _still_doubtful(recording: Recording, pack: PackChoice | None) -> tuple[LogWarning, ...]:
    """What is doubtful in the log, but for what it lacks and the pack file states."""
    if pack is None:
        return recording.warnings
    stated = {"cell_count_inferred"}
    if pack.file.pack.capacity_ah is not None:
        stated |= {"capacity_unknown", "capacity_doubtful"}
    return tuple(w for w in recording.warnings if w.code not in stated)


def _too_small(recording: Recording, use: PackUse) -> tuple[LogWarning, ...]:
    """The pack of a pack file for what was drawn from it."""
    drawn_C = measured_charge_C(recording.time_s, recording.current_A)
    if drawn_C <= MOST_DRAWN * use.capacity_C:
        return ()
    text = (
        f"{drawn_C / AH_C:.3g} Ah were drawn, and by the pack file the pack holds "
        f"{use.capacity_C / AH_C:.3g} Ah: check capacity_ah and parallel in it (or the current is "
        "logged too large)"
    )
    return (LogWarning("capacity_doubtful", text, recording.battery),)


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
