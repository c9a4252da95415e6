"""What may have been left out: each effect as a hypothesis with the numbers that are fitted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, log, sqrt

import numpy as np
import numpy.typing as npt

from twin.effects import (
    MEASURED,
    ActivationEnergies,
    AnyEffect,
    ColdPack,
    CurrentOffset,
    InitialSoc,
    Leakage,
    OcvHysteresis,
    Plating,
    SelfHeating,
    WeakCell,
)
from twin.effects.effect import Parameter
from twin.effects.likely import SENSOR
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

APART_K = 10.0
"""By which a pack at the start usually differs from the air that it flies in: most are as warm, a
few come out of a heated room into air of 0 to 25 degC."""
STATED = log(1.2)
"""Of a stated heat transfer, at least: calibrations of one cell to several choices of its tests
scatter by 4 to 10 % in four real cells."""
PRIOR = 0.02
"""Of an effect, before anything is seen; of the controls, that nothing is left out, 1 / (1 + 20 x)
of it remains when twenty of them are looked for."""
LOSSES_HEAT = 0.5
"""The same of heating by losses, in a twin that has none though its pack states how it cools: the
losses are there, and only their heat may be too little to be seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """An effect and those of its numbers that a recording may tell.

    Attributes:
        id: as results name it.
        kind: the effect.
        fitted: names of its numbers.
        starts: values of `fitted` where a fit starts; several where it is not convex. Without any
            it starts at the centre of the prior.
    """

    id: str
    kind: type[AnyEffect]
    fitted: tuple[str, ...]
    starts: tuple[tuple[float, ...], ...]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those fitted."""
        known = {p.name: p for p in self.kind.parameters}
        return tuple(known[name] for name in self.fitted)

    @property
    def no_rest(self) -> bool:
        """Where its sensor shows no current the pack does not rest: it strips, leaks or gives."""
        return self.kind in (CurrentOffset, Leakage, Plating)

    def present(self, pack: Pack) -> AnyEffect | None:
        """The effect as the pack has it."""
        return next((e for e in pack.effects if isinstance(e, self.kind)), None)

    def possible(self, pack: Pack) -> bool:
        """The pack can have it: of one cell in series none is weaker than the others."""
        return self.kind is not WeakCell or pack.series > 1

    def before(self, pack: Pack) -> float:
        """Probability that it is left out of `pack`, before anything is seen."""
        stated = pack.heat_transfer_W_m2_K is not None and self.present(pack) is None
        return LOSSES_HEAT if self.kind is SelfHeating and stated else PRIOR

    def priors(self, pack: Pack) -> tuple[Parameter, ...]:
        """`fitted`, `value` being the centre: that of the pack, else nothing or what is usual.

        Cooling that the pack states is known within its error, or STATED if that is more, though
        its losses do not heat it yet. What reference tests say of a number is known as well as
        they say it.
        """
        own, stated = self.present(pack), pack.heat_transfer_W_m2_K
        if self.kind is SelfHeating and own is None and stated is not None:
            (p,) = self.parameters
            value = max(stated, p.lower)
            error = (pack.heat_transfer_std_W_m2_K or 0.0) / value
            return (replace(p, value=value, prior_std=min(max(error, STATED), p.prior_std)),)
        if own is None:
            values = [CENTRES.get((self.id, p.name), p.value) for p in self.parameters]
        else:
            values = [getattr(own, p.name) for p in self.parameters]
        by_tests = pack.standard_errors.get(self.id, {})
        return tuple(
            replace(
                p,
                value=max(value, p.lower) if p.logarithmic else value,
                prior_std=min(by_tests.get(p.name, p.prior_std), p.prior_std),
            )
            for p, value in zip(self.parameters, values, strict=True)
        )

    @property
    def mixes(self) -> FloatArray:
        """(k, k) from numbers that do not depend on each other to `fitted`; deviations of priors.

        Lower triangular, rows of length 1: that a pack is cold says that the air is.
        """
        if self.kind is not ColdPack:
            return np.eye(len(self.fitted))
        (deviation_K,) = {p.prior_std for p in self.parameters}
        along = 1.0 - (APART_K / deviation_K) ** 2 / 2.0
        return np.array([[1.0, 0.0], [along, sqrt(1.0 - along**2)]])

    def begins(self, pack: Pack) -> tuple[tuple[float, ...], ...]:
        """`starts`, or the one that `pack` gives."""
        return self.starts or (tuple(p.value for p in self.priors(pack)),)

    def within(self, pack: Pack, values: Sequence[float]) -> Pack:
        """`pack` with the effect in it at these values of `fitted`."""
        given = dict(zip(self.fitted, values, strict=True))
        own = self.present(pack)
        if own is None:
            make: Callable[..., AnyEffect] = self.kind
            return replace(pack, effects=(*pack.effects, make(**given)))
        changed: Callable[..., AnyEffect] = replace
        new = changed(own, **given)
        return replace(pack, effects=tuple(new if e is own else e for e in pack.effects))

    def bounds(self, pack: Pack) -> tuple[tuple[float, float], ...]:
        """(least, most) of each of `fitted`.

        No cell starts emptier than empty or above full, and none is weak by conducting better, nor
        by holding more than new cells scatter by.
        """
        limits = {p.name: (p.lower, p.upper) for p in self.parameters}
        start = min(pack.initial_soc, 1.0)
        for name in ("offset", "soc_offset"):
            if name in limits and self.kind in (InitialSoc, WeakCell):
                limits[name] = (-start, 1.0 - start)
        if self.kind is WeakCell:
            own = self.present(pack)
            for name, (least, most) in WEAK.items():
                stated = getattr(own, name, least)  # a pack's own number stays possible
                limits[name] = (min(least, stated), max(most, stated))
        return tuple(limits[name] for name in self.fitted)


WEAK: Mapping[str, tuple[float, float]] = {
    "capacity_factor": (0.1, 1.05),
    "resistance_ohm": (0.0, 0.5),
}
"""Of a cell that is weak, not the only strong one; new cells of a batch scatter by 1.9 % of their
capacity (Dubarry, Vuillaume, Liaw, Int. J. Energy Res. 34, 216 (2010))."""


def value_of(p: Parameter, coordinate: float) -> float:
    """At so many standard deviations of the prior from its centre."""
    if p.logarithmic:
        return p.value * exp(p.prior_std * coordinate)
    return p.value + p.prior_std * coordinate


def coordinate_of(p: Parameter, value: float) -> float:
    """Inverse of `value_of`."""
    if p.logarithmic:
        return log(value / p.value) / p.prior_std
    return (value - p.value) / p.prior_std


CENTRES: Mapping[tuple[str, str], float] = {("series_resistance", "outside"): 0.5}
"""Of priors of effects that a pack does not have, where that is not their number without a word."""

SEVERAL: Mapping[str, tuple[tuple[str, ...], tuple[tuple[float, ...], ...]]] = {
    "weak_cell": (
        ("capacity_factor", "soc_offset", "resistance_ohm"),
        ((0.95, 0.0, 0.001), (1.0, -0.05, 0.001), (1.0, 0.0, 0.01)),
    ),
    "reaction_kinetics": (("negative_factor", "positive_factor"), ((1.0, 1.0),)),
    "series_resistance": (("resistance_ohm", "outside"), ((0.0, 0.5),)),
    "clock_shift": (
        ("shift_s", "noise_A"),
        tuple((0.25 * k, SENSOR.value) for k in range(-12, 13)),
    ),
}
"""Fitted numbers and starts of effects for which they are not just all, from the prior's centre.

