"""How the sensor's clock was mapped to the autopilot's."""

from flightlogs.recording import ClockFit
from reports.flight import FlightReport
from reports.quantity import fixed
from reports.section import Notice, Row, Section, Severity

MATCHED = {
    "battery_current": "the battery current of the autopilot",
    "thrust": "thrust, since the autopilot's current is of no use here",
}


def alignment(report: FlightReport) -> Section | None:
    """None for a flight without a sensor recording."""
    fit, name = report.recording.alignment, report.provenance.sensor_name
    if fit is not None:
        return Section(
            id="alignment",
            title="Clock of the current sensor",
            lead=(
                f"The current is that of the sensor ({name}). Its clock was found by correlation "
                f"with {MATCHED.get(fit.method, fit.method)}.",
            ),
            rows=(*_clock(fit), *_disagreement(fit)),
        )
    if report.alignment_refusal:
        text = f"{name} was not used: {report.alignment_refusal} The autopilot's current was used."
        return Section(
            id="alignment",
            title="Clock of the current sensor",
            notices=(Notice(text=text, severity=Severity.DOUBT, code="sensor_not_aligned"),),
        )
    return None


def _clock(fit: ClockFit) -> tuple[Row, ...]:
    return (
        Row(
            label="Offset",
            value=fixed(fit.offset_s, 3),
            sd=fixed(fit.uncertainty_s, 3),
            unit="s",
            note="the sensor's first sample on the autopilot's clock; uncertainty in mid flight",
        ),
        Row(
            label="Drift",
            value=fixed(fit.drift_ppm, 1),
            sd=fixed(fit.drift_uncertainty_ppm, 1),
            unit="ppm",
            note="by which the autopilot's clock runs faster",
        ),
        Row(label="Correlation", value=fixed(fit.correlation, 3), note="after alignment"),
    )


def _disagreement(fit: ClockFit) -> tuple[Row, ...]:
    if fit.gain is None or fit.bias_A is None:
        return (Row(label="Against the autopilot's current", value="none to compare with"),)
    note = "sensor = gain × autopilot + offset; which of them is right is not known from this"
    return (
        Row(label="Gain against the autopilot", value=fixed(fit.gain, 3), note=note),
        Row(label="Offset against the autopilot", value=fixed(fit.bias_A, 2), unit="A"),
    )
