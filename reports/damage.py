"""`Study` -> the parts of `result.json` that tell the damage."""

from collections.abc import Mapping
from typing import Literal

from reports.flight import ASSESSED
from reports.parts import (
    AssessmentPart,
    BaselinePart,
    DamagePart,
    FlightsPart,
    LifePart,
    LossPart,
    RatioPart,
    RelativePart,
)
from segment.profile import PeriodicProfile, TooLittle
from segment.segment import Motion
from twin.constants import ZERO_CELSIUS_K
from twin.damage import (
    MEASURES,
    Assessed,
    Attribution,
    Cost,
    Lifetime,
    Loss,
    Others,
    Part,
    Ratio,
    Study,
)
from twin.damage.cost import total
from twin.finite import finite
from twin.solution import Status

MAH = 1 / 3.6  # of a coulomb
FLIGHT = "flight"  # beside motions: all of it, as it was flown
Profiles = Mapping[Motion, PeriodicProfile | TooLittle]


def damage_part(study: Study | None, motion: str) -> DamagePart | None:
    """Of one motion; None if it was not assessed."""
    own = study.assessment.motions.get(motion) if study else None
    if study is None or own is None:
        return None
    cycled, whole = own.cycled, study.cyclable_C
    km = distance_km(own)
    both = cycled.flight, cycled.charge
    stress = [
        (
            min(getattr(e, name)[0] for e in both) / 1e6,
            max(getattr(e, name)[1] for e in both) / 1e6,
        )
        for name in ("negative_stress_Pa", "positive_stress_Pa")
    ]
    return DamagePart(
        flown_s=cycled.flown_s,
        charge_ah=cycled.drawn_C / 3600,
        energy_wh=cycled.energy_J / 3600,
        distance_km=km,
        capacity_per_flight_mah=MAH * cycled.capacity_C,
        per_flight=loss_part(cycled.whole, whole),
        in_flight=loss_part(cycled.in_flight, whole),
        per_minute=loss_part(cycled.whole * (60 / cycled.flown_s), whole),
        per_ah=loss_part(cycled.whole * (3600 / cycled.drawn_C), whole),
        per_wh=loss_part(cycled.whole * (3600 / cycled.energy_J), whole),
        per_km=loss_part(cycled.whole * (1 / km), whole) if km else None,
        peak_temperature_c=max(e.max_K for e in both) - ZERO_CELSIUS_K,
        plating_margin_mv=1000 * min(e.anode_V for e in both),
        negative_stress_mpa=stress[0],
        positive_stress_mpa=stress[1],
        as_flown=_as_flown(study, motion),
        other_order_95={
            name: finite(study.attribution.order_error(motion, name).half_95) for name in MEASURES
        },
        counterfactuals=_counterfactuals(own),
    )


def relative_part(study: Study | None, motion: str) -> RelativePart | None:
    """Of one motion; None if it was not assessed."""
    own = study.assessment.motions.get(motion) if study else None
    if own is None:
        return None
    return RelativePart(
        energy=own.energy,
        per_flight={k: _ratio(r) for k, r in own.excess[Part.WHOLE].items()},
        in_flight={k: _ratio(r) for k, r in own.excess[Part.FLIGHT].items()},
        normalised={k: _ratio(r) for k, r in own.normalised[Part.WHOLE].items()},
    )


def assessment_part(study: Study | None, profiles: Profiles) -> AssessmentPart | None:
    """How it was judged, and beside what; `profiles` say why a motion has none."""
    if study is None:
        return None
    found, whole = study.assessment, study.cyclable_C
    return AssessmentPart(
        cycles=found.protocol.cycles,
        charge_rate=found.protocol.charge_rate,
        ambient_c=found.protocol.ambient_K - ZERO_CELSIUS_K,
        baselines=tuple(
            BaselinePart(
                current_a=c.waveform.mean_A,
                flown_s=c.flown_s,
                per_flight=loss_part(c.whole, whole),
                in_flight=loss_part(c.in_flight, whole),
            )
            for c in found.baselines.cycled
        ),
        in_flight=loss_part(air, whole) if (air := _in_the_air(study.attribution)) else None,
        not_assessed=not_assessed(study, profiles),
        life=_life(study),
    )


