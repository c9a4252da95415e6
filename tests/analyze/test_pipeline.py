"""One flight from its files to a report; reading is a stand-in, the rest is real."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyze import pipeline
from analyze.pack_choice import read_pack
from analyze.pipeline import Inputs, Source, analyse, read_flight
from flightlogs.align import AlignedSensor, AlignmentRefused
from flightlogs.errors import LogError, LogWarning, Refusal
from flightlogs.sensor import SensorCounts, SensorLog
from reports.flight import FlightReport
from reports.flight_page import flight_page
from reports.render import render
from reports.results import result_of
from segment.segment import Motion
from tests.reports import example
from twin.calibrate.asked import Asked
from twin.calibrate.doubt import Doubt
from twin.solution import Status

PACK = '[pack]\nname = "mine"\ncell = "lipo_2200"\nseries = 4\n'


class Readers:
    """Stands in for `flightlogs`, and remembers what it was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.asked: dict[str, object] = {}
        self.align_error: LogError | None = None
        self.refusal: Refusal | None = None
        self.warnings = example.recording().warnings
        monkeypatch.setattr(pipeline, "read_log", lambda _, name: example.log(name))
        monkeypatch.setattr(pipeline, "read_sensor", self.read_sensor)
        monkeypatch.setattr(pipeline, "align", self.align)
        monkeypatch.setattr(pipeline, "assemble", self.assemble)

    def read_sensor(self, stream: object, *, name: str) -> SensorLog:
        del stream
        return SensorLog(
            name=name,
            time_s=example.T,
            current_A=example.CURRENT,
            voltage_V=None,
            counts=SensorCounts(),
            warnings=(LogWarning("sensor_saturated", "7 samples at a rail"),),
        )

    def align(self, sensor: SensorLog, log: object, *, battery: int | None) -> AlignedSensor:
        del log
        self.asked |= {"aligned": sensor.name, "battery": battery}
        if self.align_error:
            raise self.align_error
        return AlignedSensor(
            time_s=example.T, current_A=example.CURRENT, fit=example.recording().alignment
        )

    def assemble(self, log: object, *, battery: int | None, sensor: object):
        del log
        self.asked |= {"battery of the log": battery, "sensor": sensor}
        if self.refusal:
            raise self.refusal
        return example.recording(
            alignment=example.recording().alignment if sensor else None,
            current_source="sensor" if sensor else "autopilot",
            warnings=self.warnings,
        )


@pytest.fixture
def readers(monkeypatch: pytest.MonkeyPatch) -> Readers:
    return Readers(monkeypatch)


def analysed(
    folder: Path, *, sensor: bool = False, pack: str = "", battery: int | None = None,
    serial: str = "",
) -> FlightReport:  # fmt: skip
    for name in ("flight.ulg", "flight.csv"):
        (folder / name).write_bytes(b"")
    (folder / "pack.toml").write_text(pack, encoding="utf-8")
    inputs = Inputs(
        log=folder / "flight.ulg",
        log_sha256="ab" * 32,
        sensor=folder / "flight.csv" if sensor else None,
        sensor_sha256="cd" * 32 if sensor else "",
        pack=read_pack(folder / "pack.toml") if pack else None,
        battery=battery,
        sha256="ef" * 32,
        serial=serial,
    )
    return analyse(inputs, clock=itertools.count(5.0, 2.5).__next__)


def codes(report: FlightReport) -> list[str]:
    return [w.code for w in report.recording.warnings]


@pytest.mark.usefixtures("readers")
def test_a_flight_becomes_a_page_and_a_result(tmp_path: Path) -> None:
    report = analysed(tmp_path)
    assert report.replay.solution.status is Status.DONE
    assert {s.motion for s in report.segments} >= {Motion.HOVER, Motion.HORIZONTAL}
    assert report.provenance.seconds == 2.5
    assert "Replay through the twin" in render(flight_page(report))
    result = result_of(report)
    assert result.replay.status == "done"
    assert result.alignment is None
    assert not result.pack.calibrated
    assert result.assessment is None
    assert "No motion can be repeated" in report.no_damage


@pytest.mark.usefixtures("readers")
def test_a_serial_number_is_the_one_that_was_said_where_nothing_else_has_one(
    tmp_path: Path,
) -> None:
    assert analysed(tmp_path, serial="BAT 7").pack.serial == "BAT 7"
    file = '[pack]\nname = "x"\ncell = "lipo_2200"\nseries = 4\nserial = "of the file"\n'
    assert analysed(tmp_path, pack=file, serial="BAT 7").pack.serial == "of the file"


def test_an_aligned_sensor_is_used(tmp_path: Path, readers: Readers) -> None:
    report = analysed(tmp_path, sensor=True, battery=1)
    assert readers.asked["aligned"] == "flight.csv"
    assert readers.asked["battery"] == readers.asked["battery of the log"] == 1
    assert isinstance(readers.asked["sensor"], AlignedSensor)
    assert report.provenance.sensor_name == "flight.csv"
    assert not report.alignment_refusal


def test_what_is_doubtful_in_the_sensor_is_told(tmp_path: Path, readers: Readers) -> None:
    assert "sensor_saturated" in codes(analysed(tmp_path, sensor=True))
    readers.align_error = AlignmentRefused("steady", "nothing happens")
    assert "sensor_saturated" in codes(analysed(tmp_path, sensor=True))


