"""What every section of a page keeps to, and what some of them must say."""

import re
from dataclasses import replace

import numpy as np
import pytest

from flightlogs.errors import LogWarning
from reports import plots
from reports.flight import Fitting, Gaps
from reports.section import Section, Severity
from reports.sections import FLIGHT_SECTIONS
from reports.sections.alignment import alignment
from reports.sections.course import GROUND, course
from reports.sections.fit import SHOWN, fit
from reports.sections.mismatch import mismatch
from reports.sections.motions import NO_ENERGY, motions
from reports.sections.profiles import profiles
from reports.sections.quality import quality
from reports.sections.replay import replay
from reports.sections.summary import summary
from segment.segment import Motion
from tests.reports import example
from tests.reports.mismatch_example import course as course_of
from tests.reports.mismatch_example import finding
from twin.calibrate.flight import NotFitted
from twin.mismatch import Finding, Verdict
from twin.solution import Status

POOR = example.report(  # next to nothing was logged
    recording=example.recording(
        velocity_m_s=None,
        velocity_setpoint_m_s=None,
        setpoint_source="",
        voltage_V=np.full(example.T.size, np.nan),
        coulomb_check=None,
        resistance_ohm=None,
        alignment=None,
        other_flights=(),
        other_batteries=(),
        warnings=(),
    ),
    segments=(),
    profiles={},
    gaps=Gaps(),
    pack=example.pack(),
)
REPORTS = {
    "rich": example.report(damage=example.study(thorough=True), mismatch=finding()),
    "poor": POOR,
}


@pytest.mark.parametrize("which", REPORTS)
@pytest.mark.parametrize("section", FLIGHT_SECTIONS)
def test_a_section_has_a_title_full_tables_and_described_drawings(section, which) -> None:
    made = section(REPORTS[which])
    if made is None:
        assert which == "poor"
        return
    assert made.id
    assert made.title
    for table in made.tables:
        assert table.caption
        assert {len(row) for row in table.rows} <= {len(table.columns)}
    for figure in made.figures:
        assert len(figure.description) > 20
        assert figure.svg.startswith("<svg ")
    assert not re.search(r"\bnan\b", repr(replace(made, figures=())), re.IGNORECASE)


def test_section_ids_are_unique() -> None:
    made = [section(REPORTS["rich"]) for section in FLIGHT_SECTIONS]
    ids = [s.id for s in made if s]
    assert len(ids) == len(set(ids))


def values(section: Section | None) -> dict[str, str]:
    assert section is not None
    return {row.label: f"{row.value} {row.unit}".strip() for row in section.rows}


def test_an_uncalibrated_pack_is_the_first_thing_said() -> None:
    first = summary(example.report(pack=example.pack())).notices[0]
    assert first.severity is Severity.DOUBT
    assert "not calibrated to this pack" in first.text
    pack = replace(example.pack(), calibrated=True)
    assert not summary(example.report(pack=pack)).notices


def test_a_fitted_pack_is_the_first_thing_said_with_what_is_known_of_it() -> None:
    (first,) = summary(REPORTS["rich"]).notices
    assert first.code == "fitted_to_this_flight"
    assert first.severity is Severity.NOTE
    assert "fitted to this flight, not calibrated to this pack" in first.text
    assert "from 72 to" in first.text
    for told in ("96.40 ± 0.40 %", "2.05 ± 0.06 Ah", "41.20 ± 0.70 mΩ"):
        assert told in first.text


def test_a_doubtful_current_makes_the_fit_doubtful() -> None:
    doubt = LogWarning("current_scale_doubtful", "the voltage falls by 300 mOhm")
    report = example.report(recording=example.recording(warnings=(doubt,)))
    first, section = summary(report).notices[0], fit(report)
    assert first.severity is Severity.DOUBT
    assert "doubtful, and so are capacity and resistance" in first.text
    assert section is not None
    assert "2.20 Ah, the fit finds 2.05 Ah" in section.notices[0].text


def test_why_a_flight_was_not_fitted_is_said() -> None:
    fitting = Fitting(outcome=NotFitted("it was a hop"), before_V=0.1)
    report = example.report(pack=replace(example.pack(), fitting=fitting))
    assert "not fitted to this flight either: it was a hop." in summary(report).notices[0].text
    assert fit(report) is None


def test_every_fitted_quantity_has_its_interval_and_what_the_flight_tells_of_it() -> None:
    section = fit(REPORTS["rich"])
    assert section is not None
    rows = {row[0].text: [cell.text for cell in row[1:]] for row in section.tables[0].rows}
    assert [*rows][:3] == [SHOWN[n].label for n in ("initial_soc", "capacity_C", "pulse_ohm")]
    assert rows["Capacity"] == [
        "2.05", "0.06", "1.95 to 2.15", "2.20", "Ah", "told by this flight",
    ]  # fmt: skip
    assert rows[SHOWN["initial_K"].label][:2] == ["17.9", "3.0"]
    assert rows[SHOWN["heat_transfer_W_m2_K"].label][-1].startswith("nothing")
    assert values(section)["Error of what it was not fitted to"] == "9.0 mV"


