"""Findings made by hand, one of each verdict."""

from dataclasses import replace

import numpy as np

from reports.mismatch import MismatchReport, Recorded
from twin.effects import SelfHeating, SeriesResistance
from twin.mismatch import Candidate, Course, Finding, NamedEffect, Span, Value, Verdict
from twin.mismatch.finding import Driver, Errors, Part, Term

NOISE_V = 8e-3
TIME_S = np.arange(0.0, 120.0, 0.1)


def course(name: str, *, ahead: bool, parts: tuple[str, ...] = ("self_heating",)) -> Course:
    """A residual that rises to 60 mV, of which each part makes its share."""
    rise_V = 0.06 * TIME_S / TIME_S[-1]
    noise_V = NOISE_V * np.random.default_rng(len(name)).standard_normal(TIME_S.size)
    judged = TIME_S > 5.0
    return Course(
        name=name,
        held_out=ahead,
        time_s=TIME_S,
        residual_V=rise_V + noise_V,
        after_V=noise_V,
        motion=np.where(TIME_S < 60.0, "hover", np.where(TIME_S < 110.0, "vertical", "")),
        judged=judged,
        judged_ahead=judged & ahead,
        parts=tuple(Part(effect=p, voltage_V=rise_V / len(parts)) for p in parts),
    )


def named(
    kind: type[SelfHeating] | type[SeriesResistance], value: float, *alike: str
) -> NamedEffect:
    p = kind.parameters[0]
    return NamedEffect(
        id=kind.id,
        pack_id=kind.id,
        probability=0.98,
        parameters=(Value(name=p.name, value=value, std=0.6 * value / 12.3, unit=p.unit),),
        instead=dict.fromkeys(alike, ()),
        equation=kind.equation,
        source=kind.source,
        signature=kind.signature,
    )


def candidate(
    *ids: str, held_out_V: float, lost: float, probability: float = 0.0, excess: float = 1.0
) -> Candidate:
    return Candidate(
        ids=ids,
        held_out_rms_V=held_out_V,
        delta_bic=lost,
        probability=probability,
        excess=excess,
    )


def finding(verdict: Verdict = Verdict.NAMED) -> Finding:
    """Self-heating, where something is named."""
    found = verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    heating = named(SelfHeating, 12.3)
    parts = ("self_heating",) if found else ()
    return Finding(
        verdict=verdict,
        effects=(heating,) if found else (),
        spans=()
        if verdict is Verdict.NONE
        else (
            Span(
                flight="b.ulg",
                start_s=60.0,
                stop_s=119.9,
                motion="vertical",
                mean_V=0.045,
                share=0.55,
            ),
            Span(
                flight="a.ulg", start_s=20.0, stop_s=60.0, motion="hover", mean_V=0.02, share=0.45
            ),
        ),
        drivers=()
        if verdict is Verdict.NONE
        else (Driver(quantity="heating history", explained=0.83),),
        errors=Errors(
            noise=NOISE_V,
            before=0.0351,
            after=0.0081,
            held_out_before=0.0352,
            held_out_after=0.0082,
        ),
        candidates=(
            candidate("self_heating", held_out_V=0.0082, lost=0.0, probability=0.97),
            candidate(
                "current_gain", "self_heating", held_out_V=0.0082, lost=7.0, probability=0.03
            ),
            candidate("current_gain", held_out_V=0.021, lost=812.0, excess=30.0),
            candidate("self_heating", "leakage", held_out_V=0.0083, lost=19.0),
            candidate(held_out_V=0.0352, lost=4000.0),
        ),
        terms=(Term(quantity="current squared", size_V=-0.0123, explained=0.61),)
        if verdict is Verdict.UNKNOWN
        else (),
        courses=(
            course("a.ulg", ahead=False, parts=parts),
            course("b.ulg", ahead=True, parts=parts),
        ),
    )


def pair() -> Finding:
    """Two effects, of which one looks like a third."""
    both = (named(SelfHeating, 12.3), named(SeriesResistance, 5e-3, "film_resistance"))
    ids = tuple(e.id for e in both)
    courses = (course("a.ulg", ahead=False, parts=ids), course("b.ulg", ahead=True, parts=ids))
    advice = "full throttle for 60 s from full: the candidates then differ by 30 mV rms"
    return replace(finding(), effects=both, courses=courses, advice=advice)


def report(of: Finding) -> MismatchReport:
    return MismatchReport(
        finding=of,
        pack="S500",
        layout="4S1P",
        physics=("sei",),
        recordings=tuple(Recorded(name=c.name, sha256="ab" * 32) for c in of.courses),
        adopted="better.toml",
        doubts=(),
        version="0.1.0",
    )
