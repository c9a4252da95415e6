"""`Pack`: equal cells in series and parallel, how they start, and which effects act in them."""

from dataclasses import dataclass

from twin.cell import Cell
from twin.effects import (
    AGEING,
    AnyEffect,
    FilmResistance,
    Mechanics,
    SeriesResistance,
    StressEnhancedDiffusion,
)
from twin.parameters import ageing_parameters, cell_parameters, mechanics_parameters

OKANE_2022 = Mechanics()


class PackError(ValueError):
    """A pack that cannot be; the text says which number and what it may be."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pack:
    """Equal cells; PackError if a number is impossible.

    Attributes:
        cell: parameters of one cell.
        series: cells in series.
        parallel: strings in parallel.
        capacity_C: of the pack; the cell's area, mass and cooling surface are scaled to it. None
            takes the cell as it is.
        initial_soc: state of charge at the start, 0..1 of the cell's stoichiometry window.
        initial_K: temperature at the start.
        effects: what acts beyond the isothermal P2D model.
        mechanics: elastic constants, for the effects that need them.
    """

    cell: Cell
    series: int = 1
    parallel: int = 1
    capacity_C: float | None = None
    initial_soc: float = 1.0
    initial_K: float = 298.15
    effects: tuple[AnyEffect, ...] = ()
    mechanics: Mechanics = OKANE_2022

    def __post_init__(self) -> None:
        for name, low, high in (
            ("series", 1, 1000),
            ("parallel", 1, 10_000),
            ("initial_soc", 0.0, 1.0),
            ("initial_K", 200.0, 400.0),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise PackError(f"{name} = {value}: expected {low} to {high}")
        if self.capacity_C is not None and not 0 < self.capacity_C < 1e9:
            raise PackError(f"capacity_C = {self.capacity_C}: expected a positive number")

    @property
    def scale(self) -> float:
        """Capacity of one cell of this pack over that of `cell`."""
        if self.capacity_C is None:
            return 1.0
        return self.capacity_C / (self.parallel * self.cell.nominal_capacity_C)

    def cell_parameters(self) -> dict[str, float]:
        """The kernel's parameters for one cell of this pack.

        More capacity is more coated area and more mass of the same make; the outer surface grows
        with volume ** (2/3), as that of similar bodies.
        """
        values = cell_parameters(self.cell)
        values["area_m2"] *= self.scale
        values["heat_capacity_J_K"] *= self.scale
        values["cooling_area_m2"] *= self.scale ** (2 / 3)
        for effect in self.effects:
            if isinstance(effect, SeriesResistance):  # of the pack, shared out to its cells
                share = self.parallel / self.series
                values["series_resistance_ohm"] += effect.resistance_ohm * share
            if isinstance(effect, FilmResistance):
                values["negative.film_ohm_m2"] += effect.negative_ohm_m2
                values["positive.film_ohm_m2"] += effect.positive_ohm_m2
        values |= mechanics_parameters(self.mechanics) if self.stressed else {}
        return values | (ageing_parameters(self.effects, self.mechanics) if self.ages else {})

    @property
    def stressed(self) -> bool:
        """Diffusion is enhanced by stress."""
        return any(isinstance(e, StressEnhancedDiffusion) for e in self.effects)

    @property
    def ages(self) -> bool:
        """Some effect changes the cell for good."""
        return any(isinstance(e, AGEING) for e in self.effects)