@pytest.mark.parametrize(("ohm", "said"), [(0.02, 1), (None, 0)])
def test_which_resistance_a_charger_shows_is_said_where_the_page_has_two(
    ohm: float | None, said: int
) -> None:
    section = fit(replace(REPORTS["rich"], recording=example.recording(resistance_ohm=ohm)))
    assert section is not None
    assert sum("A charger measures resistance in a moment" in n for n in section.notes) == said


def test_a_capacity_that_was_not_fitted_is_owned_up_to() -> None:
    found = example.flight_fit()
    others = tuple(e for e in found.estimates if e.name != "capacity_C")
    fitting = Fitting(outcome=replace(found, estimates=others), before_V=None)
    section = fit(example.report(pack=replace(example.pack(), fitting=fitting)))
    assert section is not None
    assert any("capacity was not fitted" in note for note in section.notes)


def test_a_simulated_log_is_said_to_be_one() -> None:
    log = replace(example.log(), simulated=True)
    assert "simulated flight" in summary(example.report(log=log)).notices[-1].text


def test_charge_is_that_of_the_segments() -> None:
    charge = sum(mean * (stop - start) for _, start, stop, mean in example.SPANS) / 3600
    assert values(summary(REPORTS["rich"]))["Charge drawn in the log"] == f"{charge:.3f} Ah"


def test_every_warning_is_shown_with_its_code() -> None:
    notices = quality(REPORTS["rich"]).notices
    assert [n.code for n in notices] == ["cells_inferred"]


def test_bridged_gaps_are_owned_up_to() -> None:
    row = next(r for r in quality(REPORTS["rich"]).rows if r.label == "Gaps in the current")
    assert row.value == "1"
    assert "straight line, 11.4 mAh" in row.note


@pytest.mark.parametrize(("start_s", "stop_s"), [(0.0, 30.0), (30.0, 60.0)])
def test_a_current_of_half_the_flight_is_said_where_its_charge_is(
    start_s: float, stop_s: float
) -> None:
    kept = (start_s <= example.T) & (stop_s > example.T)
    per_sample = ("time_s", "current_A", "voltage_V", "velocity_m_s", "velocity_setpoint_m_s")
    whole = example.recording()
    cut = {name: getattr(whole, name)[kept] for name in (*per_sample, "in_air")}
    report = example.report(recording=example.recording(**cut), gaps=Gaps())
    notes = {row.label: row.note for s in (summary, quality) for row in s(report).rows}
    missing_s = 56.0 - 29.8 if start_s == 0 else 30.0 - 10.0
    assert notes["Charge drawn in the log"].endswith(
        f"sensor current, not known for {missing_s:.1f} s of the flight"
    )
    assert notes["Gaps in the current"] == (
        f"{missing_s:.1f} s at the ends of the flight have no current"
    )


def test_a_refused_sensor_is_named_with_its_reason() -> None:
    report = example.report(
        recording=example.recording(alignment=None), alignment_refusal="steady hover (steady)"
    )
    section = alignment(report)
    assert section is not None
    assert "steady hover (steady)" in section.notices[0].text
    assert "autopilot's current was used" in section.notices[0].text


def test_a_flight_without_a_sensor_has_no_alignment() -> None:
    assert alignment(POOR) is None


def test_the_disagreement_of_the_currents_is_reported() -> None:
    got = values(alignment(REPORTS["rich"]))
    assert got["Gain against the autopilot"] == "1.040"
    assert got["Offset against the autopilot"] == "-0.30 A"


def test_the_cut_says_what_decided_it() -> None:
    assert "commanded velocity (82 % of the time)" in course(REPORTS["rich"]).lead[0]


def test_a_motion_is_the_sum_of_its_segments() -> None:
    twice = (*example.segments()[:3], replace(example.segments()[2], start_s=56.0, stop_s=60.0))
    section = motions(example.report(segments=twice))
    assert section is not None
    hover = next(r for r in section.tables[0].rows if r[0].text == "hover")
    assert [c.text for c in hover[1:6]] == ["2", "20.0", "0.1600", "2.528", "18.00"]


def test_a_rate_over_a_capacity_nobody_knows_is_not_printed() -> None:
    section = motions(example.report(pack=replace(example.pack(), capacity_known=False)))
    assert section is not None
    assert {row[-1].text for row in section.tables[0].rows} == {"–"}
    known = motions(REPORTS["rich"])
    assert known is not None
    assert known.tables[0].rows[2][-1].text == f"{15 / 2.2:.2f}"


def test_a_motion_with_too_little_data_says_so() -> None:
    section = profiles(REPORTS["rich"])
    assert section is not None
    assert (
        section.notices[0].text
        == "Vertical: no profile. 8.0 s of vertical motion, 10 s are needed."
    )


