"""Random cells, flights and protocols for `benchmarks.fuzz`; each is made from its seed alone."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from twin.builtin import load_cell
from twin.cell import Cell
from twin.constants import ZERO_CELSIUS_K
from twin.effects import EFFECTS, AnyEffect, FilmResistance, Mechanics, SeriesResistance
from twin.effects.effect import Parameter
from twin.load import Between, Load
from twin.pack import Pack
from twin.protocol import ConstantCurrent, ConstantVoltage, FollowLoad, Rest, Settings, Step
from twin.simulate import changeable

FloatArray = npt.NDArray[np.float64]
Random = np.random.Generator

CELLS = ("lg_m50", "lipo_2200")
COLD_C, HOT_C = -20.0, 60.0
SPREAD = np.log(1.3)  # one standard deviation of the logarithm of a number of a cell,
WIDE = np.log(5.0) / 2  # of a diffusivity or a rate constant: two are a factor of 5
NORMAL = {"reference_K": 3.0, "stoichiometry_min": 0.01, "stoichiometry_max": 0.02}
"""Numbers that are shifted, not scaled: one standard deviation."""
RANGE = {
    "stoichiometry_min": (1e-3, 0.45),
    "stoichiometry_max": (0.6, 0.999),
    "porosity": (0.15, 0.7),
    "transport_efficiency": (0.02, 0.8),
    "transference": (0.1, 0.6),
    "poisson": (0.05, 0.45),
    "paris_exponent": (2.0, 2.5),
}
"""What can be, by the end of the name."""
START = ("initial_soc", "initial_K", "ambient_K", "plating.initial_mol_m3")
MOST_SOLID = 0.97  # of an electrode's volume, with its pores


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flight:
    """`pack` under `load` with the `numbers` of `changeable`."""

    seed: int
    pack: Pack
    load: Load
    numbers: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cycling:
    """`steps` of a protocol on `pack`, whose cell and effects are drawn too."""

    seed: int
    pack: Pack
    steps: tuple[Step, ...]
    settings: Settings


def flight(seed: int) -> Flight:
    """A pack, its numbers and a load."""
    rng = np.random.default_rng(seed)
    pack = _pack(rng)
    load = _load(rng, pack)
    return Flight(seed=seed, pack=pack, load=load, numbers=_numbers(rng, pack, load))


def cycling(seed: int) -> Cycling:
    """A pack and three to six steps: charges, holds, rests, discharges, short flights."""
    rng = np.random.default_rng(seed)
    plain = _pack(rng)
    pack = _with_numbers(plain, _numbers(rng, plain, _load(rng, plain)))
    steps: list[Step] = []
    for _ in range(rng.integers(3, 7)):
        steps.extend(_steps(rng, pack))
    ambient_K = ZERO_CELSIUS_K + rng.uniform(COLD_C, HOT_C)
    return Cycling(seed=seed, pack=pack, steps=tuple(steps), settings=Settings(ambient_K=ambient_K))


def whole_A(pack: Pack) -> float:
    """1C of the pack as it is named."""
    return pack.rated_C / 3600


def _pack(rng: Random) -> Pack:
    cell = load_cell(str(rng.choice(CELLS)))
    share = rng.choice([0.0, 0.3, 1.0])  # of the effects: none, some, all
    kinds = [*EFFECTS.values(), SeriesResistance, FilmResistance]
    chosen: tuple[AnyEffect, ...] = tuple(k() for k in kinds if rng.random() < share)
    parallel = int(rng.choice([1, 1, 2, 7]))
    scale = None if rng.random() < 0.5 else float(np.exp(rng.normal(0.0, 0.7)))
    temperature_C = rng.uniform(COLD_C, HOT_C)
    return Pack(
        cell=cell,
        series=int(rng.choice([1, 4, 12])),
        parallel=parallel,
        capacity_C=None if scale is None else scale * parallel * cell.nominal_capacity_C,
        initial_soc=float(rng.choice([0.0, 1.0, rng.random(), rng.random(), rng.random()])),
        initial_K=ZERO_CELSIUS_K + temperature_C,
        effects=chosen,
    )


def _load(rng: Random, pack: Pack) -> Load:
    """Gusts around a mean, spikes, pauses, gaps; one in eight charges, some are a few samples."""
    n = int(rng.choice([1, 2, 3, rng.integers(4, 100), *rng.integers(100, 1200, 8)]))
    period_s = float(rng.choice([1e-3, 0.05, 0.1, 0.1, 0.1, 0.2, 1.0, 10.0]))
    step_s = np.full(n - 1, period_s) * (1 + 0.2 * rng.uniform(-1, 1, n - 1))
    for _ in range(rng.integers(0, 4) if n > 1 else 0):
        step_s[rng.integers(n - 1)] = np.exp(rng.uniform(np.log(10.0), np.log(600.0)))
    mean_A = np.exp(rng.uniform(np.log(0.3), np.log(8.0))) * whole_A(pack)
    rates = 1 + rng.uniform(0.0, 0.5) * _gusts(rng, n)
    for _ in range(rng.integers(0, 6)):
        rates[rng.integers(n)] = rng.uniform(-2.0, 5.0)
    if rng.random() < 0.3:
        start = rng.integers(n)
        rates[start : start + rng.integers(1, 200)] = 0.0
    warm_K = pack.initial_K if rng.random() < 0.5 else ZERO_CELSIUS_K + rng.uniform(COLD_C, HOT_C)
    return Load(
        time_s=rng.uniform(-100.0, 100.0) + np.concatenate([[0.0], np.cumsum(step_s)]),
        current_A=(-mean_A if rng.random() < 0.125 else mean_A) * rates,
        between=Between.HOLD if rng.random() < 0.3 else Between.LINEAR,
        ambient_K=warm_K,
    )


def _gusts(rng: Random, n: int) -> FloatArray:
    """(n,) noise of unit variance that remembers some samples."""
    white, keep = rng.standard_normal(n), rng.uniform(0.0, 0.98)
    out = white.copy()
    for k in range(1, n):
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * white[k]
    return out


def _numbers(rng: Random, pack: Pack, load: Load) -> dict[str, float]:
    """All of `changeable`, drawn; the start and the surroundings stay as they are."""
    known = _known(pack)
    given = changeable(pack, load)
    out = {name: _drawn(rng, name, value, known.get(name)) for name, value in given.items()}
    out |= {name: given[name] for name in START if name in given}
    for side in ("negative", "positive"):
        radius, area = (out[f"{side}.{k}"] for k in ("particle_radius_m", "specific_area_m2_m3"))
        room = MOST_SOLID - out[f"{side}.porosity"]
        out[f"{side}.specific_area_m2_m3"] = min(area, 3 * room / radius)
    return out


def _known(pack: Pack) -> dict[str, Parameter]:
    """Name in `changeable` -> what is known beforehand, for the effects of `pack`."""
    out: dict[str, Parameter] = {}
    for effect in pack.effects:
        for p in effect.parameters:
            if isinstance(effect, FilmResistance):
                side, _, rest = p.name.partition("_")
                out[f"{side}.film_{rest}"] = p
            elif isinstance(effect, SeriesResistance):
                out["series_resistance_ohm"] = p
            elif p.name == "heat_transfer_W_m2_K":
                out[p.name] = p
            else:
                out[f"{effect.id}.{p.name}"] = p
    return out


def _drawn(rng: Random, name: str, value: float, known: Parameter | None) -> float:
    """Half from the prior, half from anywhere within the bounds; without either, near `value`."""
    end = name.rpartition(".")[2]
    if known is not None:
        low, high = known.lower, known.upper
        if rng.random() < 0.5:
            drawn = rng.normal(0.0, known.prior_std)
            about = known.value * np.exp(drawn) if known.logarithmic else known.value + drawn
            return float(np.clip(about, low, high))
        least = low if low > 0 else 1e-3 * high
        return float(np.exp(rng.uniform(np.log(least), np.log(high))))
    if end in NORMAL:
        out = value + NORMAL[end] * rng.standard_normal()
    else:
        fast = "diffusivity" in end or "rate_constant" in end
        wide = fast and "activation" not in end
        out = value * np.exp((WIDE if wide else SPREAD) * rng.standard_normal())
    limits = next((v for k, v in RANGE.items() if end.endswith(k)), (-np.inf, np.inf))
    return float(np.clip(out, *limits))


def _with_numbers(pack: Pack, numbers: Mapping[str, float]) -> Pack:
    """`pack` whose cell, effects and mechanics have these numbers, as far as they hold them."""

    def own(owner: object, prefix: str) -> dict[str, float]:
        names = {f.name for f in fields(owner)}  # type: ignore[arg-type]
        wanted = {k.partition(".")[2]: v for k, v in numbers.items() if k.startswith(f"{prefix}.")}
        return {k: v for k, v in wanted.items() if k in names}

    cell = pack.cell
    parts = {
        name: replace(getattr(cell, name), **own(getattr(cell, name), name))
        for name in ("negative", "separator", "positive", "electrolyte")
    }
    effects = tuple(type(e)(**own(e, e.id)) for e in pack.effects)
    mechanics = Mechanics(**own(Mechanics(), "mechanics"))
    varied: Cell = replace(cell, reference_K=numbers["reference_K"], **parts)
    return replace(pack, cell=varied, effects=effects, mechanics=mechanics)


def _steps(rng: Random, pack: Pack) -> tuple[Step, ...]:
    """One step, or a charge at constant current and then constant voltage."""
    one_C, n = whole_A(pack), pack.series
    low_V, high_V = n * pack.cell.lower_cut_off_V, n * pack.cell.upper_cut_off_V
    rate = np.exp(rng.uniform(np.log(0.1), np.log(4.0)))
    top_V = rng.uniform(low_V + 0.6 * (high_V - low_V), high_V)
    charge = ConstantCurrent(current_A=-rate * one_C, until_V=top_V)
    hold = ConstantVoltage(
        voltage_V=top_V, until_A=one_C * rng.uniform(0.02, 0.3), duration_s=rng.uniform(10, 2e4)
    )
    long = ConstantCurrent(
        current_A=rate * one_C,
        until_V=rng.uniform(low_V, top_V) if rng.random() < 0.7 else None,
        duration_s=rng.uniform(1.0, 8000.0),
    )
    rest = Rest(duration_s=np.exp(rng.uniform(np.log(0.01), np.log(1e5))))
    load = FollowLoad(load=_load(rng, pack))
    choices: tuple[tuple[Step, ...], ...] = (
        (charge,), (charge, hold), (charge, hold), (hold,), (long,), (long,), (rest,), (load,),
    )  # fmt: skip
    return choices[rng.integers(len(choices))]
