"""`Proof`: trials that were opened, with all that is shown of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from proof.truth import Truth

FloatArray = npt.NDArray[np.float64]


class Outcome(Enum):
    """A verdict beside the truth."""

    RIGHT = "right"
    PART = "part"
    """Some of what is there was named, and nothing that is not."""
    WRONG = "wrong"
    """Something was named that is not there."""
    MISSED = "missed"
    """Something is there, and nothing was named."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stamp:
    """One entry of the ledger.

    Attributes:
        utc: ISO 8601, to the millisecond.
        sha256: of what was sealed, written or opened.
        entry: hash of the entry, the one before it included.
    """

    utc: str
    sha256: str
    entry: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """An effect of a verdict."""

    id: str
    probability: float
    equivalent: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sized:
    """A number whose true value is known; `found` is None where its effect was not named."""

    effect: str
    name: str
    unit: str
    true: float
    found: float | None
    std: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseline:
    """What else might have mended the voltage, judged on what was held out.

    Attributes:
        id: "refit" (numbers of the base twin), "correction" (of the voltage, without physics),
            "random" (an effect drawn by chance with as many numbers as what was named).
        what: which, in words.
        numbers: that were fitted.
        held_out_V: rms of recorded minus predicted.
    """

    id: str
    what: str
    numbers: int
    held_out_V: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Opened:
    """A channel that was concealed, beside what the twins say of it; SI.

    Attributes:
        recording: name of it.
        channel: "temperature", "weakest cell", "other cells".
        unit: "K" or "V".
        time_s: (n,)
        measured: (n,)
        before: (n,) by the twin as configured.
        after: (n,) with what was named, of effects that look alike the first that acts on this
            channel: which that is, is known when it is opened. None if nothing was named.
        rms_before: of predicted minus measured.
        rms_after: likewise.
        rms_named: likewise with what was named alone, whatever looks like it.
    """

    recording: str
    channel: str
    unit: str
    time_s: FloatArray
    measured: FloatArray
    before: FloatArray
    after: FloatArray | None
    rms_before: float
    rms_after: float | None
    rms_named: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """One trial.

    Attributes:
        name: of it.
        source: whose truth it is.
        truth: that was sealed.
        verdict: "none", "named", "ambiguous", "unknown"; "failed" if the tool came to none, and
            "stopped" if it was from outside: these have no errors (NaN).
        named: what was named.
        outcome: the verdict beside the truth.
        noise_V: rms of what is chance in what was held out.
        held_out_before_V: recorded minus simulated there, by the twin as configured.
        held_out_after_V: with what was named.
        baselines: what else might have mended it.
        sized: numbers whose truth is known.
        channels: revealed.
        capacity_C: of the pack with what was named; None if it is not asked for.
        sealed: before anything was judged.
        judged: when the verdict was written.
        opened: afterwards.
        seconds: that the verdict took.
        not_compared: why there are no baselines, channels and capacity; "" where they are.
        remarks: of the verdict, or how its judge ended.
    """

    name: str
    source: str
    truth: Truth
    verdict: str
    named: tuple[Named, ...]
    outcome: Outcome
    noise_V: float
    held_out_before_V: float
    held_out_after_V: float
    baselines: tuple[Baseline, ...]
    sized: tuple[Sized, ...]
    channels: tuple[Opened, ...]
    capacity_C: float | None
    sealed: Stamp
    judged: Stamp
    opened: Stamp
    seconds: float
    not_compared: str = ""
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class NotMade:
    """A trial that could not be made or judged, and why."""

    name: str
    source: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proof:
    """All trials of a run.

    Attributes:
        seed: that effects and strengths were drawn from.
        command: to run it again.
        trials: in their order.
        not_made: trials that are not among them.
        versions: program -> version.
        code: hash of what sealed, judged and compared.
        head: hash of the ledger's last entry on a trial.
        seconds: of the whole run.
    """

    seed: int
    command: str
    trials: tuple[Judged, ...]
    not_made: tuple[NotMade, ...]
    versions: Mapping[str, str]
    code: str
    head: str
    seconds: float
