"""What is doubtful about the log, and the checks it passed."""

from reports.flight import FlightReport
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
            note=(
                f"{fixed(gaps.total_s, 1)} s in all, the longest {fixed(gaps.longest_s, 1)} s; "
                "the replay bridges them on a straight line, "
                f"{significant(gaps.charge_C / 3.6)} mAh"
                if gaps.count
                else ""
            ),
        ),
    ]
    if recording.coulomb_check is not None:
        value = fixed(recording.coulomb_check, 3)
        rows.append(Row(label="Charge against the log's counter", value=value, note=UNITY))
    if resistance is not None:
        value = significant(1000 * resistance)
        rows.append(Row(label="Apparent resistance", value=value, unit="mΩ", note=SLOPE))
    return tuple(rows)
