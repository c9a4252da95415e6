"""Of `result.json`: where and why twin and recording differ."""

from collections.abc import Mapping
from typing import Literal

from reports.parts.part import Part, Share


class EffectValuePart(Part):
    """A number of an effect, fitted."""

    name: str
    value: float | None
    std: float | None
    unit: str


class EffectPart(Part):
    """An effect that the twin as configured does not have, and the recording has."""

    id: str
    probability: Share
    """That it, or one of its equivalents, is part of what was left out."""
    equivalent: tuple[str, ...]
    """Others that this recording cannot tell from it."""
    parameters: tuple[EffectValuePart, ...]
    instead: Mapping[str, tuple[EffectValuePart, ...]] = {}
    """Numbers of each of `equivalent`, were it that one."""
    equation: str
    """LaTeX."""
    source: str


class MismatchSpanPart(Part):
    """Where the mean of recorded minus simulated exceeds the noise."""

    flight: str
    start_s: float
    stop_s: float
    motion: str
    mean_mv: float | None
    share: Share
    """Of all squares beyond the noise."""


class DriverPart(Part):
    """A quantity that the residual follows."""

    quantity: str
    explained: float | None
    """Share of the residual's squares, where the curve was not fitted."""


class LocationPart(Part):
    """Where and with what it goes."""

    spans: tuple[MismatchSpanPart, ...]
    drivers: tuple[DriverPart, ...]


class MismatchErrorsPart(Part):
    """Root mean square of recorded minus simulated; blocks of the flight are held out in turn."""

    noise_floor: float | None
    before: float | None
    after: float | None
    holdout_before: float | None
    holdout_after: float | None


class CandidatePart(Part):
    """What was tried: effects joined by `+`, or `none`."""

    id: str
    holdout_rmse_mv: float | None
    delta_bic: float | None
    probability: Share
    excess: float | None
    """Variance of what it leaves over what noise and the twin's own error would leave."""


class TermPart(Part):
    """Of a residual without a name: what it depends on."""

    quantity: str
    size_mv: float | None
    """For one standard deviation of the quantity."""
    explained: float | None


class MismatchPart(Part):
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
