"""`FlightReport`: everything a page, or `result.json`, says of one flight."""

from collections.abc import Mapping
from dataclasses import dataclass

from flightlogs.log import FlightLog
from flightlogs.recording import Recording
from segment.profile import PeriodicProfile, TooLittle
from segment.segment import Motion, Segment
from twin.calibrate.flight import FlightFit, NotFitted
from twin.damage import Study
from twin.effects import AnyEffect, Mechanics
from twin.mismatch import UNTOLD, Finding
from twin.replay import Replay

ASSESSED = (Motion.HOVER, Motion.VERTICAL, Motion.HORIZONTAL)
"""The motions that are judged one by one; the others connect them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitting:
    """What came of fitting the pack to the flight.

    Attributes:
        outcome: the fit, or why there is none.
        before_V: voltage error of the replay before it, RMS in the air; None without voltage.
    """

    outcome: FlightFit | NotFitted
    before_V: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PackUse:
    """The pack as it was simulated, and how each of its numbers is known.

    Attributes:
        name: from `pack.toml`, else "".
        cell: name of the cell.
        cell_source: where its numbers come from.
        calibrated: False if the cell is a built-in one that was never fitted to this pack.
        series: cells in series.
        series_inferred: True if judged from the voltage.
        parallel: cells side by side.
        capacity_C: of the pack.
        rated_C: its capacity as log or pack file state it, before any fit; None if neither does.
        capacity_known: False if it is only that of the cell that stands in.
        soc_by_rest: it is by the voltage of the whole pack, see `Pack`.
        temperature_known: False if it was not measured.
        cooling_known: False if nobody stated the heat transfer.
        serial: the pack's own number, "" if unknown.
        initial_soc: state of charge at the start of the recording, 0..1; more if a voltage at rest
            is above that of a full cell, see `Pack`.
        soc_std: its standard deviation; `UNTOLD` if neither a rest nor the pack file tells it.
        initial_K: temperature of the pack at the start.
        ambient_K: temperature of the air.
        heat_transfer_W_m2_K: from the cell to the air.
        heat_transfer_std_W_m2_K: its standard error; None if nobody stated one.
        standard_errors: of effects' numbers by reference tests, as in `Pack`.
        cell_error_V: that the twin is stated to make, as in `Pack`.
        effects: the physical effects that were switched on.
        mechanics: elastic constants, for the effects that need them.
        origins: field -> where its value comes from, in words, for every field that was a choice.
        fitting: to this flight; None if that was not asked for, as with a pack file.
    """

    name: str
    cell: str
    cell_source: str
    calibrated: bool
    series: int
    series_inferred: bool
    parallel: int
    capacity_C: float
    rated_C: float | None
    capacity_known: bool
    soc_by_rest: bool
    temperature_known: bool
    cooling_known: bool
    serial: str
    initial_soc: float
    soc_std: float
    initial_K: float
    ambient_K: float
    heat_transfer_W_m2_K: float
    heat_transfer_std_W_m2_K: float | None
    standard_errors: Mapping[str, Mapping[str, float]]
    cell_error_V: float
    effects: tuple[AnyEffect, ...]
    mechanics: Mechanics
    origins: Mapping[str, str]
    fitting: Fitting | None = None

    @property
    def shown_soc(self) -> float:
        """State of charge at the start, 0..1."""
        return min(self.initial_soc, 1.0)

    @property
    def soc_known(self) -> bool:
        """Something tells how full the pack was at the start."""
        return self.soc_std < UNTOLD

    @property
    def fit(self) -> FlightFit | None:
        """To this flight, if there is one."""
        if self.fitting is None or isinstance(self.fitting.outcome, NotFitted):
            return None
        return self.fitting.outcome

    @property
    def effect_ids(self) -> tuple[str, ...]:
        """Of the effects, each once."""
        return tuple(dict.fromkeys(e.id for e in self.effects))


@dataclass(frozen=True, slots=True, kw_only=True)
class Gaps:
    """Stretches without current samples, which the replay had to bridge.

    Attributes:
        count: how many there are.
        total_s: their total duration.
        longest_s: the longest.
        charge_C: what the replay drew in them, on a straight line between their ends.
    """

    count: int = 0
    total_s: float = 0.0
    longest_s: float = 0.0
    charge_C: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What made this result, enough to make it again.

    Attributes:
        sha256: of the log file.
        sensor_name: sensor file that was used or refused, "" if none.
        sensor_sha256: of that file, "" if none, or if it could not be read.
        pack_sha256: of the pack file, its cell and what its calibration left, "" if none.
        inputs_sha256: of all of these, options and version; equal inputs give an equal result.
        version: of this program.
        solver: the twin's solver and its figures, in words.
        seconds: wall time from opening the log to the finished result.
    """

    sha256: str
    sensor_name: str
    sensor_sha256: str
    pack_sha256: str
    inputs_sha256: str
    version: str
    solver: str
    seconds: float


@dataclass(frozen=True, slots=True)
class NoMismatch:
    """Why twin and recording were not compared, in a sentence."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlightReport:
    """One analysed flight.

    Attributes:
        log: what was read.
        recording: the battery and flight that were chosen.
        segments: the flight cut into motions.
        profiles: motion -> its waveform, or why there is none.
        alignment_refusal: why a sensor recording was not used, "" if it was or there is none.
        gaps: stretches of the recording without current.
        pack: what was simulated.
        replay: the twin's answer; its status says how far it came.
        provenance: what made this result.
        damage: what it did to the pack; None if that could not be told.
        no_damage: why, in a sentence; "" if it was told.
        mismatch: where twin and recording differ, or why that was not judged.
    """

    log: FlightLog
    recording: Recording
    segments: tuple[Segment, ...]
    profiles: Mapping[Motion, PeriodicProfile | TooLittle]
    alignment_refusal: str
    gaps: Gaps
    pack: PackUse
    replay: Replay
    provenance: Provenance
    damage: Study | None = None
    no_damage: str = ""
    mismatch: Finding | NoMismatch = NoMismatch("It was not looked for.")
