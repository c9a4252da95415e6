"""Damage of each motion beside constant current at the same mean: `assess`.

Every waveform, every baseline and every counterfactual is a run of its own (`cycles.cycle`) under
one protocol. Runs are shared out to threads: the compiled kernel lets other threads run.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from twin.damage.baselines import Baselines, currents_A
from twin.damage.counterfactual import FEATURES
from twin.damage.cycles import CannotCycle, Cycled, Protocol, cycle
from twin.damage.error import UNKNOWN_ERROR, Error
from twin.damage.measures import MEASURES, NEXT_TO_NOTHING, Part, number
from twin.damage.spread import Piece, error_of, grouped
from twin.damage.waveform import Waveform, constant
from twin.effects import AGEING, AnyEffect, FilmResistance, Sei, SelfHeating
from twin.kernel import Backend
from twin.pack import Pack
from twin.pack_model import pack_model

FloatArray = npt.NDArray[np.float64]

TEMPERATURE = "temperature"
"""Beside FEATURES: the pack is held at the temperature of the air."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvre:
    """A motion as it is assessed.

    Attributes:
        name: of the motion.
        waveform: that stands for it.
        pieces: the segments it was made from; their spread is the motion's own.
        speed_m_s: through the air or over ground, for damage per distance; None if not known.
    """

    name: str
    waveform: Waveform
    pieces: tuple[Piece, ...] = ()
    speed_m_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """Of a motion to a constant current, and its error; NaN if not known."""

    value: float
    error: Error

    @property
    def interval_95(self) -> tuple[float, float]:
        """The truth lies in it in 95 % of cases; damage is no less than none."""
        half = self.error.half_95
        return max(self.value - half, 0.0), self.value + half

    def __mul__(self, factor: float) -> "Ratio":
        return Ratio(value=self.value * factor, error=self.error * factor)


UNKNOWN = Ratio(value=float("nan"), error=UNKNOWN_ERROR)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assessed:
    """One motion.

    Attributes:
        manoeuvre: what was assessed.
        cycled: what it costs.
        normalised: part -> measure -> over the reference baseline.
        excess: part -> measure -> over constant current at the same mean, per flight.
        energy: drawn in a flight, over that of constant current at the same mean.
        counterfactuals: feature -> the same without it; empty if they were not asked for.
        cannot: features whose counterfactual the pack cannot fly, with the reason.
    """

    manoeuvre: Manoeuvre
    cycled: Cycled
    normalised: Mapping[Part, Mapping[str, Ratio]]
    excess: Mapping[Part, Mapping[str, Ratio]]
    energy: float
    counterfactuals: Mapping[str, Cycled]
    cannot: Mapping[str, str]

    def without(self, feature: str, measure: str) -> float:
        """Damage that goes when `feature` goes, over the motion's own; < 0 if it grows."""
        of = number(measure, Part.WHOLE)
        own = of(self.cycled)
        if not own:
            return float("nan")
        return (own - of(self.counterfactuals[feature])) / own


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assessment:
    """All motions of a flight.

    Attributes:
        pack: as it was cycled: every effect of ageing is on.
        protocol: what was done with it.
        baselines: constant currents around the motions' means.
        motions: name -> what it costs.
        cannot: name -> why a motion could not be assessed.
    """

    pack: Pack
    protocol: Protocol
    baselines: Baselines
    motions: Mapping[str, Assessed]
    cannot: Mapping[str, str]


def ageing(pack: Pack) -> Pack:
    """`pack` with self-heating and every effect of ageing: those it lacks with their defaults.

    What resists in a cell that was fitted or told without SEI holds its first film: where SEI is
    added only what grows on that resists.
    """
    (whole,) = ageing_drawn(pack, lambda own: (own,))
    return whole


def ageing_drawn(pack: Pack, draw: Callable[[Pack], Sequence[Pack]]) -> tuple[Pack, ...]:
    """The same of each pack that `draw` makes of the one with all effects."""
    has = {type(effect) for effect in pack.effects}
    more: tuple[AnyEffect, ...] = tuple(k() for k in (SelfHeating, *AGEING) if k not in has)
    packs = draw(replace(pack, effects=(*pack.effects, *more)))
    return tuple(packs) if Sei in has else tuple(map(_without_first_film, packs))


def _without_first_film(pack: Pack) -> Pack:
    first = sum(e.first_film_ohm_m2 for e in pack.effects if isinstance(e, Sei))
    return replace(pack, effects=(*pack.effects, FilmResistance(negative_ohm_m2=-first)))


