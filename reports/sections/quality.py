"""What is doubtful about the log, and the checks it passed."""

from flightlogs.holes import holes
from flightlogs.recording import Recording
from reports.flight import FlightReport, Gaps
from reports.quantity import fixed, significant
from reports.section import Notice, Row, Section, Severity

UNITY = "1 if both agree; they come from one sensor, so its scale can be wrong all the same"
SLOPE = "slope of voltage on current under load, whole pack"


def quality(report: FlightReport) -> Section:
    """Warnings first, then the figures behind them."""
    notices = tuple(
        Notice(text=w.message, severity=Severity.DOUBT, where=w.where, code=w.code)
        for w in report.recording.warnings
    )
    lead = () if notices else ("Nothing doubtful was found in this log.",)
    return Section(
        id="quality", title="Quality of the log", lead=lead, notices=notices, rows=_rows(report)
    )


def _rows(report: FlightReport) -> tuple[Row, ...]:
    log, recording, gaps = report.log, report.recording, report.gaps
    resistance = recording.resistance_ohm
    rows = [
        Row(label="Recovered", value=fixed(100 * log.recovered_fraction, 1), unit="% of the file"),
        Row(label="Dropouts", value=fixed(log.dropouts_s, 2), unit="s", note="as the logger says"),
        Row(
            label="Gaps in the current",
            value=str(gaps.count),
            note="; ".join(filter(None, (_bridged(gaps), _at_the_ends(recording)))),
        ),
    ]
    if recording.coulomb_check is not None:
        value = fixed(recording.coulomb_check, 3)
        rows.append(Row(label="Charge against the log's counter", value=value, note=UNITY))
    if resistance is not None:
        value = significant(1000 * resistance)
        rows.append(Row(label="Apparent resistance", value=value, unit="mΩ", note=SLOPE))
    return tuple(rows)


def _bridged(gaps: Gaps) -> str:
    if not gaps.count:
        return ""
    return (
        f"{fixed(gaps.total_s, 1)} s in all, the longest {fixed(gaps.longest_s, 1)} s; "
        f"the replay bridges them on a straight line, {significant(gaps.charge_C / 3.6)} mAh"
    )


def _at_the_ends(recording: Recording) -> str:
    """What of the flight lies before the first sample or after the last, where nothing bridges."""
    ends = (recording.flight.start_s, recording.flight.stop_s)
    outer = [
        h for h in holes(recording.time_s, recording.flight) if {*ends} & {h.start_s, h.stop_s}
    ]
    missing_s = sum(hole.duration_s for hole in outer)
    return f"{fixed(missing_s, 1)} s at the ends of the flight have no current" if outer else ""