def not_assessed(study: Study, profiles: Profiles) -> dict[str, str]:
    """Motion -> why it was not, of those that were flown; `flight` -> why not all of it."""
    out = {
        motion.value: profile.reason
        for motion, profile in profiles.items()
        if motion in ASSESSED and isinstance(profile, TooLittle) and profile.source_s
    }
    out |= study.assessment.cannot
    flown = study.attribution
    if flown.status is not Status.DONE:
        ended_s, whole_s = flown.whole.duration_s, flown.spans[-1].stop_s - flown.spans[0].start_s
        out[FLIGHT] = f"{ended_s:.0f} of {whole_s:.0f} s can be simulated: {flown.status.value}"
    return out


def _in_the_air(flown: Attribution) -> Loss | None:
    """Of all spans but those on the ground; None if the simulation did not come to their end."""
    if flown.status is not Status.DONE:
        return None
    both = zip(flown.spans, flown.costs, strict=False)
    return total([c for s, c in both if Motion(s.name) is not Motion.GROUND]).loss


def loss_part(loss: Loss, cyclable_C: float) -> LossPart:
    """In mAh and shares."""
    return LossPart(
        lithium_mah=MAH * loss.inventory_C,
        lithium_loss=loss.inventory_C / cyclable_C,
        negative_loss=loss.negative,
        positive_loss=loss.positive,
        sei_mah=MAH * loss.sei_C,
        sei_on_cracks_mah=MAH * loss.sei_on_cracks_C,
        plating_mah=MAH * loss.dead_C,
        total_mah=MAH * loss.reactions_C,
    )


def distance_km(own: Assessed) -> float | None:
    """Flown from full to the cut-off; None where no speed is known, or the motion has none."""
    speed = own.manoeuvre.speed_m_s
    return speed * own.cycled.flown_s / 1000 if speed else None


def _as_flown(study: Study, motion: str) -> LossPart | None:
    cost: Cost | None = study.attribution.by_name().get(motion)
    return loss_part(cost.loss, study.cyclable_C) if cost and cost.duration_s else None


def _counterfactuals(own: Assessed) -> dict[str, dict[str, float | None]] | None:
    if not own.counterfactuals:
        return None
    return {
        feature: {measure: finite(own.without(feature, measure)) for measure in MEASURES}
        for feature in own.counterfactuals
    }


def _life(study: Study) -> LifePart | None:
    lives = study.lives
    if lives is None:
        return None
    others = study.others
    return LifePart(
        share=lives.share,
        as_flown=_flights(lives.soon),
        daily=_flights(lives.daily),
        limited=_flights(lives.gentle),
        limit_a=lives.most_A,
        motions={name: _flights(one) for name, one in lives.motions.items()},
        mix_of_motions=finite(lives.by_shares),
        cell_uncertain=bool(others and others.of_cell),
        ageing=_ageing(others),
    )


def _ageing(others: Others | None) -> Literal["fitted", "assumed", "exact"]:
    if others is None:
        return "exact"
    return "fitted" if others.of_life else "assumed"


def _flights(one: Lifetime) -> FlightsPart:
    lower, upper = one.interval_95
    return FlightsPart(
        flights=finite(one.reached),
        lower_95=finite(lower),
        upper_95=finite(upper),
        ended=one.projection.ended,
    )


def _ratio(ratio: Ratio) -> RatioPart:
    lower, upper = ratio.interval_95
    return RatioPart(
        value=finite(ratio.value),
        std=finite(ratio.error.std),
        lower_95=finite(lower),
        upper_95=finite(upper),
    )
