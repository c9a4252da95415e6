"""`result.json`: the models that write it, read it, and make its schema.

`python -m reports.result > reports/result.schema.json` renews the schema; a test holds it current.
"""

import json
import sys
from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

SCHEMA_VERSION: Literal[1] = 1
Share = Annotated[float, Field(ge=0.0, le=1.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
MotionName = Literal["ground", "takeoff", "landing", "hover", "vertical", "horizontal", "mixed"]


class _Part(BaseModel):
    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
        json_schema_serialization_defaults_required=True,
    )


class FlightPart(_Part):
    """The log and the flight chosen in it."""

    file: str
    """Name of the log, without its folder."""
    sha256: Sha256
    format: str
    firmware: str
    vehicle: str
    start_utc: datetime | None
    """Of the first sample of the log."""
    duration_s: NotNegative
    """Of the whole log."""
    in_air_s: NotNegative
    """From take-off to landing of the flight analysed."""


class QuantityPart(_Part):
    """A number that was fitted to the flight."""

    name: str
    value: float
    std: NotNegative
    lower: float
    """Of the 90 % interval."""
    upper: float
    unit: str
    assumed: float
    """Before the fit; where its prior has its mean."""
    verdict: Literal["identified", "partly", "prior", "at_bound"]
    """What the flight tells of it; `prior`: nothing, it was left as assumed."""


class FitErrorsPart(_Part):
    """Root mean square of recorded minus simulated pack voltage, in the air."""

    before: float | None
    after: float | None
    holdout_before: float
    """Of the flight averaged over short spans, before the fit."""
    holdout_after: float
    """Each quarter of the flight predicted by a fit to the others."""


class FitPart(_Part):
    """The pack fitted to this flight, for want of a pack file."""

    quantities: tuple[QuantityPart, ...]
    rmse_mv: FitErrorsPart
    independent_samples: NotNegative
    """What the flight counts for; its residuals are correlated."""


class PackPart(_Part):
    """The battery of the log, and the pack that was simulated in its place."""

    name: str
    battery: str
    """What the log calls it."""
    other_batteries: tuple[str, ...]
    serial: str
    cell: str
    calibrated: bool
    """False: a built-in cell stands in for the pack's own."""
    series: int
    series_inferred: bool
    """True: judged from the voltage."""
    parallel: int
    capacity_ah: NotNegative
    origins: dict[str, str]
    """Where each value that had to be chosen comes from, in words."""
    fit: FitPart | None
    """Null with a pack file, or where the flight was not fitted."""
    fit_refusal: str
    """Why the flight was not fitted; empty if it was, or with a pack file."""


class WarningPart(_Part):
    """Something usable, but doubtful."""

    code: str
    message: str
    where: str


class GapsPart(_Part):
    """Stretches without current samples, bridged on a straight line in the replay."""

    count: int
    total_s: NotNegative
    longest_s: NotNegative
    bridged_charge_ah: float


class QualityPart(_Part):
    """What is doubtful, and the checks."""

    warnings: tuple[WarningPart, ...]
    dropouts_s: NotNegative
    recovered_fraction: Share
    coulomb_check: float | None
    """Integral of the current over the difference of the log's own counter."""
    resistance_mohm: float | None
    """Slope of voltage on current under load, whole pack."""
    gaps: GapsPart
    current_source: Literal["sensor", "autopilot"]


class AlignmentPart(_Part):
    """The sensor's clock on the autopilot's; null without a sensor, or if it was refused."""

    method: str
    offset_s: float
    drift_ppm: float
    correlation: float
    uncertainty_s: NotNegative
    drift_uncertainty_ppm: NotNegative
    gain: float | None
    """Of the sensor against the autopilot's current."""
    bias_a: float | None


class LoadPart(_Part):
    """What was drawn; discharge is positive."""

    charge_ah: float
    energy_wh: float | None
    """Null where no voltage was logged."""
    mean_current_a: float
    rms_current_a: float
    p99_current_a: float | None
    ripple_a: float


class SegmentPart(LoadPart):
    """Half-open span of one motion, on the log's clock."""

    motion: MotionName
    start_s: float
    stop_s: float
    basis: str
    """What the motion was decided by."""


class LossPart(_Part):
    """What was lost for good."""

    lithium_mah: float
    """Charge the lost lithium carried: by side reactions, and trapped in lost material."""
    lithium_loss: float
    """The same over all lithium in the particles of the new pack."""
    negative_loss: float
    """Share of the negative electrode's active material."""
    positive_loss: float
    sei_mah: float
    sei_on_cracks_mah: float
    plating_mah: float
    """Plated and cut off; what strips in the next flight is not lost."""
    total_mah: float
    """By the three reactions."""


class RatioPart(_Part):
    """Of a motion's damage to that of a constant current."""

    value: float | None
    """Null where the damage is next to nothing, so that a ratio of it says nothing."""
    std: float | None
    """One standard deviation, by the spread of the motion's segments and what its profile misses;
    null for a single segment."""
    lower_95: float | None
    """Of the 95 % interval, Student's t of as few segments as there were; null as `std`."""
    upper_95: float | None


class DamagePart(_Part):
    """What the motion costs: its profile flown from full to the cut-off, recharged, repeated."""

    flown_s: NotNegative
    """From full to the cut-off."""
    charge_ah: float
    energy_wh: float
    distance_km: float | None
    """Null where the log has no velocity."""
    capacity_per_flight_mah: float
    per_flight: LossPart
    """By a flight and the charge after it."""
    in_flight: LossPart
    """The part of it that is lost in the air."""
    per_minute: LossPart
    per_ah: LossPart
    per_wh: LossPart
    per_km: LossPart | None
    peak_temperature_c: float
    plating_margin_mv: float
    """Least potential of the negative electrode against lithium, which plates below 0."""
    negative_stress_mpa: tuple[float, float]
    """Hydrostatic, at the surface of the particles, tension positive: least and greatest."""
    positive_stress_mpa: tuple[float, float]
    as_flown: LossPart | None
    """By this motion's segments in this flight; null if the replay did not come so far."""
    other_order_95: dict[str, float | None]
    """Measure -> the segments of this flight in another order would have changed what this motion
    costs per charge by less than this share, in 95 % of orders; null where it is not known."""
    counterfactuals: dict[str, dict[str, float | None]] | None
    """Feature -> measure -> share of the damage that goes with it (negative: that it holds back).
    Features: peaks, ripple, ramps, duty, temperature. Null unless the analysis was thorough."""


class RelativePart(_Part):
    """Damage over that of a constant current, by measure."""

    energy: float
    """Drawn in a flight, over that of constant current at the same mean."""
    per_flight: dict[str, RatioPart]
    """Of a flight and its charge, over constant current at the same mean."""
    in_flight: dict[str, RatioPart]
    """Of the flight alone, likewise."""
    normalised: dict[str, RatioPart]
    """Of a flight and its charge, over the lowest of the constant currents."""


class MotionPart(LoadPart):
    """All segments of a motion together."""

    time_s: NotNegative
    damage: DamagePart | None = None
    """Null if it could not be told: `assessment` says why."""
    relative_to_constant_current: RelativePart | None = None


class MotionsPart(_Part):
    """The motions that are judged; null where the flight had none of it."""

    hover: MotionPart | None
    vertical: MotionPart | None
    horizontal: MotionPart | None


class BaselinePart(_Part):
    """A constant current under the same protocol."""

    current_a: float
    flown_s: NotNegative
    per_flight: LossPart
    in_flight: LossPart


class FlightsPart(_Part):
    """A number of flights."""

    flights: float | None
    """Null if the life ends before: `ended`."""
    lower_95: float | None
    """Of the 95 % interval: what is not known of pack and motion, and the error of the steps."""
    upper_95: float | None
    ended: str


class LifePart(_Part):
    """Flights to a share of the first capacity, if the pack is always flown like this."""

    share: Share
    as_flown: FlightsPart
    """With half an hour of rest before and after each charge."""
    daily: FlightsPart
    """With half a day before and after each charge: what standing costs."""
    limited: FlightsPart
    """As flown, the peaks above the limit taken off and their charge drawn below it."""
    limit_a: float
    """Limit on the current of the what-if."""
    motions: dict[str, FlightsPart]
    """Of each motion alone, in flights that draw the charge of this one."""
    mix_of_motions: float | None
    """What `motions` say of the mix of this flight: one over the mean of one over flights, by the
    charge that each drew. Beside `as_flown` it tells how well other mixes can be told so."""
    cell_uncertain: bool
    """The intervals hold what the calibration of the cell left open."""
    ageing: Literal["fitted", "assumed", "exact"]
    """The constants of ageing, in the intervals: as a fit to a life left them open; as they differ
    from cell to cell; or taken as exact."""


class AssessmentPart(_Part):
    """How the damage was judged."""

    cycles: int
    """That count, after those that only form the first films."""
    charge_rate: float
    ambient_c: float
    baselines: tuple[BaselinePart, ...]
    in_flight: LossPart
    """Of the whole recording, as it was flown."""
    not_assessed: dict[str, str]
    """Motion -> why not."""
    life: LifePart | None
    """Null unless the analysis was thorough."""


class LithiumPart(_Part):
    """The lithium of one cell, at the end over the start."""

    negative_mol: tuple[float, float]
    """In the negative electrode, at start and end."""
    positive_mol: tuple[float, float]
    electrolyte_mol: tuple[float, float]
    lost_mol: dict[str, tuple[float, float]]
    """In SEI, on cracks, plated, dead, trapped; empty where no ageing is switched on."""
    relative_error: float
    """Change of the sum over the sum."""
    charge_error_c: float
    """Charge of the load minus what the positive electrode took up."""


class ReplayPart(_Part):
    """The twin's answer to the recorded current."""

    voltage_rmse_mv: float | None
    """Root mean square of recorded minus simulated pack voltage, from take-off to landing."""
    max_error_mv: float | None
    final_soc: float | None
    max_temperature_c: float | None
    """Simulated."""
    lithium_audit: LithiumPart
    status: str
    """`done`, or why the simulation ended early."""
    status_text: str
    simulated_s: NotNegative
    """How far the simulation came."""


class EffectValuePart(_Part):
    """A number of an effect, fitted."""

    name: str
    value: float | None
    std: float | None
    unit: str


class EffectPart(_Part):
    """An effect that the twin as configured does not have, and the recording has."""

    id: str
    probability: Share
    """That it, or one of its equivalents, is part of what was left out."""
    equivalent: tuple[str, ...]
    """Others that this recording cannot tell from it."""
    parameters: tuple[EffectValuePart, ...]
    equation: str
    """LaTeX."""
    source: str


class MismatchSpanPart(_Part):
    """Where the mean of recorded minus simulated exceeds the noise."""

    flight: str
    start_s: float
    stop_s: float
    motion: str
    mean_mv: float | None
    share: Share
    """Of all squares beyond the noise."""


class DriverPart(_Part):
    """A quantity that the residual follows."""

    quantity: str
    explained: float | None
    """Share of the residual's squares, where the curve was not fitted."""


class LocationPart(_Part):
    """Where and with what it goes."""

    spans: tuple[MismatchSpanPart, ...]
    drivers: tuple[DriverPart, ...]


class MismatchErrorsPart(_Part):
    """Root mean square of recorded minus simulated; blocks of the flight are held out in turn."""

    noise_floor: float | None
    before: float | None
    after: float | None
    holdout_before: float | None
    holdout_after: float | None


class CandidatePart(_Part):
    """What was tried: effects joined by `+`, or `none`."""

    id: str
    holdout_rmse_mv: float | None
    delta_bic: float | None
    probability: Share
    excess: float | None
    """Variance of what it leaves over what noise and the twin's own error would leave."""


class TermPart(_Part):
    """Of a residual without a name: what it depends on."""

    quantity: str
    size_mv: float | None
    """For one standard deviation of the quantity."""
    explained: float | None


class MismatchPart(_Part):
    """Where and why twin and recording differ, in short; `twin explain` tells it in full."""

    verdict: Literal["none", "named", "ambiguous", "unknown"]
    effects: tuple[EffectPart, ...]
    location: LocationPart
    rmse_mv: MismatchErrorsPart
    candidates: tuple[CandidatePart, ...]
    """Without a pack file no cause is looked for: `none` alone."""
    terms: tuple[TermPart, ...]
    advice: str
    """The test that would separate what remains; empty if there is none."""
    remarks: tuple[str, ...]
    """What keeps the verdict from being a diagnosis."""


class ParametersPart(_Part):
    """The numbers that were chosen for the twin."""

    initial_soc: Share
    initial_temperature_c: float
    ambient_c: float
    heat_transfer_W_m2_K: float
    physics: tuple[str, ...]
    inputs_sha256: Sha256
    """Of log, sensor, pack file and options; equal inputs give an equal result."""


class ProvenancePart(_Part):
    """What made this result."""

    version: str
    cell: str
    """Where the numbers of the cell come from."""
    parameters: ParametersPart
    solver: str
    seconds: NotNegative
    """Wall time from opening the log to the finished result."""


class Result(_Part):
    """One analysed flight."""

    schema_version: Literal[1] = SCHEMA_VERSION
    flight: FlightPart
    pack: PackPart
    quality: QualityPart
    alignment: AlignmentPart | None
    segments: tuple[SegmentPart, ...]
    motions: MotionsPart
    replay: ReplayPart
    assessment: AssessmentPart | None
    """Null if the damage could not be judged; `quality` says why."""
    mismatch: MismatchPart | None
    """Null if it could not be judged; the page says why."""
    provenance: ProvenancePart


def schema_text() -> str:
    """The JSON Schema of `result.json`, as it is shipped."""
    schema = Result.model_json_schema(mode="serialization")
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=1) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text())
