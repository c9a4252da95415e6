"""Trials drawn from a seed: which pack, flight, effect and strength."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from proof.simulated.configured import END_SOC, Configured
from proof.simulated.effects import FOREIGN, LIBRARY, PAIRS
from proof.simulated.flights import PLANS
from proof.simulated.instruments import USUAL, Instruments
from proof.simulated.rest import Rest
from proof.trial import Trial

PYBAMM = "PyBaMM"  # whose the truths are
SHARES = {"control": 1 / 6, "foreign": 1 / 10, "pair": 1 / 10}  # the others have one effect
BARELY = 0.15  # of single effects: between once and three times the noise
STRENGTHS = (1.0, 3.5, 12.0)  # times the noise: borders of what is barely there and what is not
NOISE_V = (4e-3, 12e-3)  # of the pack's voltage
NOISY, NOISY_A = 1 / 3, (0.2, 0.8)  # how often a current sensor has more noise than most; how much
EVERY = (1, 1, 2, 5)  # of so many samples at 10 Hz one is recorded
PACKS = ("lipo", "lipo", "lipo", "lipo", "lipo", "lipo", "lg_m50", "heated")
SERIES = (3, 4, 6)
START_SOC, START_C = (0.90, 0.99), (12.0, 35.0)
M50_SOC = 0.6
SECOND_FLIGHT = 1 / 3  # how often two are fitted
BEGUN, BEFORE = 1 / 3, (0.03, 0.35)  # how often a log begins in flight; of its charge drawn by then
STREAM = 3  # of the random numbers for that: all else of a seed's trials is as without it
FROM_REST = {
    "self_heating", "plating_stripping", "ocv_hysteresis", "lithium_inventory_loss",
    "active_material_loss_negative", "active_material_loss_positive", "leakage",
    "foreign:unseen_consumer",
}  # fmt: skip
"""What such a log cannot be asked of: how warm the cells are by then, how much has been stripped or
has leaked, on which branch they are, and of how much lithium they are so full is in no pack file.
"""

BY_REST = 1 / 4  # how often a log that begins at rest tells how full the pack is, and no file does
FULL_SOC, REST_S = (0.95, 1.0), (5.0, 30.0)
IDLE, IDLE_A = 1 / 2, (0.1, 0.5)  # how often avionics draw from the pack; public logs: 0.0 to 0.6 A
FULL = {"lipo_2200"}  # what this airframe can empty from full
REST_STREAM = 4
STATED = {"initial_soc"}
"""What such a log cannot be asked of: a start that is read from it is not off. All else shows later
on too: what reads high at rest reads high when empty, a branch is left, an emptier cell is empty
first, and what leaks or strips goes on. These two make a rest that is none: a leak of 0.3 A lowers
what is read by 0.005, 3000 mol/m3 that strip raise it by 0.007.
"""
ABOVE, LESS = {"ocv_hysteresis", "plating_stripping"}, 0.04
"""These rest above the voltage of their charge: a charger has filled them when they hold less."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """All that makes a simulated trial.

    Attributes:
        kind: of the trial.
        effects: ids of what is in it.
        flavours: of each.
        multiple: of the noise by which the twin is to miss the first flight, each effect alone.
        told: the twin as configured.
        plan: of its flights.
        flights: seeds of them; the last is held out.
        instruments: what records them.
        begun: share of what a flight draws at least that was drawn before its log begins; 0: the
            log begins at rest.
        rest: how a log begins whose pack file states no charge.
        seed: of the noise.
    """

    kind: str
    effects: tuple[str, ...]
    flavours: tuple[int, ...]
    multiple: float
    told: Configured
    plan: str
    flights: tuple[int, ...]
    instruments: Instruments
    begun: float
    rest: Rest | None
    seed: int

    @property
    def before(self) -> float:
        """Share of the pack's charge drawn before the log begins; from rest where the twin heats.

        How warm it is by then is in no pack file.
        """
        return 0.0 if self.told.heat_transfer_W_m2_K else self.begun * self.drawn[0]

    @property
    def told_by_rest(self) -> Rest | None:
        """None where the pack file states how full the pack is, as of all that are not full."""
        return self.rest if self.told.cell in FULL else None

    @property
    def drawn(self) -> tuple[float, float]:
        """Least and most share of the pack's charge that a flight takes."""
        low, high = END_SOC[self.told.cell]
        return self.told.start_soc - high, self.told.start_soc - low

    def otherwise(self, attempt: int) -> "Drawn":
        """The same effects in another way: for those that cannot be so strong in this one.

        On other flights too: a consumer of cruises does not show in climbs.
        """
        if attempt == 0:
            return self
        rng = np.random.default_rng([self.seed, attempt])
        weaker = max(self.multiple / 2**attempt, STRENGTHS[1])
        return replace(
            self,
            flavours=_flavours(rng, self.effects),
            multiple=min(self.multiple, weaker),
            told=_full(_told(rng, self.effects), self.rest),
            plan=_plan(rng),
            flights=_flights(rng, len(self.flights)),
        )