def assess(
    pack: Pack,
    manoeuvres: Sequence[Manoeuvre],
    protocol: Protocol,
    *,
    counterfactuals: bool = False,
) -> Assessment:
    """What each of `manoeuvres`, one or more, costs `pack`.

    Args:
        pack: whose effects of ageing count with their numbers; those it lacks are added.
        manoeuvres: each under a name of its own.
        protocol: of every run.
        counterfactuals: also cycle each motion without each of its features.

    Raises:
        CannotCycle: fewer than two constant currents can be cycled, so that there is nothing to
            compare with; with the reason.
    """
    whole = ageing(pack)
    isothermal = replace(
        whole, effects=tuple(e for e in whole.effects if not isinstance(e, SelfHeating))
    )
    steady = currents_A([m.waveform.mean_A for m in manoeuvres])
    sample_s = min(m.waveform.sample_s for m in manoeuvres)  # the same steps, the same errors
    tasks = {(m.name, ""): (whole, m.waveform) for m in manoeuvres}
    if counterfactuals:
        for m in manoeuvres:
            tasks |= {(m.name, f): (whole, make(m.waveform)) for f, make in FEATURES.items()}
            tasks[m.name, TEMPERATURE] = isothermal, m.waveform
    tasks |= {
        ("", f"{current_A!r}"): (whole, constant(current_A, sample_s)) for current_A in steady
    }
    done = _all(tasks, protocol)
    baselines = _baselines([done["", repr(amp)] for amp in steady])
    groups = {m.name: grouped(m.pieces) for m in manoeuvres if isinstance(done[m.name, ""], Cycled)}
    apart = _all(
        {
            (name, str(k)): (whole, wave)
            for m in manoeuvres
            if len(waves := groups.get(name := m.name, ())) > 1
            for k, wave in enumerate((m.waveform, *waves))
        },
        replace(protocol, formed=0, cycles=1),
        baselines.reference.end_state,
    )
    motions, cannot = {}, {}
    for m in manoeuvres:
        own = done[m.name, ""]
        if isinstance(own, Cycled):
            features = {f: run for (name, f), run in done.items() if name == m.name and f}
            first, *others = [apart[k] for k in apart if k[0] == m.name] or [own]
            beside = (first, [c for c in others if isinstance(c, Cycled)])
            motions[m.name] = _assessed(m, own, features, _Beside(baselines, *beside))
        else:
            cannot[m.name] = own
    return Assessment(
        pack=whole, protocol=protocol, baselines=baselines, motions=motions, cannot=cannot
    )


Key = tuple[str, str]
"""Name of a motion or "", and the feature left out, "" for none, or a baseline's current."""


def _all(
    tasks: Mapping[Key, tuple[Pack, Waveform]],
    protocol: Protocol,
    state: FloatArray | None = None,
) -> dict[Key, Cycled | str]:
    """Key -> what came of it, or why nothing did."""
    for pack, _ in tasks.values():
        pack_model(pack, None, Backend.AUTO)  # compiled here, once, not by every thread
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(partial(_one, protocol=protocol, state=state), tasks.values()))
    return dict(zip(tasks, results, strict=True))


def _one(task: tuple[Pack, Waveform], protocol: Protocol, state: FloatArray | None) -> Cycled | str:
    try:
        return cycle(*task, protocol, state)
    except CannotCycle as e:
        return str(e)


def _baselines(runs: Sequence[Cycled | str]) -> Baselines:
    good = tuple(run for run in runs if isinstance(run, Cycled))
    if len(good) < 2:
        reasons = {run for run in runs if isinstance(run, str)}
        raise CannotCycle(f"no constant currents to compare with: {'; '.join(sorted(reasons))}")
    return Baselines(good)


@dataclass(frozen=True, slots=True, eq=False)
class _Beside:
    """What a motion is compared with.

    Attributes:
        baselines: constant currents.
        once: the motion flown once from a state all share, or why it could not be.
        groups: of its segments, each flown once from that state.
    """

    baselines: Baselines
    once: Cycled | str
    groups: Sequence[Cycled]

    def error(self, value: float, of: Callable[[Cycled], float], *, same_mean: bool) -> Error:
        """Of the ratio `value` to constant current, at the same mean or all to one."""
        if not isinstance(self.once, Cycled):
            return UNKNOWN_ERROR

        def level(c: Cycled) -> float:
            return self.baselines.near(c.waveform.mean_A, of) if same_mean else 1.0

        own = of(self.once) / level(self.once)
        ratios = [value * of(c) / level(c) / own for c in self.groups]
        return error_of(value, ratios, [c.waveform.period_s for c in self.groups])


def _assessed(
    m: Manoeuvre, own: Cycled, features: Mapping[str, Cycled | str], beside: _Beside
) -> Assessed:
    energy = own.energy_J / beside.baselines.at(m.waveform.mean_A, lambda c: c.energy_J)
    both = {p: {name: _compared(own, name, p, beside) for name in MEASURES} for p in Part}
    return Assessed(
        manoeuvre=m,
        cycled=own,
        normalised={p: {name: pair[0] for name, pair in v.items()} for p, v in both.items()},
        excess={p: {name: pair[1] for name, pair in v.items()} for p, v in both.items()},
        energy=energy,
        counterfactuals={f: run for f, run in features.items() if isinstance(run, Cycled)},
        cannot={f: run for f, run in features.items() if isinstance(run, str)},
    )


def _compared(own: Cycled, measure: str, part: Part, beside: _Beside) -> tuple[Ratio, Ratio]:
    """Over the reference baseline, and over constant current at the same mean."""
    of, mean_A, baselines = number(measure, part), own.waveform.mean_A, beside.baselines
    same_mean = baselines.at(mean_A, of)
    if abs(same_mean) <= NEXT_TO_NOTHING * abs(baselines.at(mean_A, number(measure, Part.WHOLE))):
        return UNKNOWN, UNKNOWN
    both = of(own) / of(baselines.reference), of(own) / same_mean
    normalised, excess = (
        Ratio(value=value, error=beside.error(value, of, same_mean=same))
        for value, same in zip(both, (False, True), strict=True)
    )
    return normalised, excess
