"""Of `result.json`: what each motion costs, and how that was judged."""

from typing import Literal

from reports.parts.flight import LoadPart
from reports.parts.part import NotNegative, Part, Share


class LossPart(Part):
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


class RatioPart(Part):
    """Of a motion's damage to that of a constant current."""

    value: float | None
    """Null where the damage is next to nothing, so that a ratio of it says nothing."""
    std: float | None
    """One standard deviation, by the spread of the motion's segments and what its profile misses;
    null for a single segment."""
    lower_95: float | None
    """Of the 95 % interval, Student's t of as few segments as there were; null as `std`."""
    upper_95: float | None


class DamagePart(Part):
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
    """By this motion's segments in this flight; null if its simulation ended before they did."""
    other_order_95: dict[str, float | None]
    """Measure -> the segments of this flight in another order would have changed what this motion
    costs per charge by less than this share, in 95 % of orders; null where it is not known."""
    counterfactuals: dict[str, dict[str, float | None]] | None
    """Feature -> measure -> share of the damage that goes with it (negative: that it holds back).
    Features: peaks, ripple, ramps, duty, temperature. Null unless the analysis was thorough."""


class RelativePart(Part):
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
    """Null if it could not be told: `not_assessed` in `assessment` says why, or the warning
    `no_damage` in `quality`."""
    relative_to_constant_current: RelativePart | None = None


class MotionsPart(Part):
    """The motions that are judged; null where the flight had none of it."""

    hover: MotionPart | None
    vertical: MotionPart | None
    horizontal: MotionPart | None


class BaselinePart(Part):
    """A constant current under the same protocol."""

    current_a: float
    flown_s: NotNegative
    per_flight: LossPart
    in_flight: LossPart


class FlightsPart(Part):
    """A number of flights."""

    flights: float | None
    """Null if the life ends before: `ended`."""
    lower_95: float | None
    """Of the 95 % interval: what is not known of pack and motion, and the error of the steps."""
    upper_95: float | None
    ended: str


class LifePart(Part):
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


class AssessmentPart(Part):
    """How the damage was judged."""

    cycles: int
    """That count, after those that only form the first films."""
    charge_rate: float
    ambient_c: float
    baselines: tuple[BaselinePart, ...]
    in_flight: LossPart | None
    """Of this flight as it was flown, without what lies on the ground: as it would cost a pack
    taken as new (three cycles old). One whose films are older loses less. Null if the simulation
    of it ended before it did; `not_assessed` says why."""
    not_assessed: dict[str, str]
    """Motion -> why not, or `flight` -> why not the whole of it as it was flown."""
    life: LifePart | None
    """Null unless the analysis was thorough."""
