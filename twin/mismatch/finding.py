"""What came out: `Finding`, as it is written and shown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


class Verdict(Enum):
    """What may be said of a mismatch."""

    NONE = "none"
    """Nothing beyond the noise."""
    NAMED = "named"
    """One effect, or one combination, stands out; what looks alike is among its equivalents."""
    AMBIGUOUS = "ambiguous"
    """Several remain that only another test could tell apart."""
    UNKNOWN = "unknown"
    """It is real, and no effect explains it on what was not fitted."""


NEGLIGIBLE = 1e-3  # of a standard deviation


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """A number of an effect, with one standard deviation and its unit."""

    name: str
    value: float
    std: float
    unit: str

    @property
    def shown(self) -> float:
        """As it is printed: none where it is far less than its deviation, at a bound of the fit."""
        return self.value if abs(self.value) > NEGLIGIBLE * self.std else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedEffect:
    """An effect that was left out.

    Attributes:
        id: of the effect.
        pack_id: what a pack file calls it.
        probability: that it, or one of its equivalents, is part of what was left out.
        parameters: at their best.
        instead: effects that these recordings cannot tell from it, the likeliest first, each with
            its own.
        equation: LaTeX.
        source: reference.
        signature: what it leaves in a recording, in words.
    """

    id: str
    pack_id: str
    probability: float
    parameters: tuple[Value, ...]
    instead: Mapping[str, tuple[Value, ...]]
    equation: str
    source: str
    signature: str

    @property
    def equivalent(self) -> tuple[str, ...]:
        """Effects that these recordings cannot tell from it, the likeliest first."""
        return tuple(self.instead)


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Where the residual exceeds the noise.

    Attributes:
        flight: name of the recording.
        start_s: first moment.
        stop_s: last one.
        motion: what the vehicle did most of that time, or "".
        mean_V: of recorded minus simulated.
        share: of all squares beyond the noise, in all recordings.
    """

    flight: str
    start_s: float
    stop_s: float
    motion: str
    mean_V: float
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """A quantity that the residual follows, and the share of it that this explains elsewhere."""

    quantity: str
    explained: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A model that was looked at.

    Attributes:
        ids: of its effects; none: nothing but the starts.
        held_out_rms_V: recorded minus simulated on what was not fitted.
        delta_bic: twice the logarithm of evidence lost against the best; 0 for the best.
        probability: among all that were looked at.
        excess: variance of what it leaves, slow parts counted whole, over what noise and the
            twin's own error would leave; 1 where nothing more is to be said.
    """

    ids: tuple[str, ...]
    held_out_rms_V: float
    delta_bic: float
    probability: float
    excess: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """Of a residual that no effect explains: `size_V` per standard deviation of a quantity."""

    quantity: str
    size_V: float
    explained: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Root mean squares of recorded minus simulated [V]; `noise` is their floor."""

    noise: float
    before: float
    after: float
    held_out_before: float
    held_out_after: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """What one effect does to the voltage of a recording (n,), the others being there."""

    effect: str
    voltage_V: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """One recording, before and after.

    Attributes:
        name: of the recording.
        held_out: it was not fitted, at least not where `judged_ahead`.
        time_s: (n,)
        residual_V: (n,) recorded minus simulated, twin as configured.
        after_V: (n,) with what was named.
        motion: (n,)
        judged: (n,) samples that count.
        judged_ahead: (n,) those that were held out.
        parts: of what was named.
    """

    name: str
    held_out: bool
    time_s: FloatArray
    residual_V: FloatArray
    after_V: FloatArray
    motion: npt.NDArray[np.str_]
    judged: npt.NDArray[np.bool_]
    judged_ahead: npt.NDArray[np.bool_]
    parts: tuple[Part, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Finding:
    """The mismatch of some recordings and a twin.

    Attributes:
        verdict: what may be said.
        effects: what was left out, as far as it has a name.
        spans: where.
        drivers: what it follows.
        errors: before and after.
        candidates: what was looked at, the best first.
        terms: of an unknown one, what it depends on.
        advice: the test that would tell more, or "".
        courses: the recordings.
        remarks: what is doubtful in all this.
        starts: recording -> state of charge at its start and its standard deviation, of those where
            nothing tells it.
    """

    verdict: Verdict
    effects: tuple[NamedEffect, ...]
    spans: tuple[Span, ...]
    drivers: tuple[Driver, ...]
    errors: Errors
    candidates: tuple[Candidate, ...]
    terms: tuple[Term, ...] = ()
    advice: str = ""
    courses: tuple[Course, ...] = field(default=())
    remarks: tuple[str, ...] = ()
    starts: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def causes_sought(self) -> bool:
        """Some effect was tried."""
        return any(c.ids for c in self.candidates)

    @property
    def contradictory(self) -> bool:
        """Each recording says something else, and nothing was taken for all of them."""
        taken = any(c.parts for c in self.courses)
        return self.verdict is Verdict.AMBIGUOUS and bool(self.courses) and not taken

    def remarked(self, more: Sequence[str]) -> "Finding":
        """With further remarks."""
        return replace(self, remarks=(*self.remarks, *more))