def trials(seed: int, count: int, solves: Path) -> tuple[Trial, ...]:
    """So many, in an order that tells nothing; PyBaMM's answers are kept in the folder `solves`."""
    if not count:
        return ()
    from proof.simulated.make import make  # late: it needs PyBaMM

    return tuple(
        Trial(name=f"trial-{k:03d}", source=PYBAMM, make=partial(make, one, solves))
        for k, one in enumerate(draw(seed, count), start=1)
    )


def draw(seed: int, count: int) -> tuple[Drawn, ...]:
    """The same for the same numbers."""
    rng = np.random.default_rng(seed)
    kinds = [kind for kind, share in SHARES.items() for _ in range(round(share * count))]
    kinds += ["single"] * (count - len(kinds))
    pools: dict[str, list[tuple[str, ...]]] = {
        "single": _in_turn(rng, [(e,) for e in LIBRARY], count),
        "pair": _in_turn(rng, list(PAIRS), count),
        "foreign": _in_turn(rng, [(e,) for e in FOREIGN], count),
        "control": [()] * count,
    }
    chosen = [_one(rng, kind, pools[kind].pop()) for kind in kinds]
    return tuple(chosen[k] for k in rng.permutation(count))


def _in_turn(
    rng: np.random.Generator, every: Sequence[tuple[str, ...]], count: int
) -> list[tuple[str, ...]]:
    """In random order, none twice before all came once."""
    out: list[tuple[str, ...]] = []
    while len(out) < count:
        out += [every[k] for k in rng.permutation(len(every))]
    return out[:count][::-1]


def _one(rng: np.random.Generator, kind: str, effects: tuple[str, ...]) -> Drawn:
    barely = kind == "single" and rng.random() < BARELY
    low, high = STRENGTHS[:2] if barely else STRENGTHS[1:]
    flights = 3 if rng.random() < SECOND_FLIGHT else 2
    drawn = Drawn(
        kind=kind,
        effects=effects,
        flavours=_flavours(rng, effects),
        multiple=float(low * (high / low) ** rng.random()),
        told=_told(rng, effects),
        plan=_plan(rng),
        flights=_flights(rng, flights),
        instruments=_instruments(rng),
        begun=0.0,
        rest=None,
        seed=int(rng.integers(2**31)),
    )
    begun = _begun(np.random.default_rng([drawn.seed, STREAM]), effects)
    rest = _rest(np.random.default_rng([drawn.seed, REST_STREAM]), effects, begun)
    return replace(drawn, begun=begun, rest=rest, told=_full(drawn.told, rest))


def _begun(rng: np.random.Generator, effects: Sequence[str]) -> float:
    begins = FROM_REST.isdisjoint(effects) and rng.random() < BEGUN
    return float(rng.uniform(*BEFORE)) if begins else 0.0


def _rest(rng: np.random.Generator, effects: Sequence[str], begun: float) -> Rest | None:
    idle_A = float(rng.uniform(*IDLE_A)) if rng.random() < IDLE else 0.0
    less = 0.0 if ABOVE.isdisjoint(effects) else LESS
    soc = float(rng.uniform(*FULL_SOC)) - less
    rest = Rest(soc=soc, seconds=float(rng.uniform(*REST_S)), idle_A=idle_A)
    stated = begun or not STATED.isdisjoint(effects) or rng.random() >= BY_REST
    return None if stated else rest


def _full(told: Configured, rest: Rest | None) -> Configured:
    """Charged for it, if it is one that is."""
    return replace(told, start_soc=rest.soc) if rest and told.cell in FULL else told


def _flavours(rng: np.random.Generator, effects: Sequence[str]) -> tuple[int, ...]:
    return tuple(int(f) for f in rng.integers(12, size=len(effects)))


def _plan(rng: np.random.Generator) -> str:
    return str(rng.choice(list(PLANS)))


def _flights(rng: np.random.Generator, count: int) -> tuple[int, ...]:
    """Seeds."""
    return tuple(int(s) for s in rng.integers(2**31, size=count))


def _instruments(rng: np.random.Generator) -> Instruments:
    low, high = NOISY_A
    noise_A = low * (high / low) ** rng.random() if rng.random() < NOISY else USUAL.noise_A
    return Instruments(
        noise_V=rng.uniform(*NOISE_V), noise_A=float(noise_A), every=int(rng.choice(EVERY))
    )


def _told(rng: np.random.Generator, effects: Sequence[str]) -> Configured:
    """A pack; its twin has no heat where heat is what is left out."""
    kind = str(rng.choice(PACKS))
    start_K = 273.15 + float(rng.uniform(*START_C))
    soc = float(rng.uniform(*START_SOC))
    heated = kind == "heated" and "self_heating" not in effects
    m50 = kind == "lg_m50"
    return Configured(
        cell="lg_m50" if m50 else "lipo_2200",
        series=int(rng.choice(SERIES)),
        parallel=3 if m50 else 1,
        start_soc=M50_SOC if m50 else soc,
        start_K=start_K,
        ambient_K=start_K,
        heat_transfer_W_m2_K=12.0 if heated else None,
    )
