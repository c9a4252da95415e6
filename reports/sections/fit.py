"""What this flight's own voltage told of its pack, and what it left open."""

import math
from dataclasses import dataclass

from reports.flight import FlightReport
from reports.quantity import ampere_hours, fixed
from reports.section import Cell, Column, Notice, Row, Section, Severity, Table
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.flight import FlightFit
from twin.constants import ZERO_CELSIUS_K

COLUMNS = (
    Column(title="quantity", numeric=False),
    Column(title="fitted"),
    Column(title="±"),
    Column(title="90 % interval"),
    Column(title="assumed"),
    Column(title="unit", numeric=False),
    Column(title="what this flight tells of it", numeric=False),
)
TELLS = {
    Verdict.IDENTIFIED: "told by this flight",
    Verdict.PARTLY: "partly: the assumption has a share in it",
    Verdict.PRIOR: "nothing: left as assumed",
    Verdict.AT_BOUND: "at its limit: no more than the interval says",
}


@dataclass(frozen=True, slots=True)
class Shown:
    """How a quantity is printed: `factor` times its value plus `offset`."""

    label: str
    unit: str
    factor: float = 1.0
    offset: float = 0.0

    def texts(self, *values: float, std: float) -> tuple[str, ...]:
        """Each rounded to two digits of the standard deviation, which comes last.

        Decimals are 2 at most: more would claim that the twin is as good as that.
        """
        width = abs(self.factor) * std
        decimals = min(max(1 - math.floor(math.log10(width)), 0), 2) if width > 0 else 2
        shown = (self.factor * value + self.offset for value in values)
        return *(fixed(value, decimals) for value in shown), fixed(width, decimals)


SHOWN = {
    "initial_soc": Shown("Charge at the start", "%", 100.0),
    "capacity_C": Shown("Capacity", "Ah", 1 / 3600),
    "pulse_ohm": Shown("Resistance of the whole pack, after 10 s of load", "mΩ", 1e3),
    "series_resistance_ohm": Shown("of it: leads, plugs, contacts", "mΩ", 1e3),
    "initial_K": Shown("Temperature of pack and air at the start", "°C", 1.0, -ZERO_CELSIUS_K),
    "heat_transfer_W_m2_K": Shown("Cooling of the cells", "W/(m² K)"),
    "reaction_kinetics": Shown("Speed of the reactions", "× built-in cell"),
    "electrolyte_transport": Shown("Transport in the electrolyte", "× built-in cell"),
    "solid_diffusion": Shown("Diffusion in the particles", "× built-in cell"),
}
LIKE = (
    "Leads, a cold pack, slow reactions and slow transport all lower the voltage under load. One "
    "flight tells their sum, the resistance of the whole pack, far better than their shares."
)
AMPERES = (
    "Capacity and resistance are in the amperes of this log: if its sensor reads 5 % too little, "
    "the pack holds 5 % more and resists 5 % less. The intervals include neither this nor that the "
    "pack may be of another make than the built-in cell."
)
NO_PROOF = (
    "A good fit proves nothing about its cause: wrong wiring of the sensor, thin leads or another "
    "chemistry are taken up by whatever looks most like them. Other temperatures, an emptier pack "
    "and ageing are not known from one flight: for those, measure reference tests and use "
    "`twin calibrate`, and give the result with --pack."
)
TWO = (
    "A charger measures resistance in a moment: compare its figure with the apparent one under "
    "“Quality of the log”, which follows quick changes of the current and has leads and plugs in "
    "it. After 10 s of load a pack has lost more, and that is what is told here."
)
NO_CHARGE = (
    "The capacity was not fitted: the charge that was drawn is not well known (see the quality of "
    "the log)."
)


def fit(report: FlightReport) -> Section | None:
    """The quantities with their intervals; None where nothing was fitted."""
    found = report.pack.fit
    if found is None:
        return None
    estimates = _in_order(found)
    table = Table(
        caption="What was fitted", columns=COLUMNS, rows=tuple(_row(e) for e in estimates)
    )
    names = {e.name for e in estimates}
    return Section(
        id="fit",
        title="Fitted to this flight",
        lead=(
            f"No pack file was given. The built-in cell {report.pack.cell} was therefore changed, "
            "as far as this flight's own voltage tells, until it answers as the pack did.",
        ),
        notices=_notices(report, found),
        rows=_errors(report, found),
        tables=(table,),
        notes=(
            LIKE,
            *((TWO,) if report.recording.resistance_ohm is not None else ()),
            AMPERES,
            *(() if "capacity_C" in names else (NO_CHARGE,)),
            NO_PROOF,
        ),
    )


def _in_order(found: FlightFit) -> tuple[Estimate, ...]:
    """As in SHOWN, the resistance of the whole before its part."""
    return tuple(sorted((*found.estimates, found.pulse), key=lambda e: [*SHOWN].index(e.name)))


def _row(estimate: Estimate) -> tuple[Cell, ...]:
    shown = SHOWN[estimate.name]
    value, lower, upper, prior, std = shown.texts(
        estimate.value, estimate.lower, estimate.upper, estimate.prior, std=estimate.std
    )
    tells = TELLS[estimate.verdict]
    texts = (shown.label, value, std, f"{lower} to {upper}", prior, shown.unit, tells)
    return tuple(Cell(text=text) for text in texts)


def _errors(report: FlightReport, found: FlightFit) -> tuple[Row, ...]:
    before_V = report.pack.fitting.before_V if report.pack.fitting else None
    after_V = report.replay.rmse_V
    return (
        _error("Voltage error before the fit, RMS", before_V, "whole pack, in the air"),
        _error("Voltage error after it", after_V, "on the samples it was fitted to"),
        _error(
            "Error of what it was not fitted to",
            found.held_out_after_V,
            "each quarter of the flight predicted by a fit to the other three, averaged over "
            f"short spans; before the fit {fixed(1000 * found.held_out_before_V, 1)} mV",
        ),
    )


def _error(label: str, error_V: float | None, note: str) -> Row:
    value = fixed(None if error_V is None else 1000 * error_V, 1)
    return Row(label=label, value=value, unit="mV", note=note)


def doubtful_current(report: FlightReport) -> bool:
    """The log's own amperes may be wrong, by a factor."""
    return any(w.code == "current_scale_doubtful" for w in report.recording.warnings)


def _notices(report: FlightReport, found: FlightFit) -> tuple[Notice, ...]:
    if not doubtful_current(report):
        return ()
    label_C = report.recording.capacity_C
    fitted_C = found.pack.capacity_C
    beside = ""
    if label_C is not None and fitted_C is not None:
        beside = (
            f" The log states {ampere_hours(label_C, 2)} Ah, the fit finds "
            f"{ampere_hours(fitted_C, 2)} Ah of the log's own: a worn pack, or a wrong scale."
        )
    text = (
        "The scale of the current is doubtful (see the quality of the log), and the fit takes it "
        f"as it is.{beside}"
    )
    return (Notice(text=text, severity=Severity.DOUBT, code="fit_of_doubtful_current"),)
