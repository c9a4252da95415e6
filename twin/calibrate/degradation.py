"""Parameters of ageing from check-ups along a life: what they are, and the sum of squares.

Solvent diffusivity and resistivity of the SEI; of each electrode Young's modulus, Poisson's ratio
and the partial molar volume of lithium. The last three act through the stress alone, which goes as
E Omega / (1 - nu), unless stress enhances diffusion: then through Omega times that as well. So the
life is simulated anew for what acts by itself, and all else follows. Modulus over strength of the
material, and over the rate of its loss, is what a life tells: the modulus stands for both.

Two more are no property of the cell: measured capacity over that in equilibrium (a check-up has a
rate), and measured resistance beyond that of the pack (contacts, another duration of the pulse).
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import log

import numpy as np
import numpy.typing as npt

from twin.ageing import Regime
from twin.calibrate.check_ups import CheckUps
from twin.calibrate.life import checked
from twin.calibrate.parameters import Parameter, Scale
from twin.calibrate.table import CalibrationError
from twin.effects import ActiveMaterialLoss, Cracking, Mechanics, Sei
from twin.effects.effect import Parameter as Known
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

SEI = ("solvent_diffusivity_m2_s", "resistivity_ohm_m")
SPREAD = {
    "sei.solvent_diffusivity_m2_s": log(10.0), "sei.resistivity_ohm_m": log(3.0),
    "modulus_Pa": log(3.0), "partial_volume_m3_mol": log(1.5),
}  # fmt: skip
"""Standard deviations of priors on the logarithmic scale: what cells differ by."""
MEASURED, BEYOND = "measured_capacity", "resistance_beyond_ohm"
NO_PROPERTY = (MEASURED, BEYOND)
CAPACITY_SHARE, RESISTANCE_SHARE = 3e-3, 1e-2
"""What a check-up errs by, of the first."""
MOST = 100.0  # factor on what is searched on the logarithmic scale
ENDED = 3.0  # times the worst resistance: where a life has ended, or the pulse cannot be borne
STEP = 0.02  # of a coordinate, for differences: one side alone, right to a hundredth or two
THREADS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """A simulated life at the check-ups; no capacity where it has ended.

    Attributes:
        capacity_C: (n,) in equilibrium.
        resistance_ohm: (n,) after 10 s.
    """

    capacity_C: FloatArray
    resistance_ohm: FloatArray


class LifeProblem:
    """Check-ups of a pack under a regime, and the parameters that are free; `polish` solves it.

    Attributes:
        parameters: (k,) those of ageing, then NO_PROPERTY.
        pack: as it is said to age beforehand.
    """

    def __init__(
        self, pack: Pack, regime: Regime, ups: CheckUps, *,
        shares: tuple[float, float] = (CAPACITY_SHARE, RESISTANCE_SHARE),
    ) -> None:  # fmt: skip
        self.pack, self.regime, self.ups, self.shares = pack, regime, ups, shares
        ageing = ageing_parameters(pack)
        if not ageing:
            raise CalibrationError(
                "nothing in this pack ages by what can be fitted: list sei, cracking or "
                "active_material_loss under physics of [twin] in the pack file"
            )
        self.parameters = (*ageing, *_no_property(ups))
        self._last: tuple[bytes, Course] | None = None

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates."""
        low, high = zip(*(p.bounds for p in self.parameters), strict=True)
        return np.array(low), np.array(high)

    @property
    def parts(self) -> dict[str, int]:
        """Of the residuals."""
        sizes = {"capacity": len(self.ups)}
        return sizes if self.ups.resistance_ohm is None else sizes | {"resistance": len(self.ups)}

    def of_other_shares(self, factor: float) -> "LifeProblem":
        """The same, check-ups erring by `factor` as much."""
        capacity, resistance = self.shares
        shares = capacity * factor, resistance * factor
        return LifeProblem(self.pack, self.regime, self.ups, shares=shares)

    def values(self, q: FloatArray) -> dict[str, float]:
        """Of all parameters."""
        return {p.name: p.value(c) for p, c in zip(self.parameters, q.tolist(), strict=True)}

    def cost(self, q: FloatArray) -> float:
        """Half the sum of squares."""
        r = self.residuals(q)
        return 0.5 * float(r @ r)

    def residuals(self, q: FloatArray) -> FloatArray:
        """Of capacity, resistance, prior."""
        return np.concatenate([self._residuals(q, self.course(q)), -q])

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals of capacity, resistance, prior; and their derivative by q."""
        here = self._residuals(q, self.course(q))
        slopes = np.zeros((here.size, q.size))
        own = [k for k, p in enumerate(self.parameters) if self._acts(p.name)]
        with ThreadPoolExecutor(THREADS) as pool:
            columns = pool.map(lambda k: self._difference(q, k, here), own)
            for k, column in zip(own, columns, strict=True):
                slopes[:, k] = column
        for k, p in enumerate(self.parameters):
            if not self._acts(p.name):
                slopes[:, k] = self._followed(q, k, slopes)
        return np.concatenate([here, -q]), np.vstack([slopes, -np.eye(q.size)])

    def course(self, q: FloatArray) -> Course:
        """The life with these values; the last is kept."""
        ageing = q[: len(self.parameters) - len(_no_property(self.ups))]
        if self._last is None or self._last[0] != ageing.tobytes():
            self._last = ageing.tobytes(), course(self.pack_at(q), self.regime, self.ups.cycle)
        return self._last[1]

    def pack_at(self, q: FloatArray) -> Pack:
        """That ages as these values say."""
        return aged_by(self.pack, self.values(q))

    def _residuals(self, q: FloatArray, life: Course) -> FloatArray:
        values, ups = self.values(q), self.ups
        shares = self.shares
        simulated = values[MEASURED] * life.capacity_C
        rows = [(ups.capacity_C - simulated) / (shares[0] * ups.capacity_C[0])]
        if ups.resistance_ohm is not None:
            beyond = ups.resistance_ohm - values[BEYOND] - life.resistance_ohm
            rows.append(beyond / (shares[1] * ups.resistance_ohm[0]))
        return np.concatenate(rows)

    def _difference(self, q: FloatArray, k: int, here: FloatArray) -> FloatArray:
        there = q.copy()
        there[k] += STEP if q[k] + STEP <= self.parameters[k].bounds[1] else -STEP
        if self.parameters[k].name in NO_PROPERTY:
            life = self.course(q)
        else:
            life = course(self.pack_at(there), self.regime, self.ups.cycle)
        return np.asarray((self._residuals(there, life) - here) / (there[k] - q[k]))

    def _acts(self, name: str) -> bool:
        """By itself; else it does what the modulus of its electrode does."""
        return not name.endswith("poisson") and (
            self.pack.stressed or not name.endswith("partial_volume_m3_mol")
        )

    def _followed(self, q: FloatArray, k: int, slopes: FloatArray) -> FloatArray:
        """By a Poisson's ratio or a partial volume, from the column of the modulus beside it."""
        own = self.parameters[k]
        side = own.name.split("_")[0]
        place = next(i for i, p in enumerate(self.parameters) if p.name == f"{side}_modulus_Pa")
        value = own.value(float(q[k]))
        per = 1 / (1 - value) if own.name.endswith("poisson") else 1 / value
        relative = per * own.slope(float(q[k])) / self.parameters[place].std
        return np.asarray(relative * slopes[:, place])


