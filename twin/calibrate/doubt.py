"""Packs that may be the one at hand as well: `draws`, from what a calibration left open.

The cell is drawn from the covariance of its fit, the constants of ageing from that of a fit to a
life; where there was none they are drawn from their priors (`degradation.SPREAD`), and where the
cell was not calibrated nothing is known of its numbers, so they stay. A drawn cell needs no kernel
of its own: its numbers are inputs.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.bpx_file import ROUNDING
from twin.calibrate.asked import Asked, asked_from
from twin.calibrate.cell_map import FILLERS, CellMap, Infeasible, full_and_empty_V
from twin.calibrate.degradation import aged_by, ageing_parameters
from twin.calibrate.parameters import (
    EMPTY_ENDS,
    START_V,
    WARMING,
    Parameter,
    Scale,
    cell_table,
)
from twin.calibrate.table import CalibrationError
from twin.effects import SelfHeating
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

SAME = ("particle_radius_m", "porosity")
"""Suffixes of what fit and cell share as it is; the rest is relative to the cell of the start."""
NEAR = 1e-3  # files round
TRIES = 50  # draws for one that is possible
SEED = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Doubt:
    """What a fit leaves open.

    Attributes:
        names: (k,) of its parameters.
        value: (k,) estimates.
        std: (k,) standard errors, in the units of `value`.
        correlations: (k, k) of the estimates, on the scale each has its prior on.
        asked: by its tests; None if the file does not say.
    """

    names: tuple[str, ...]
    value: FloatArray
    std: FloatArray
    correlations: FloatArray
    asked: Asked | None = None

    def factors(self, random: np.random.Generator) -> FloatArray:
        """(k,) standard deviations from the estimate, one draw."""
        values, vectors = np.linalg.eigh(self.correlations)  # rounded: perhaps a little below 0
        free = np.sqrt(np.maximum(values, 0.0)) * random.standard_normal(values.size)
        return np.asarray(vectors @ free)


@dataclass(frozen=True, slots=True, kw_only=True)
class Other:
    """A cell that the tests allow as well.

    Attributes:
        moved: as `Pack.moved`.
        cools: its heat transfer to the air over that of the pack's.
    """

    moved: tuple[tuple[str, float], ...]
    cools: float = 1.0

    def instead(self, pack: Pack) -> Pack:
        """`pack` made of such cells; ValueError if its effects take more than these have."""
        effects = tuple(
            replace(e, heat_transfer_W_m2_K=self.cools * e.heat_transfer_W_m2_K)
            if isinstance(e, SelfHeating)
            else e
            for e in pack.effects
        )
        other = replace(pack, moved=self.moved, effects=effects)
        other.numbers()
        return other


def read_doubt(text: str, *, name: str) -> Doubt:
    """Of a fit that `twin calibrate` wrote beside a pack file; CalibrationError if it is none."""
    try:
        document = json.loads(text)
        names = tuple(document["correlations"]["names"])
        found = {p["name"]: (float(p["value"]), float(p["std"])) for p in document["parameters"]}
        rows = np.array([found[n] for n in names])
        matrix = np.array(document["correlations"]["matrix"], dtype=float)
        if matrix.shape != (len(names), len(names)) or not np.isfinite(matrix).all():
            raise ValueError(f"correlations {matrix.shape} of {len(names)} parameters")
        asked = asked_from(document["asked"]) if "asked" in document else None
    except (ValueError, KeyError, TypeError, IndexError) as e:
        raise CalibrationError(
            f"{name}: not the fit of a calibration ({type(e).__name__}: {e}): run twin calibrate "
            "again, or take the file away"
        ) from e
    return Doubt(names=names, value=rows[:, 0], std=rows[:, 1], correlations=matrix, asked=asked)


def draws(
    pack: Pack, count: int, *, cell: Doubt | None = None, aged: Doubt | None = None
) -> tuple[Pack, ...]:
    """`count` packs that may be `pack` as well; the same ones each time.

    Args:
        pack: as it was calibrated, with its effects of ageing.
        count: how many.
        cell: of its cell; None if that was not calibrated.
        aged: of its ageing; None if that was not fitted.

    Raises:
        CalibrationError: `cell` is not of the cell of `pack`, or allows no cell.
    """
    random = np.random.default_rng(SEED)
    mapped = None if cell is None else _Drawn(pack, cell)
    out = []
    for _ in range(count):
        values = _ageing_values(pack, aged, random)
        other = aged_by(pack, values)
        out.append(replace(other, moved=mapped.moved(random)) if mapped else other)
    return tuple(out)


def cells_drawn(pack: Pack, doubt: Doubt, count: int) -> tuple[Other, ...]:
    """`count` cells that may be that of `pack` as well, cooling included; errors as `draws`."""
    random, mapped = np.random.default_rng(SEED), _Drawn(pack, doubt, warming=True)
    drawn = (dict(mapped.moved(random)) for _ in range(count))
    own = next((e.heat_transfer_W_m2_K for e in pack.effects if isinstance(e, SelfHeating)), 0.0)
    return tuple(
        Other(cools=1.0 + m.pop(WARMING[1], 0.0) / (own or 1.0), moved=tuple(m.items()))
        for m in drawn
    )


def _ageing_values(
    pack: Pack, doubt: Doubt | None, random: np.random.Generator
) -> Mapping[str, float]:
    table = {p.name: p for p in ageing_parameters(pack)}
    if doubt is None:
        return {n: _at(p, p.mean, p.std, float(random.standard_normal())) for n, p in table.items()}
    steps = zip(doubt.names, doubt.value, doubt.std, doubt.factors(random), strict=True)
    return {
        name: _at(p, p.mean, std / value if p.scale is Scale.LOG else std, float(z))
        for name, value, std, z in steps
        if (p := table.get(name))
    }


class _Drawn:
    """Cells about that of a pack."""

    def __init__(self, pack: Pack, doubt: Doubt, *, warming: bool = False) -> None:
        self._doubt = doubt
        table = cell_table(pack, warm_and_cold=True, warming=warming)
        self._table = {p.name: p for p in table}
        cell = pack.cell
        ends = cell.negative.stoichiometry_min, cell.positive.stoichiometry_max
        own = {n: p.mean for n, p in self._table.items() if n not in EMPTY_ENDS}
        own |= {n: v for n, v in zip(EMPTY_ENDS, ends, strict=True) if n in doubt.names}
        if not own.keys() & set(EMPTY_ENDS):
            own[EMPTY_ENDS[0]] = ends[0]
        self._check(own)
        self._own, self._names = own, (*own, START_V)
        self._map = CellMap(pack, self._names)
        self._full_V = full_and_empty_V(pack)[0]
        self._numbers = self._map(np.array([*own.values(), self._full_V]))[0]

    def moved(self, random: np.random.Generator) -> tuple[tuple[str, float], ...]:
        """Numbers of a drawn cell less those of the pack's."""
        for _ in range(TRIES):
            values = dict(self._own)
            steps = zip(
                self._doubt.names, self._doubt.value, self._doubt.std, self._doubt.factors(random),
                strict=True,
            )  # fmt: skip
            for name, value, std, z in steps:
                if name in values:
                    p = self._table.get(name) or _end(name, values[name])
                    relative = std / value if p.scale is Scale.LOG else std
                    values[name] = _at(p, values[name], relative, float(z))
            try:
                numbers, derived = self._map(np.array([*values.values(), self._full_V]))
            except Infeasible:
                continue
            if (derived[FILLERS] > -ROUNDING).all():  # no electrode is fuller than full
                return tuple(
                    (n, v - self._numbers[n]) for n, v in numbers.items() if n != "initial_soc"
                )
        raise CalibrationError(f"the fit of the cell allows none: {TRIES} draws were impossible")

    def _check(self, own: Mapping[str, float]) -> None:
        for name, value in zip(self._doubt.names, self._doubt.value.tolist(), strict=True):
            same = name.endswith(SAME) and name in own
            if same and abs(own[name] / value - 1) > NEAR:
                raise CalibrationError(
                    f"the fit beside the pack file is of another cell: {name} = {value:.4g}, "
                    f"in the pack {own[name]:.4g}"
                )


def _end(name: str, value: float) -> Parameter:
    """Of a window, where the table of the calibrated cell has the other electrode's."""
    return Parameter(name=name, unit="", mean=value, std=0.05, lower=1e-3, upper=0.995)


def _at(p: Parameter, value: float, std: float, z: float) -> float:
    """So many standard errors from `value`, within the bounds; `std` relative on a log scale."""
    there = value * float(np.exp(std * z)) if p.scale is Scale.LOG else value + std * z
    return float(np.clip(there, p.lower, p.upper))
