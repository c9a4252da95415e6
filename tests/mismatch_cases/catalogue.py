"""Which cases there are; all of it follows from their names."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from proof.simulated.configured import END_SOC, Configured
from proof.simulated.effects import FOREIGN, LIBRARY, PAIRS
from proof.simulated.instruments import NOISE_V

ROOM_K = 298.15
LIPO = (  # at rest one of these, by plan
    Configured(
        cell="lipo_2200", series=4, parallel=1, start_soc=0.95, start_K=ROOM_K, ambient_K=ROOM_K
    ),
    Configured(
        cell="lipo_2200", series=4, parallel=1, start_soc=0.98, start_K=303.15, ambient_K=303.15
    ),
    Configured(
        cell="lipo_2200", series=4, parallel=1, start_soc=0.92, start_K=293.15, ambient_K=293.15
    ),
)
HEATED = Configured(
    cell="lipo_2200", series=4, parallel=1, start_soc=0.95, start_K=ROOM_K, ambient_K=ROOM_K,
    heat_transfer_W_m2_K=12.0,
)  # fmt: skip
M50 = Configured(
    cell="lg_m50", series=4, parallel=3, start_soc=0.6, start_K=ROOM_K, ambient_K=ROOM_K
)
PLANS: Mapping[str, tuple[str, str, str]] = {
    "tune": ("hover", "vertical", "mixed"),
    "report": ("cruise", "vertical", "mixed"),
}
FIRST_SEED: Mapping[str, int] = {"tune": 1000, "report": 5000}  # of flights and noise
STRENGTHS: Mapping[str, float] = {"barely": NOISE_V, "3x": 3 * NOISE_V, "10x": 10 * NOISE_V}
POOL = 6  # flights of a plan; the first of a case is one of the first two

POOR = ("gaps", "1hz", "saturated")
"""Recordings that a twin misses though it is right: by current that was not recorded. What is to be
seen there is less confidence or a refusal, so they are no controls."""
VARIANTS = (*POOR, "quantised", "hop")
ON_M50 = (
    "cold_pack", "electrolyte_transport", "solid_diffusion_negative", "solid_diffusion_positive",
    "reaction_kinetics", "series_resistance", "initial_soc", "current_gain",
)  # fmt: skip
WITH_HEAT = (
    "cold_pack", "series_resistance", "weak_cell", "initial_soc", "electrolyte_transport",
    "lithium_inventory_loss", "current_gain",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """A case to be made.

    Attributes:
        name: of its file.
        split: `tune` or `report`.
        truth: ids of its effects.
        strength: of each of them.
        plan: of its flights.
        told: the twin as configured.
        variant: of its recordings.
    """

    name: str
    split: str
    truth: tuple[str, ...]
    strength: str
    plan: str
    told: Configured
    variant: str = "plain"

    @property
    def seed(self) -> int:
        """Of noise, flavours and which flights."""
        return FIRST_SEED[self.split] + zlib.crc32(self.name.encode())

    def flavour(self, effect: str) -> int:
        """One for all strengths, so that they are the same thing in three sizes."""
        return zlib.crc32(f"{self.split} {self.plan} {effect} {self.told.cell}".encode()) // 7

    @property
    def slow(self) -> bool:
        """PyBaMM takes six times as long with a temperature."""
        return "self_heating" in self.truth or self.told.heat_transfer_W_m2_K is not None

    @property
    def drawn(self) -> tuple[float, float]:
        """Least and most share of the pack's charge that a flight takes."""
        low, high = END_SOC[self.told.cell]
        return self.told.start_soc - high, self.told.start_soc - low

    def flights(self) -> tuple[int, ...]:
        """Seeds of its two flights, or three of a mixed one; the first sets the sizes."""
        first, rest = self.seed % 2, POOL - 2
        if self.truth:  # one for all strengths
            first = zlib.crc32(f"{self.truth} {self.plan}".encode()) % 2
        later = [2 + (self.seed // 2 + k) % rest for k in range(2 if self.plan == "mixed" else 1)]
        return tuple(FIRST_SEED[self.split] + k for k in (first, *later))


def specs(split: str) -> tuple[Spec, ...]:
    """All of a split, the most telling and the cheapest first."""
    plans = PLANS[split]

    def told(plan: str) -> Configured:
        return LIPO[plans.index(plan)]

    def singles(ids: Sequence[str], plans: Sequence[str], strengths: Sequence[str]) -> list[Spec]:
        return [
            Spec(
                name=f"{e.replace(':', '_')}-{plan}-{strength}", split=split, truth=(e,),
                strength=strength, plan=plan, told=told(plan),
            )
            for plan, strength, e in product(plans, strengths, ids)
        ]  # fmt: skip

    def others(kind: str, pack: Configured, ids: Sequence[str]) -> list[Spec]:
        return [
            Spec(
                name=f"{e}-{kind}-3x", split=split, truth=(e,), strength="3x", plan=plans[2],
                told=pack,
            )
            for e in ids
        ]  # fmt: skip

    pairs = [
        Spec(
            name=f"{a}+{b}-{plan}-3x", split=split, truth=(a, b), strength="3x", plan=plan,
            told=told(plan),
        )
        for k, (a, b) in enumerate(PAIRS)
        for plan in (plans[k % 3],)
    ]  # fmt: skip
    library, foreign, first = tuple(LIBRARY), tuple(FOREIGN), plans[:1]
    ordered = (
        singles(library, first, ("3x", "barely")),
        _controls(split),
        singles(foreign, first, ("3x",)),
        pairs,
        singles(library, first, ("10x",)),
        singles(foreign, plans[1:2], ("3x", "10x")),
        _variants(split),
        singles(library, plans[1:], ("3x", "barely", "10x")),
        others("m50", M50, ON_M50),
        others("heated", HEATED, WITH_HEAT),
    )
    return tuple(spec for group in ordered for spec in sorted(group, key=lambda s: s.slow))


def _controls(split: str) -> list[Spec]:
    """No effect: each plan and pack, a rounded voltage, a short hop; then poor recordings."""
    plans = PLANS[split]
    good = [(plan, LIPO[k], "plain") for k, plan in enumerate(plans)] * 4
    good += [(plan, LIPO[k], "quantised") for k, plan in enumerate(plans)] * 2
    good += [("hop", LIPO[0], "plain"), ("hop", LIPO[2], "plain")]
    good += [(plan, M50, "plain") for plan in plans]
    good += [(plan, HEATED, "plain") for plan in plans[:2]]
    poor = [(plan, LIPO[k], v) for v in POOR for k, plan in enumerate(plans)]
    named = [(f"control-{k:02d}", *kind) for k, kind in enumerate(good)]
    named += [("poor", *kind) for kind in poor]
    return [
        Spec(
            name=f"{name}-{plan}-{variant}", split=split, truth=(), strength="none", plan=plan,
            told=told, variant=variant,
        )
        for name, plan, told, variant in named
    ]  # fmt: skip


def _variants(split: str) -> list[Spec]:
    """Strong effects in poor recordings."""
    plan = PLANS[split][0]
    return [
        Spec(
            name=f"{e}-{variant}-10x", split=split, truth=(e,), strength="10x",
            plan="hop" if variant == "hop" else plan, told=LIPO[0],
            variant="plain" if variant == "hop" else variant,
        )
        for variant, e in product(VARIANTS, ("initial_soc", "series_resistance", "cold_pack"))
    ]  # fmt: skip
