"""What a proof has to reach, written before it was run, beside what it reached."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import isfinite

from proof.outcome import Judged, Opened, Outcome
from proof.tally import Share, control, real_effect, recorded, simulated, strong
from proof.truth import Channel

REAL_TRIALS = 12  # recordings on real cells that a share of them needs at least
REAL_CELLS = 4  # and so many cells
RIGHT, RIGHT_REAL = 0.9, 0.8  # shares
TEMPERATURE_K, WEAK_CELL_V, CAPACITY = 2.0, 0.015, 0.03  # rms, rms, relative
OVER_NOISE = 1.5  # of a held-out error


class Status(Enum):
    """Of a target."""

    MET = "met"
    MISSED = "missed"
    NOT_RUN = "not run"


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A number and its limit.

    Attributes:
        id: of it.
        what: in words.
        limit: SI; shares and ratios as such.
        at_least: False: at most.
        unit: "1", "K", "V", or "" of a count.
        measured: of shares and counts the whole, else the worst one; None if there is none.
        within: how many keep the limit by themselves; of a share how many are right.
        of: how many there are.
        absent: how many have no number though they should; they miss the limit.
        lacking: what the number needs besides and does not have, in words; "" if nothing.
    """

    id: str
    what: str
    limit: float
    at_least: bool
    unit: str
    measured: float | None
    within: int
    of: int
    absent: int = 0
    lacking: str = ""

    @property
    def status(self) -> Status:
        """Met only if nothing is absent or lacking."""
        if not self.of:
            return Status.NOT_RUN
        whole = not self.absent and not self.lacking
        return Status.MET if whole and self.short == 0.0 else Status.MISSED

    @property
    def kept(self) -> Share:
        """How many keep the limit."""
        return Share(count=self.within, of=self.of)

    @property
    def short(self) -> float:
        """By how much the limit is missed, in its unit; 0 if it is kept or nothing was measured."""
        if self.measured is None:
            return 0.0
        off = self.limit - self.measured if self.at_least else self.measured - self.limit
        return max(off, 0.0)


def rightly_named(trial: Judged) -> bool:
    """What is in a recording of a real cell was named."""
    return real_effect(trial) and trial.outcome is Outcome.RIGHT


OF_CELLS = (("recorded", "recorded", recorded), ("simulated", "simulated", simulated))
OF_HEAT = (
    ("recorded named", "recorded, where heat or cold was rightly named", rightly_named),
    ("recorded", "recorded, of all: where none was named, the temperature that was told", recorded),
    OF_CELLS[1],
)
"""Ending of an id, words and members."""


def targets(trials: Sequence[Judged]) -> tuple[Target, ...]:
    """All of them, those without a trial included; held-out errors are of what named something."""
    return (
        _share("strong", "right, simulated effects at 3 × noise or more", RIGHT,
               filter(strong, trials)),
        _false_alarms(trials),
        _real(trials),
        _worst(
            "capacity", "charge of the check-up held out, relative error", CAPACITY, "1",
            _capacities(trials),
        ),
        *(
            _worst(
                f"{name} {group}", f"concealed {said}, rms, {where}", limit, unit,
                concealed(filter(member, trials), channel),
            )
            for name, channel, said, limit, unit, groups in (
                ("temperature", "temperature", "temperature", TEMPERATURE_K, "K", OF_HEAT),
                ("weak cell", "weakest cell", "voltage of the weakest cell", WEAK_CELL_V, "V",
                 OF_CELLS),
            )
            for group, where, member in groups
        ),
        _worst(
            "held out simulated", "held-out error over the true noise, simulated",
            OVER_NOISE, "1", _ratios(trials, simulated),
        ),
        _worst(
            "held out floor", "held-out error over noise and the base twin's own error, recorded",
            OVER_NOISE, "1", _ratios(trials, recorded),
        ),
    )  # fmt: skip


