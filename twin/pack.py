"""`Pack`: cells in series and parallel, how they start, and which effects act in them."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import prod

import numpy as np
import numpy.typing as npt

from twin.at_rest import OVERFULL, open_circuit_V, soc_of_others, starts_V
from twin.cell import Cell
from twin.effects import (
    AGEING,
    OF_CELL,
    AnyEffect,
    ColdPack,
    FilmResistance,
    InitialSoc,
    Mechanics,
    OcvHysteresis,
    SeriesResistance,
    StressEnhancedDiffusion,
    VoltageGain,
    WeakCell,
)
from twin.parameters import (
    ageing_parameters,
    cell_parameters,
    hysteresis_parameters,
    mechanics_parameters,
)
from twin.windows import window_C

FloatArray = npt.NDArray[np.float64]

OKANE_2022 = Mechanics()
SAME_V = 1e-12  # a voltage at rest is that which was told, but for rounding


class PackError(ValueError):
    """A pack that cannot be; the text says which number and what it may be."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellKind:
    """Cells of a pack that are alike in every number.

    Attributes:
        name: "others", or which weak cell: "cell 2", or "weak_cell" where its place is not known.
        values: the kernel's parameters, of one cell.
        initial_soc: state of charge at the start.
        initial_K: temperature at the start.
        count: how many places in the series they have.
    """

    name: str
    values: dict[str, float]
    initial_soc: float
    initial_K: float
    count: int

    def soc(self, negative_mean: FloatArray) -> FloatArray:
        """State of charge at a mean stoichiometry of the negative electrode."""
        low, high = (self.values[f"negative.stoichiometry_{end}"] for end in ("min", "max"))
        return (negative_mean - low) / (high - low)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pack:
    """Cells of one make, equal but for each `WeakCell`; PackError if a number is impossible.

    Attributes:
        cell: parameters of one cell.
        series: cells in series.
        parallel: strings in parallel.
        capacity_C: of the pack; the cell's area, mass and cooling surface are scaled to it. None
            takes the cell as it is.
        initial_soc: state of charge at the start, 0..1 of the cell's stoichiometry window.
        soc_by_rest: `initial_soc` is by the recorded voltage at rest of the whole pack and the
            curve of `cell`. That voltage stays, not the charge: beside a weak cell that starts
            emptier the others start fuller; other windows, hysteresis, a sensor that reads too
            high, or a temperature at which the cell rests beside its curve mean another charge.
            More than 1, OVERFULL at most, is a voltage above that of a full cell: full, if
            nothing of that says otherwise.
        initial_K: temperature at the start.
        heat_transfer_W_m2_K: to the air, where it is stated. The pack is warmed by its losses only
            with `SelfHeating`, which has a number of its own; this one is what to expect of it.
        heat_transfer_std_W_m2_K: its standard error, where that is stated.
        standard_errors: effect -> number -> what reference tests of the cell, or who calibrated
            an instrument, leave open of it, relative where it is searched by its logarithm:
            `twin.mismatch.tested`.
        cell_error_V: rms by which the twin misses the voltage of one cell in tests that it was not
            fitted to; 0 where nobody stated it.
        effects: what acts beyond the isothermal P2D model.
        mechanics: elastic constants, for the effects that need them.
        moved: (name, difference) of the kernel's numbers from those of `cell`: another cell that
            what is known of this one allows, without a kernel of its own.
    """

    cell: Cell
    series: int = 1
    parallel: int = 1
    capacity_C: float | None = None
    initial_soc: float = 1.0
    soc_by_rest: bool = False
    initial_K: float = 298.15
    heat_transfer_W_m2_K: float | None = None
    heat_transfer_std_W_m2_K: float | None = None
    standard_errors: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    cell_error_V: float = 0.0
    effects: tuple[AnyEffect, ...] = ()
    mechanics: Mechanics = OKANE_2022
    moved: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        for name, low, high in (
            ("series", 1, 1000),
            ("parallel", 1, 10_000),
            ("initial_soc", 0.0, OVERFULL if self.soc_by_rest else 1.0),
            ("initial_K", 200.0, 400.0),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise PackError(f"{name} = {value}: expected {low} to {high}")
        for name in ("series", "parallel"):
            if (count := getattr(self, name)) != int(count):
                raise PackError(f"{name} = {count}: expected a whole number")
        if self.capacity_C is not None and not 0 < self.capacity_C < 1e9:
            raise PackError(f"capacity_C = {self.capacity_C}: expected a positive number")
        check_weak(self.weak, self.series)
        for weak in self.weak:
            if not 0.0 <= min(self.initial_soc, 1.0) + weak.soc_offset <= OVERFULL:
                raise PackError(
                    f"weak_cell: soc_offset = {weak.soc_offset} beside initial_soc = "
                    f"{self.initial_soc}: expected 0 to {OVERFULL} together"
                )

    @property
    def rated_C(self) -> float:
        """Its capacity as stated, or that of its cells; over 3600 s the current called 1C."""
        return self.capacity_C or self.parallel * self.cell.nominal_capacity_C

    @property
    def terminals(self) -> float:
        """What is recorded over the voltage of a mean cell: its series, by a sensor's gain."""
        return self.series * prod(e.gain for e in self.effects if isinstance(e, VoltageGain))

    @property
    def scale(self) -> float:
        """Capacity of one cell of this pack over that of `cell`."""
        return self.rated_C / (self.parallel * self.cell.nominal_capacity_C)

    def charged(self) -> "Pack":
        """It with the fullest of its cells full, whatever it started a recording with."""
        fuller = max((0.0, *(w.soc_offset for w in self.weak)))
        own = tuple(e for e in self.effects if not isinstance(e, InitialSoc))
        return replace(self, initial_soc=1.0 - fuller, soc_by_rest=False, effects=own)

    def emptier(self, drawn_C: float) -> "Pack":
        """It after so much was drawn, at rest: of each cell that is a share of its own window."""
        less = drawn_C / self.window_C
        start = self.numbers()["initial_soc"] - less
        kept = (e for e in self.effects if not isinstance(e, InitialSoc))
        own = tuple(
            replace(e, soc_offset=e.soc_offset - less * (1 / e.capacity_factor - 1))
            if isinstance(e, WeakCell)
            else e
            for e in kept
        )
        told = min(self.initial_soc, 1.0)
        moved = InitialSoc(offset=start - told)
        return replace(self, initial_soc=told, soc_by_rest=False, effects=(*own, moved))

    def cell_parameters(self) -> dict[str, float]:
        """The kernel's parameters for one cell of this pack.

        More capacity is more coated area and more mass of the same make; the outer surface grows
        with volume ** (2/3), as that of similar bodies.
        """
        values = cell_parameters(self.cell)
        values["area_m2"] *= self.scale
        values["heat_capacity_J_K"] *= self.scale
        values["cooling_area_m2"] *= self.scale ** (2 / 3)
        for name, difference in self.moved:
            values[name] += difference
        for effect in self.effects:
            if isinstance(effect, SeriesResistance):  # of the pack, shared out to its cells
                own_ohm = effect.resistance_ohm * self.parallel / self.series
                values["series_resistance_ohm"] += own_ohm
                values["outside_ohm"] += own_ohm * effect.outside
            if isinstance(effect, FilmResistance):
                values["negative.film_ohm_m2"] += effect.negative_ohm_m2
                values["positive.film_ohm_m2"] += effect.positive_ohm_m2
            if isinstance(effect, OF_CELL):
                values = effect.changed(values, self.cell)
        values |= mechanics_parameters(self.mechanics) if self.stressed else {}
        for effect in self.effects:
            if isinstance(effect, OcvHysteresis):
                values |= hysteresis_parameters(self.cell, effect)
        return values | (ageing_parameters(self.effects, self.mechanics) if self.ages else {})

    @property
    def start_K(self) -> float:
        """Temperature at the start, with all effects."""
        offsets = (e.start_offset_K for e in self.effects if isinstance(e, ColdPack))
        return self.initial_K + sum(offsets)

    @property
    def window_C(self) -> float:
        """Charge between states of charge of 0 and 1, with all effects [C]; not what is rated."""
        return self.parallel * window_C(self.cell_parameters())

    @property
    def weak(self) -> tuple[WeakCell, ...]:
        """The cells that differ from the others."""
        return tuple(e for e in self.effects if isinstance(e, WeakCell))

    def numbers(self) -> dict[str, float]:
        """Name -> value of all that makes a difference to the cells, which `cells` takes back.

        `cell_parameters()`, how they start, and those of the weak cells, the first as
        `weak_cell.capacity_factor`, the second as `weak_cell#2.capacity_factor`, ...
        """
        values = self.cell_parameters()
        start = {"initial_soc": self._start_soc(values), "initial_K": self.start_K}
        for effect in self.effects:
            if isinstance(effect, InitialSoc):
                start["initial_soc"] += effect.offset
        differ = {
            f"{prefix}.{p.name}": float(getattr(weak, p.name))
            for prefix, weak in self._named_weak()
            for p in weak.parameters
        }
        return values | start | differ

    def cells(self, numbers: Mapping[str, float] | None = None) -> tuple[CellKind, ...]:
        """The kinds of cells: the equal ones, if there are any, then each weak one.

        `numbers` are values for all of `numbers()`; None takes the pack's own.
        """
        values = dict(numbers or self.numbers())
        soc, temperature_K = values.pop("initial_soc"), values.pop("initial_K")
        weak = {
            prefix: weak.at({p.name: values.pop(f"{prefix}.{p.name}") for p in weak.parameters})
            for prefix, weak in self._named_weak()
        }
        kinds = [
            CellKind(
                name=f"cell {w.cell}" if w.cell else prefix,
                values=w.changed(values, self.parallel),
                initial_soc=soc + w.soc_offset,
                initial_K=temperature_K,
                count=1,
            )
            for prefix, w in weak.items()
        ]
        if equal := self.series - len(weak):
            kinds.insert(
                0,
                CellKind(
                    name="others",
                    values=values,
                    initial_soc=soc,
                    initial_K=temperature_K,
                    count=equal,
                ),
            )
        return tuple(kinds)

    @property
    def counts(self) -> tuple[int, ...]:
        """(kinds,) how many there are of each of `cells`."""
        weak = len(self.weak)
        return (self.series - weak,) * (self.series > weak) + (1,) * weak

    def places(self) -> tuple[int, ...]:
        """(series,) which of `cells` is where; one whose place is not known has the first free."""
        equal = int(self.series > len(self.weak))
        taken = {w.cell: equal + i for i, w in enumerate(self.weak) if w.cell}
        anywhere = [equal + i for i, w in enumerate(self.weak) if not w.cell]
        free = [place for place in range(1, self.series + 1) if place not in taken]
        taken |= dict(zip(free, anywhere, strict=False))
        return tuple(taken.get(place, 0) for place in range(1, self.series + 1))

    def _start_soc(self, values: Mapping[str, float]) -> float:
        """Of the equal cells, whose `cell_parameters` are `values`."""
        if not self.soc_by_rest:
            return self.initial_soc
        offsets, gain = [w.soc_offset for w in self.weak], self.terminals / self.series
        rests_V = starts_V(self.cell, values, self.start_K)
        told_V = open_circuit_V(self.cell, self.initial_soc) / gain
        if self.initial_soc > 1.0:
            told_V = min(told_V, open_circuit_V(self.cell, 1.0))
        soc = min(self.initial_soc, 1.0)
        if not any(offsets) and abs(rests_V(soc) - told_V) < SAME_V:
            return soc
        return soc_of_others(rests_V, self.series, offsets, told_V)

    def _named_weak(self) -> list[tuple[str, WeakCell]]:
        return [(w.id if n == 1 else f"{w.id}#{n}", w) for n, w in enumerate(self.weak, start=1)]

    @property
    def stressed(self) -> bool:
        """Diffusion is enhanced by stress."""
        return any(isinstance(e, StressEnhancedDiffusion) for e in self.effects)

    @property
    def hysteretic(self) -> bool:
        """Open-circuit potentials depend on which way lithium went."""
        return any(isinstance(e, OcvHysteresis) for e in self.effects)

    @property
    def ages(self) -> bool:
        """Some effect changes the cell for good."""
        return any(isinstance(e, AGEING) for e in self.effects)


def check_weak(weak: Sequence[WeakCell], series: int) -> None:
    """PackError if so many cells in series cannot differ so."""
    for cell in weak:
        if cell.cell not in range(series + 1):
            raise PackError(
                f"weak_cell: cell = {cell.cell}: expected 1 to {series}, or 0 for any one"
            )
        for p in cell.parameters:
            if not p.lower <= (value := getattr(cell, p.name)) <= p.upper:
                raise PackError(f"weak_cell: {p.name} = {value}: expected {p.lower} to {p.upper}")
    named = Counter(cell.cell for cell in weak if cell.cell)
    for place, times in named.items():
        if times > 1:
            raise PackError(f"weak_cell: cell = {place} in {times} of them: expected one a cell")
    if len(weak) > series:
        raise PackError(f"{len(weak)} weak cells: expected {series} at most")
