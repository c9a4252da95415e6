import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from flightlogs.assemble import assemble
from flightlogs.read import read_log
from sample_logs.flown import fly_sample
from sample_logs.formats import ulog
from sample_logs.make import SAMPLES, SENSOR, make
from segment import Motion, cut
from tests.segment.judged import judge

FOLDER = Path(__file__).parents[2] / "sample_logs"
LOGS = ("s500.ulg", "s500_telemetry.tlog", "s500_ardupilot.bin", "light.ulg")


MADE = sorted(
    ["s500.sensor.csv", *LOGS, *(str(Path(name).with_suffix(".truth.json")) for name in LOGS)]
)
REMEDY = "the generator or the twin has changed: run `python -m sample_logs.make` and commit"


def recording(name, folder=FOLDER):
    with (folder / name).open("rb") as stream:
        return assemble(read_log(stream, name=name))


def truth(name):
    return json.loads((FOLDER / name).with_suffix(".truth.json").read_text())


def test_the_script_makes_equal_bytes_every_time(tmp_path):
    for name in ("one.ulg", "two.ulg"):
        ulog(fly_sample(SAMPLES[1]), tmp_path / name)
    assert (tmp_path / "one.ulg").read_bytes() == (tmp_path / "two.ulg").read_bytes()


def test_the_committed_files_are_those_the_script_makes(tmp_path):
    """To a count of each instrument: another processor may round a last bit the other way."""
    make(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == MADE
    for name in LOGS:
        made, kept = recording(name, tmp_path), recording(name)
        assert made.time_s == pytest.approx(kept.time_s, abs=1e-6), REMEDY
        assert made.current_A == pytest.approx(kept.current_A, abs=0.021), REMEDY
        assert made.voltage_V == pytest.approx(kept.voltage_V, abs=0.0021), REMEDY
        assert made.velocity_m_s == pytest.approx(kept.velocity_m_s, abs=1e-3), REMEDY


def test_the_samples_stay_small():
    assert sum(p.stat().st_size for p in FOLDER.rglob("*") if p.is_file()) < 4e6


@pytest.mark.parametrize("name", LOGS)
def test_a_sample_is_read_without_doubts_and_cut_as_it_was_flown(name):
    flight, answer = recording(name), truth(name)
    assert {w.code for w in flight.warnings} <= {"cell_count_inferred"}
    assert flight.series == 4
    assert flight.capacity_C == pytest.approx(2.2 * 3600)
    spans = [
        SimpleNamespace(motion=Motion(s["motion"]), start_s=s["start_s"], stop_s=s["stop_s"])
        for s in answer["segments"]
    ]
    found = judge(spans, cut(flight))
    assert found.right >= 0.95
    assert np.median(found.boundaries_s) <= 0.5


def test_the_formats_tell_of_one_flight():
    flights = [recording(n) for n in LOGS[:3]]
    charges = [np.trapezoid(f.current_A, f.time_s) for f in flights]
    assert charges == pytest.approx([charges[0]] * 3, rel=0.005)


def test_the_truth_beside_the_sensor_is_that_of_its_clock():
    assert truth("s500.ulg")["sensor_clock"] == {
        "offset_s": SENSOR.offset_s,
        "drift_ppm": SENSOR.drift_ppm,
    }
    assert truth("light.ulg")["sensor_clock"] is None
    assert truth("light.ulg")["pack"]["initial_soc"] == SAMPLES[1].hidden.initial_soc


def test_the_sensor_file_follows_the_ulog_through_the_true_clock():
    stamps_ms, current = np.loadtxt(
        FOLDER / "s500.sensor.csv", delimiter=",", skiprows=1, unpack=True
    )
    t = (stamps_ms - stamps_ms[0]) / 1000
    at = t * (1 + SENSOR.drift_ppm * 1e-6) + SENSOR.offset_s
    flight, gauge = recording("s500.ulg"), SAMPLES[0].autopilot
    seen = np.interp(flight.time_s, at, current)
    expected = gauge.gain * seen + gauge.bias_A
    assert np.corrcoef(seen, flight.current_A)[0, 1] > 0.99
    assert np.mean(flight.current_A - expected) == pytest.approx(0.0, abs=0.05)
