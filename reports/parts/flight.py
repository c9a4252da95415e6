"""Of `result.json`: the log, the pack, what is doubtful, and what was drawn."""

from datetime import datetime
from typing import Literal

from reports.parts.part import MotionName, NotNegative, Part, Sha256, Share


class FlightPart(Part):
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
    """Of the flight analysed, without landings in between and gaps of the recording."""


class QuantityPart(Part):
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


class FitErrorsPart(Part):
    """Root mean square of recorded minus simulated pack voltage, in the air."""

    before: float | None
    after: float | None
    holdout_before: float
    """Of the flight averaged over short spans, before the fit."""
    holdout_after: float
    """Each quarter of the flight predicted by a fit to the others."""


class FitPart(Part):
    """The pack fitted to this flight, for want of a pack file."""

    quantities: tuple[QuantityPart, ...]
    rmse_mv: FitErrorsPart
    independent_samples: NotNegative
    """What the flight counts for; its residuals are correlated."""


class PackPart(Part):
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
    rated_ah: float | None
    """As log or pack file state it, before any fit; null if neither does."""
    origins: dict[str, str]
    """Where each value that had to be chosen comes from, in words."""
    fit: FitPart | None
    """Null with a pack file, or where the flight was not fitted."""
    fit_refusal: str
    """Why the flight was not fitted; empty if it was, or with a pack file."""


class WarningPart(Part):
    """Something usable, but doubtful."""

    code: str
    message: str
    where: str


class GapsPart(Part):
    """Stretches without current samples, bridged on a straight line in the replay."""

    count: int
    total_s: NotNegative
    longest_s: NotNegative
    bridged_charge_ah: float


class QualityPart(Part):
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


class AlignmentPart(Part):
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


class LoadPart(Part):
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