def concealed(trials: Iterable[Judged], channel: str) -> list[float | None]:
    """Rms of a channel in every recording in which it was concealed; None if no twin reaches it."""
    out: list[float | None] = []
    for t in trials:
        opened = {c.recording: predicted_rms(c) for c in t.channels if c.channel == channel}
        kept = [c.recording for c in t.truth.channels if _measured(c, channel)]
        out += [opened.get(name) for name in dict.fromkeys((*kept, *opened))]
    return out


def _measured(kept: Channel, channel: str) -> bool:
    """Whether what was kept from the judge has this channel."""
    values = kept.temperature_K if channel == "temperature" else kept.cell_voltage_V
    return values is not None


def predicted_rms(channel: Opened) -> float:
    """Of what the tool says in the end: the twin as configured, where it named nothing.

    With what it named, as --adopt takes it, not with what looks like that and acts on the channel.
    """
    return channel.rms_before if channel.rms_named is None else channel.rms_named


def capacity_error(trial: Judged) -> float | None:
    """Found over measured, less 1; None if either is not there."""
    found, true = trial.capacity_C, trial.truth.capacity_C
    return None if found is None or not true else found / true - 1.0


def over_noise(trial: Judged) -> float | None:
    """Error on what was held out, with what was named, over the noise as the tool estimates it."""
    return _over(trial.held_out_after_V, trial.noise_V)


def over_floor(trial: Judged) -> float | None:
    """The same over the sealed floor: the true noise and, of a real cell, the twin's own error."""
    return _over(trial.held_out_after_V, trial.truth.ahead_V)


def _over(error_V: float, least_V: float) -> float | None:
    return error_V / least_V if least_V > 0 and isfinite(error_V) else None


def _share(name: str, what: str, limit: float, trials: Iterable[Judged]) -> Target:
    right = [t.outcome is Outcome.RIGHT for t in trials]
    return Target(
        id=name, what=what, limit=limit, at_least=True, unit="1", within=sum(right), of=len(right),
        measured=sum(right) / len(right) if right else None,
    )  # fmt: skip


def _false_alarms(trials: Iterable[Judged]) -> Target:
    """A control of which more is said than is right, or on which the tool fails.

    Of a simulated one that is anything but nothing; of a recorded one any name, see NO_NAME.
    """
    false = [t.outcome is not Outcome.RIGHT for t in trials if control(t)]
    return Target(
        id="false alarms", what="false alarms of controls, simulated and recorded", limit=0.0,
        at_least=False, unit="", measured=float(sum(false)) if false else None,
        within=len(false) - sum(false), of=len(false),
    )  # fmt: skip


def _real(trials: Sequence[Judged]) -> Target:
    """Controls do not count: with them the share would be larger for nothing."""
    own = [t for t in trials if real_effect(t)]
    share = _share("real", "right, recorded on real cells, controls not counted", RIGHT_REAL, own)
    cells = len({t.source for t in own})
    few = [
        f"{count} of at least {least} {what}"
        for count, least, what in (
            (len(own), REAL_TRIALS, "trials"), (cells, REAL_CELLS, "cells"),
        )
        if count < least
    ]  # fmt: skip
    return replace(share, lacking=", ".join(few))


def _worst(
    name: str, what: str, limit: float, unit: str, values: Sequence[float | None]
) -> Target:  # fmt: skip
    there = [v for v in values if v is not None and isfinite(v)]
    return Target(
        id=name, what=what, limit=limit, at_least=False, unit=unit,
        measured=max(there, default=None), within=sum(v <= limit for v in there), of=len(values),
        absent=len(values) - len(there),
    )  # fmt: skip


def _capacities(trials: Iterable[Judged]) -> list[float | None]:
    asked = [t for t in trials if t.truth.capacity_C is not None]
    errors = [capacity_error(t) for t in asked]
    return [None if e is None else abs(e) for e in errors]


def _ratios(trials: Iterable[Judged], member: Callable[[Judged], bool]) -> list[float | None]:
    return [over_floor(t) for t in trials if member(t) and t.verdict == "named"]