def ageing_parameters(pack: Pack) -> tuple[Parameter, ...]:
    """That may be fitted to a life of `pack`, its numbers as prior means."""
    out = []
    for effect in pack.effects:
        if isinstance(effect, Sei):
            out += [
                _by_factor(f"sei.{p.name}", p, getattr(effect, p.name))
                for p in Sei.parameters
                if p.name in SEI and getattr(effect, p.name) > 0
            ]
    lost = any(isinstance(e, ActiveMaterialLoss) for e in pack.effects)
    cracked = any(isinstance(e, Cracking) for e in pack.effects)
    strained = {"negative": lost or cracked or pack.stressed, "positive": lost or pack.stressed}
    for p in Mechanics.parameters:
        value = float(getattr(pack.mechanics, p.name))
        if not strained[p.name.split("_")[0]]:
            continue
        if p.name.endswith("poisson"):
            out.append(Parameter(name=f"mechanics.{p.name}", unit="", mean=value, std=p.prior_std,
                                 lower=p.lower, upper=p.upper))  # fmt: skip
        elif value > 0:
            out.append(_by_factor(f"mechanics.{p.name}", p, value))
    return tuple(out)


def aged_by(pack: Pack, values: Mapping[str, float]) -> Pack:
    """`pack` with other values for some of `ageing_parameters`."""
    tables: dict[str, dict[str, float]] = {"sei": {}, "mechanics": {}}
    for name, value in values.items():
        table, _, field = name.partition(".")
        if table in tables:
            tables[table][field] = value
    effects = tuple(replace(e, **tables["sei"]) if isinstance(e, Sei) else e for e in pack.effects)
    return replace(pack, effects=effects, mechanics=replace(pack.mechanics, **tables["mechanics"]))


def course(pack: Pack, regime: Regime, cycles: Sequence[int] | npt.NDArray[np.int64]) -> Course:
    """What check-ups after so many `cycles` would find."""
    wanted = [int(n) for n in cycles]
    there = {c.cycle: c.health for c in checked(pack, regime, wanted[-1], at=wanted)}
    capacity_C = [there[n].capacity_C if n in there else 0.0 for n in wanted]
    ohm = [there[n].resistance_10s_ohm if n in there else np.nan for n in wanted]
    worst = ENDED * np.nanmax([*ohm, 0.0])
    return Course(
        capacity_C=np.array(capacity_C), resistance_ohm=np.nan_to_num(ohm, nan=float(worst))
    )


def _by_factor(name: str, known: Known, value: float) -> Parameter:
    std = SPREAD.get(name, SPREAD.get(name.partition("_")[2], 0.0))
    return Parameter(
        name=name, unit=known.unit, mean=value, std=std, lower=max(known.lower, value / MOST),
        upper=min(known.upper, value * MOST), scale=Scale.LOG,
    )  # fmt: skip


def _no_property(ups: CheckUps) -> tuple[Parameter, ...]:
    """How check-ups differ from what the twin calls capacity and resistance."""
    capacity = Parameter(
        name=MEASURED, unit="", mean=1.0, std=0.1, lower=0.3, upper=2.0, scale=Scale.LOG
    )
    if ups.resistance_ohm is None:
        return (capacity,)
    first = float(ups.resistance_ohm[0])
    beyond = Parameter(name=BEYOND, unit="ohm", mean=0.0, std=first, lower=-9 * first, upper=first)
    return capacity, beyond