def test_a_refused_log_says_why_the_sensor_could_not_help(tmp_path: Path, readers: Readers) -> None:
    readers.align_error = AlignmentRefused("steady", "nothing happens")
    readers.refusal = Refusal("no_current", "the current was not measured")
    with pytest.raises(Refusal, match=r"not measured. The sensor's .* nothing happens") as refused:
        analysed(tmp_path, sensor=True)
    assert refused.value.code == "no_current"
    with pytest.raises(Refusal, match=r"not measured$"):
        analysed(tmp_path)


@pytest.mark.parametrize(
    "error",
    [AlignmentRefused("steady", "nothing happens in this flight"), LogError("no current column")],
)
def test_a_sensor_that_cannot_be_used_leaves_the_autopilots_current_and_says_why(
    tmp_path: Path, readers: Readers, error: LogError
) -> None:
    readers.align_error = error
    report = analysed(tmp_path, sensor=True)
    assert readers.asked["sensor"] is None
    assert str(error) in report.alignment_refusal
    assert "sensor_not_used" in codes(report)
    assert str(error) in render(flight_page(report))


def test_a_sensor_that_cannot_be_opened_costs_the_sensor_only(
    tmp_path: Path, readers: Readers, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read_sensor(_: object, *, name: str) -> None:
        raise PermissionError(13, "Permission denied", name)

    monkeypatch.setattr(pipeline, "read_sensor", read_sensor)
    report = analysed(tmp_path, sensor=True)
    assert readers.asked["sensor"] is None
    assert report.alignment_refusal == "flight.csv cannot be read: Permission denied"
    assert "sensor_not_used" in codes(report)


@pytest.mark.usefixtures("readers")
def test_the_pack_file_is_obeyed_and_its_disagreement_with_the_log_is_told(tmp_path: Path) -> None:
    report = analysed(tmp_path, pack=PACK.replace("4", "5") + "[start]\nsoc = 0.8\n")
    assert report.pack.series == 5
    assert report.replay.solution.soc[0] == pytest.approx(0.8, abs=1e-3)
    assert "series_disagree" in codes(report)
    assert "series_disagree" not in codes(analysed(tmp_path, pack=PACK))


@pytest.mark.parametrize(
    ("pack", "left"),
    [
        ("", ["cell_count_inferred", "capacity_unknown", "capacity_doubtful"]),
        (PACK, ["capacity_unknown", "capacity_doubtful"]),
        (PACK + "capacity_ah = 2.2\n", []),
        (PACK + "capacity_ah = 0.1\n", ["capacity_doubtful"]),  # more was drawn
    ],
)
def test_what_the_log_lacks_and_the_pack_file_states_is_no_doubt(
    tmp_path: Path, readers: Readers, pack: str, left: list[str]
) -> None:
    lacks = ("cell_count_inferred", "capacity_unknown", "capacity_doubtful")
    readers.warnings = tuple(LogWarning(code, "state it in pack.toml") for code in lacks)
    (tmp_path / "flight.ulg").touch()
    (tmp_path / "pack.toml").write_text(pack, encoding="utf-8")
    choice = read_pack(tmp_path / "pack.toml") if pack else None
    flight = read_flight(
        Source(log=tmp_path / "flight.ulg", sensor=None, pack=choice, battery=None)
    )
    assert [w.code for w in flight.recording.warnings] == left


@pytest.mark.usefixtures("readers")
def test_a_capacity_that_less_than_was_drawn_is_a_doubt(tmp_path: Path) -> None:
    report = analysed(tmp_path, pack=PACK + "capacity_ah = 0.1\n")
    (doubt,) = (w for w in report.recording.warnings if w.code == "capacity_doubtful")
    assert "by the pack file the pack holds 0.1 Ah: check capacity_ah" in doubt.message


@pytest.mark.usefixtures("readers")
def test_a_pack_that_is_too_small_is_replayed_as_far_as_it_comes(tmp_path: Path) -> None:
    report = analysed(tmp_path, pack=PACK + "capacity_ah = 0.05\n")
    assert report.replay.solution.status is not Status.DONE
    assert "ended early" in render(flight_page(report))
    assert result_of(report).replay.status != "done"


@pytest.mark.usefixtures("readers")
def test_warnings_of_the_recording_are_kept(tmp_path: Path) -> None:
    assert codes(analysed(tmp_path)) == ["cells_inferred"]


@pytest.mark.usefixtures("readers")
def test_the_same_inputs_give_the_same_page(tmp_path: Path) -> None:
    first, second = analysed(tmp_path), analysed(tmp_path)
    assert render(flight_page(first)) == render(flight_page(second))
    assert result_of(first) == result_of(second)


@pytest.mark.usefixtures("readers")
@pytest.mark.parametrize(("tests_A", "more"), [(1e3, set()), (1.0, {"beyond_calibration"})])
def test_a_flight_beyond_the_tests_of_its_calibration_is_doubtful(
    tmp_path: Path, tests_A: float, more: set[str]
) -> None:
    (tmp_path / "pack.toml").write_text(PACK)
    (tmp_path / "flight.ulg").touch()
    none, asked = np.zeros(0), Asked((tests_A, tests_A), 200.0, 400.0)
    doubt = Doubt(names=(), value=none, std=none, correlations=np.eye(0), asked=asked)
    choice = replace(read_pack(tmp_path / "pack.toml"), cell_doubt=doubt)
    source = Source(log=tmp_path / "flight.ulg", sensor=None, pack=choice, battery=None)
    said = {w.code for w in read_flight(source).recording.warnings}
    assert said - {w.code for w in example.recording().warnings} == more