Of a clock all shifts that it may have: gusts that do not overlap draw a fit nowhere, and between
samples every shift averages noise, a minimum of its own half a sample from none."""


OF_CHARGE = (
    "current_gain", "current_offset", "initial_soc", "lithium_inventory_loss",
    "active_material_loss_negative", "active_material_loss_positive",
)  # fmt: skip
"""Effects of one number that say when the pack is empty. Where it is, the voltage falls as from a
cliff: descent from no effect stops at the edge, so a fit begins beyond it as well, near and far."""
SIDES = (-1.0, -0.25, 0.25, 1.0)  # standard deviations of the prior


def _plain(kind: type[AnyEffect]) -> Hypothesis:
    names = tuple(p.name for p in kind.parameters)
    own = tuple(p.value for p in kind.parameters)
    fitted, starts = SEVERAL.get(kind.id, (names, (own,)))
    if kind.id in OF_CHARGE:
        (p,) = kind.parameters
        sides = SIDES[:2] if kind is InitialSoc else SIDES  # most packs start near full
        ways = [value_of(p, side) for side in sides]
        starts = (own, *((value,) for value in ways if p.lower <= value <= p.upper))
    return Hypothesis(id=kind.id, kind=kind, fitted=fitted, starts=starts)


HYPOTHESES: tuple[Hypothesis, ...] = (
    Hypothesis(id="self_heating", kind=SelfHeating, fitted=("heat_transfer_W_m2_K",), starts=()),
    Hypothesis(
        id="ocv_hysteresis",
        kind=OcvHysteresis,
        fitted=("negative_amplitude_V", "positive_amplitude_V", "negative_decay", "positive_decay"),
        starts=((0.005, 0.005, 20.0, 20.0),),
    ),
    Hypothesis(
        id="plating_stripping",
        kind=Plating,
        fitted=("initial_mol_m3", "rate_constant_m_s"),
        starts=((100.0, 1e-9),),
    ),
    *(_plain(kind) for kind in MEASURED.values() if kind is not ActivationEnergies),
)
"""All that may be named."""

UNCERTAIN: tuple[Hypothesis, ...] = (*HYPOTHESES, _plain(ActivationEnergies))
"""All that a pack may be known within errors of. Activation energies are a number of the make, and
what they do in one recording a temperature does as well: they are not named."""
