"""The short form of a mismatch in `analyze`: when causes are looked for, and what is said."""

from dataclasses import replace

import numpy as np
import pytest

from analyze import mismatching
from analyze.mismatching import mismatch_of, quick
from analyze.pack_choice import PackChoice
from flightlogs.errors import LogWarning
from flightlogs.log import Interval
from flightlogs.recording import Recording
from reports.flight import Fitting, NoMismatch, PackUse
from tests.reports import example
from tests.twin.mismatch.recordings import flown, pack
from twin.calibrate.doubt import Doubt
from twin.calibrate.flight import NotFitted
from twin.effects import Plating, SelfHeating, SeriesResistance
from twin.mismatch import Finding, Flight, Verdict
from twin.pack import Pack
from twin.pack_file import parse_pack_file
from twin.replay import Replay
from twin.simulate import simulate

CALIBRATED = replace(example.pack(), calibrated=True)
NO_FILE = replace(example.pack(), fitting=Fitting(outcome=NotFitted("a hop"), before_V=None))
FITTED = example.fitted_pack()


def found(
    use: PackUse, flight: Flight, *codes: str, choice: PackChoice | None = None
) -> Finding | NoMismatch:
    recording = recording_of(flight, *codes)
    played = Replay(
        load=flight.load,
        recorded_V=flight.voltage_V,
        judged=flight.judged,
        solution=simulate(flight.pack, flight.load),
    )
    return mismatch_of(recording, example.segments(), use, flight.pack, played, choice=choice)


def recording_of(flight: Flight, *codes: str) -> Recording:
    n = flight.time_s.size
    return example.recording(
        time_s=flight.time_s,
        current_A=flight.load.current_A,
        voltage_V=flight.voltage_V,
        velocity_m_s=np.zeros((n, 3)),
        velocity_setpoint_m_s=None,
        in_air=np.ones(n, dtype=bool),
        flight=Interval(float(flight.time_s[0]), float(flight.time_s[-1])),
        warnings=tuple(LogWarning(code=c, message="", where="") for c in codes),
    )


def test_with_a_pack_file_a_cause_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    few = tuple(h for h in quick(pack()) if h.id in ("series_resistance", "voltage_gain"))
    monkeypatch.setattr(mismatching, "quick", lambda _: few)
    flight = flown([SeriesResistance(resistance_ohm=0.01)], seed=1, seconds=60.0)
    finding = found(CALIBRATED, flight)
    assert isinstance(finding, Finding)
    assert [e.id for e in finding.effects] == ["series_resistance"]
    (remark,) = finding.remarks
    assert remark.startswith("The pack file does not state by how much this twin errs")
    told = found(replace(CALIBRATED, cell_error_V=1e-4), flight)
    assert told.remarks == ()
    (remark,) = found(example.pack(), flight).remarks
    assert "difference between that cell and the pack's own" in remark
    right = found(example.pack(), flown(seed=1, seconds=60.0))
    assert right.remarks == ()  # nothing is missing


@pytest.mark.parametrize("use", [NO_FILE, FITTED], ids=["not fitted", "fitted"])
def test_without_a_pack_file_it_is_located_and_no_cause_named(use: PackUse) -> None:
    """The built-in cell, or the fit, would fake or eat it: 10 mOhm are real, and not said."""
    flight = flown([SeriesResistance(resistance_ohm=0.01)], seed=1, seconds=60.0)
    finding = found(use, flight)
    assert isinstance(finding, Finding)
    assert finding.verdict is Verdict.UNKNOWN
    assert finding.effects == ()
    assert not finding.causes_sought
    assert finding.spans
    assert finding.drivers[0].explained > 0.8
    assert ("takes up whatever looks like it" in " ".join(finding.remarks)) == (use is FITTED)
    assert found(use, flown(seed=1, seconds=60.0)).verdict is Verdict.NONE


def test_only_what_runs_on_the_kernel_of_the_pack_is_tried() -> None:
    ids = {h.id for h in quick(pack())}
    assert "ocv_hysteresis" not in ids
    assert "plating_stripping" not in ids
    assert {"self_heating", "weak_cell", "clock_shift"} <= ids
    ageing: Pack = replace(pack(), effects=(SelfHeating(), Plating()))
    assert "plating_stripping" in {h.id for h in quick(ageing)}


@pytest.mark.parametrize(
    ("seconds", "codes", "said"),
    [(10.0, (), "Too little to judge"), (60.0, ("simulated_log",), "simulator's formula")],
)
def test_what_cannot_be_judged_says_why(seconds: float, codes: tuple[str, ...], said: str) -> None:
    refused = found(CALIBRATED, flown(seed=1, seconds=seconds), *codes)
    assert isinstance(refused, NoMismatch)
    assert said in refused.reason


def test_what_the_calibration_leaves_open_is_told_and_that_a_fit_is_of_another_cell() -> None:
    """Its resistance alone."""
    flight = flown([SeriesResistance(resistance_ohm=0.01)], seed=1, seconds=60.0)
    file = parse_pack_file('[pack]\nname = "x"\ncell = "lipo_2200"\nseries = 4\n', name="x")

    def by(name: str, value: float, std: float) -> Finding | NoMismatch:
        told = Doubt(
            names=(name,), value=np.array([value]), std=np.array([std]), correlations=np.eye(1)
        )
        choice = PackChoice(file=file, cell="lipo_2200", sha256="", cell_doubt=told)
        return found(CALIBRATED, flight, choice=choice)

    finding = by("series_resistance_ohm", 0.0, 6e-3)
    assert isinstance(finding, Finding)
    assert "Other cells that follow the calibration's tests as well" in " ".join(finding.remarks)
    other = by("negative.porosity", 0.9, 0.01)
    assert isinstance(other, Finding)
    assert "Other cells" not in " ".join(other.remarks)
    assert "counts as nothing: the fit beside the pack file is of" in " ".join(other.remarks)