def test_a_replay_that_ended_early_says_when_and_why() -> None:
    section = replay(example.report(played=example.solution(Status.ELECTROLYTE_DEPLETED, 100)))
    assert "at 19.9 s: the electrolyte has no salt left" in section.notices[0].text
    assert values(section)["Highest temperature"] == "26.0 °C"


def test_a_replay_that_ended_at_once_is_shown_without_a_drawing() -> None:
    report = example.report(played=example.solution(Status.NOT_CONVERGED, 0))
    section = replay(report)
    assert not section.figures
    assert values(section)["Voltage error, RMS"] == "– mV"


def test_the_replay_error_is_that_of_the_flight() -> None:
    report = REPORTS["rich"]
    solution, air = report.replay.solution, report.recording.in_air
    error = (report.recording.voltage_V - solution.voltage_V)[air]
    rmse = 1000 * float(np.sqrt(np.mean(error**2)))
    assert values(replay(report))["Voltage error, RMS"] == f"{rmse:.1f} mV"


def test_the_recorded_line_runs_on_between_the_samples_with_a_voltage(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beside a sensor's current every second one may have none."""
    drawn = {}
    monkeypatch.setattr(plots, "line", lambda _, t, y, *look: drawn.update({look[1]: (t, y)}))
    report = example.report()
    seen = np.arange(example.T.size) % 2 == 0
    sparse_V = np.where(seen, report.recording.voltage_V, np.nan)
    replay(replace(report, replay=replace(report.replay, recorded_V=sparse_V)))
    for label in ("recorded", "recorded − simulated"):
        np.testing.assert_array_equal(drawn[label][0], example.T[seen])
        assert np.isfinite(drawn[label][1]).all()


def said(of: Finding) -> str:
    section = mismatch(example.report(mismatch=of))
    return " ".join((*section.lead, *(n.text for n in section.notices)))


@pytest.mark.parametrize("verdict", Verdict)
def test_the_mismatch_is_told_in_short_with_where_it_lies(verdict: Verdict) -> None:
    own = replace(finding(verdict), courses=(course_of("a.ulg", ahead=True),))
    text = said(own)
    # 55 % of the mismatch in the 50 of the 114.9 s that count
    assert ("It is there all through the flight" in text) == (verdict is not Verdict.NONE)
    short = replace(own.spans[0], share=0.9) if own.spans else None
    if short:
        text = said(replace(own, spans=(short,)))
        assert "90 % lies in the vertical stretches, which make 44 % of the flight" in text
    section = mismatch(example.report(mismatch=own))
    assert [f.svg[:5] for f in section.figures] == ["<svg "]
    assert "twin explain" in section.notes[0]


def test_where_no_cause_was_sought_none_is_ruled_out() -> None:
    unknown = finding(Verdict.UNKNOWN)
    assert "no effect that it knows" in said(unknown)
    located = replace(unknown, candidates=unknown.candidates[-1:], remarks=("no pack file",))
    assert not located.causes_sought
    assert "no effect that it knows" not in said(located)
    assert "no pack file" in said(located)
    assert not mismatch(example.report(mismatch=located)).tables


def test_why_it_was_not_judged_is_said() -> None:
    assert mismatch(example.report()).notices[0].text == "It was not looked for."


def test_what_of_a_flight_was_landed_or_not_recorded_is_told() -> None:
    def told(*motions: Motion) -> tuple[str, str]:
        segments = tuple(s for s in example.segments() if s.motion not in motions)
        rows = {r.label: r for r in summary(example.report(segments=segments)).rows}
        return rows["Time in flight"].value, rows["Time in flight"].note

    assert told() == ("0:46", "from 10.0 s to 56.0 s of the log")
    less = "from 10.0 s to 56.0 s of the log, less 8.0 s landed or not recorded"
    assert told(Motion.VERTICAL) == ("0:38", less)


def test_the_ground_is_told_by_signs_of_flight_and_not_by_the_absence_of_velocity() -> None:
    section = course(example.report())
    assert section.lead[0].endswith(f"; {GROUND} (18 % of the time).")
    rows = {row[0].text: row[4].text for row in section.tables[0].rows}
    assert rows["ground"] == GROUND
    assert rows["hover"] == "commanded velocity"


def test_an_energy_that_is_not_known_is_explained() -> None:
    ground, *others = example.segments()
    no_voltage = replace(ground, load=replace(ground.load, energy_J=np.nan))
    section = motions(example.report(segments=(no_voltage, *others)))
    assert section.tables[0].rows[0][4].text == "–"
    assert NO_ENERGY in section.notes
    assert NO_ENERGY not in motions(example.report()).notes


@pytest.mark.parametrize(("verdict", "strips"), [(Verdict.NONE, 0), (Verdict.NAMED, 1)])
def test_there_is_no_empty_axis_for_spans_where_there_are_none(verdict, strips) -> None:
    figure = mismatch(example.report(mismatch=finding(verdict))).figures[0]
    assert figure.svg.count('id="where0-axes_2"') == strips
    assert ("spans that exceed the noise" in figure.description) == bool(strips)
