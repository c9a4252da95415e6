"""The files of a flight and of a fleet; each appears whole or not at all."""

import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import pyarrow as pa
from pydantic import ValidationError

from analyze.columns import as_parquet, replay_columns
from analyze.names import FLIGHT_FILES, PROFILES, RESULT
from reports.fleet import Fleet, fleet_page
from reports.fleet_flights import FleetFlight, charge_ah, left_out, names_of
from reports.flight import FlightReport
from reports.flight_page import flight_page
from reports.render import render
from reports.result import Result
from reports.results import result_of
from reports.tables import profile_csv, segments_csv
from segment.profile import PeriodicProfile
from twin.whole_file import PART, write_whole


def write_flight(folder: Path, report: FlightReport) -> Result:
    """Write all files of a flight into `folder`; the result comes last, for it vouches for all.

    OSError where that fails, e.g. on a full disk; a folder that is empty then does not stay.
    """
    files = flight_files(report)
    result = result_of(report, files)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        _write_all(folder, files, result)
    except OSError:
        with suppress(OSError):  # it is not empty
            folder.rmdir()
        raise
    return result


def _write_all(folder: Path, files: Mapping[str, str | bytes], result: Result) -> None:
    (folder / RESULT).unlink(missing_ok=True)
    for old in folder.glob(PROFILES):
        if old.name not in files:
            old.unlink()
    for name, content in files.items():
        write_whole(folder / name, content)
    write_whole(folder / RESULT, result.model_dump_json(indent=1) + "\n")


def flight_files(report: FlightReport) -> Mapping[str, str | bytes]:
    """Name -> content of all files but the result."""
    files: dict[str, str | bytes] = {
        "report.html": render(flight_page(report)),
        "segments.csv": segments_csv(report.segments),
        "replay.parquet": as_parquet(replay_columns(report.replay)),
    }
    for motion, profile in report.profiles.items():
        if isinstance(profile, PeriodicProfile):
            files[f"profile_{motion.value}.csv"] = profile_csv(profile)
    return files


def read_result(folder: Path) -> Result | None:
    """The result in `folder`; None if there is none, or none that this version can read."""
    try:
        return Result.model_validate_json((folder / RESULT).read_bytes())
    except (OSError, ValidationError):
        return None


def log_of(folder: Path) -> str | None:
    """Hash of the log whose result is in `folder`, also of one that another version wrote."""
    try:
        flight = json.loads((folder / RESULT).read_bytes())["flight"]
        return str(flight["sha256"])
    except (OSError, ValueError, LookupError, TypeError):
        return None


def earlier_in(out: Path, *, besides: Collection[str]) -> int:
    """How many results lie in folders of `out` beside those of that name; 0 if none can be seen."""
    try:
        return sum(log_of(p) is not None for p in out.iterdir() if p.name not in besides)
    except OSError:  # it may be written to and not be looked into
        return 0


def is_foreign(folder: Path) -> bool:
    """Whether there is something at `folder` and none of it is a file of a flight, whole or not.

    Where nothing can be, since the path is too long for one, there is nothing either.
    """
    try:
        names = [path.name for path in folder.iterdir()]
    except (NotADirectoryError, PermissionError):  # a file, or what may not be looked into
        return True
    except OSError:
        return False
    ours = (name in FLIGHT_FILES or name.endswith(PART) for name in names)
    return bool(names) and not any(ours)


def kept_result(folder: Path, inputs_sha256: str) -> Result | None:
    """The result in `folder` if it was made from the same inputs and all its files are there."""
    result = read_result(folder)
    if result is None or result.provenance.parameters.inputs_sha256 != inputs_sha256:
        return None
    files = result.provenance.files
    return result if files and all((folder / name).is_file() for name in files) else None


def write_fleet(out: Path, fleet: Fleet) -> None:
    """`index.html`, `fleet.parquet` and `failures.json`."""
    failures = [
        {"file": f.file, "code": f.code, "reason": f.reason}
        for f in sorted(fleet.failures, key=lambda f: f.file)
    ]
    write_whole(out / "failures.json", json.dumps(failures, indent=1, ensure_ascii=False) + "\n")
    flights = sorted(fleet.flights, key=lambda f: f.folder)
    rows = [
        {**_fleet_row(f), "file": called, "left_out": why or None}
        for f, called, why in zip(flights, names_of(flights), left_out(flights), strict=True)
    ]
    write_whole(out / "fleet.parquet", as_parquet(_fleet_columns(rows)))
    write_whole(out / "index.html", render(fleet_page(fleet)))


FLEET_SCHEMA = pa.schema(
    [
        ("folder", pa.string()),
        ("file", pa.string()),
        ("sha256", pa.string()),
        ("format", pa.string()),
        ("firmware", pa.string()),
        ("vehicle", pa.string()),
        ("start_utc", pa.timestamp("us", tz="UTC")),
        ("in_air_s", pa.float64()),
        ("battery", pa.string()),
        ("serial", pa.string()),
        ("series", pa.int64()),
        ("capacity_ah", pa.float64()),
        ("current_source", pa.string()),
        ("charge_ah", pa.float64()),
        ("hover_s", pa.float64()),
        ("vertical_s", pa.float64()),
        ("horizontal_s", pa.float64()),
        ("voltage_rmse_mv", pa.float64()),
        ("max_error_mv", pa.float64()),
        ("replay_status", pa.string()),
        ("lithium_lost_mah", pa.float64()),  # in the air, as of a new pack
        ("capacity_std_ah", pa.float64()),  # null where the capacity was not fitted
        ("pulse_ohm", pa.float64()),  # likewise, of the whole pack after 10 s of load
        ("mismatch", pa.string()),
        ("mismatch_effects", pa.string()),
        ("warnings", pa.int64()),
        ("left_out", pa.string()),  # why it is not to be summed with the others
    ]
)


def _fleet_row(flight: FleetFlight) -> Mapping[str, object]:
    result = flight.result
    motions = {
        f"{name}_s": part["time_s"] if part else 0.0
        for name, part in result.motions.model_dump().items()
    }
    fitted = {q.name: q for q in result.pack.fit.quantities} if result.pack.fit else {}
    capacity, pulse = fitted.get("capacity_C"), fitted.get("pulse_ohm")
    lost = result.assessment.in_flight if result.assessment else None
    return {
        "folder": flight.folder,
        **result.flight.model_dump(),
        **result.pack.model_dump(),
        **motions,
        "current_source": result.quality.current_source,
        "charge_ah": charge_ah(result.segments),
        "voltage_rmse_mv": result.replay.voltage_rmse_mv,
        "max_error_mv": result.replay.max_error_mv,
        "replay_status": result.replay.status,
        "lithium_lost_mah": lost.lithium_mah if lost else None,
        "capacity_std_ah": capacity.std / 3600 if capacity else None,
        "pulse_ohm": pulse.value if pulse else None,
        "mismatch": result.mismatch.verdict if result.mismatch else None,
        "mismatch_effects": "+".join(e.id for e in result.mismatch.effects)
        if result.mismatch
        else None,
        "warnings": len(result.quality.warnings),
    }


def _fleet_columns(rows: Sequence[Mapping[str, object]]) -> Mapping[str, pa.Array]:
    return {f.name: pa.array([row[f.name] for row in rows], type=f.type) for f in FLEET_SCHEMA}
