"""A finding as JSON (`mismatch.json`, and `mismatch` of a flight's result)."""

from typing import Any

from twin.finite import finite
from twin.mismatch.finding import Candidate, Finding, NamedEffect, Span, Value

NONE = "none"  # the model that leaves nothing out


def finding_json(finding: Finding) -> dict[str, Any]:
    """Keys as the contract has them; voltages in mV, times in s, null for what is not finite."""
    return {key: finite(value) for key, value in _content(finding).items()}


def _content(finding: Finding) -> dict[str, Any]:
    errors = finding.errors
    return {
        "verdict": finding.verdict.value,
        "effects": [_effect(e) for e in finding.effects],
        "location": {
            "spans": [_span(s) for s in finding.spans],
            "drivers": [
                {"quantity": _id(d.quantity), "explained": d.explained} for d in finding.drivers
            ],
        },
        "rmse_mv": {
            "noise_floor": 1e3 * errors.noise,
            "before": 1e3 * errors.before,
            "after": 1e3 * errors.after,
            "holdout_before": 1e3 * errors.held_out_before,
            "holdout_after": 1e3 * errors.held_out_after,
        },
        "candidates": [_candidate(c) for c in finding.candidates],
        "terms": [
            {"quantity": _id(t.quantity), "size_mv": 1e3 * t.size_V, "explained": t.explained}
            for t in finding.terms
        ],
        "advice": finding.advice,
        "remarks": list(finding.remarks),
    }


def _effect(e: NamedEffect) -> dict[str, Any]:
    return {
        "id": e.id,
        "probability": e.probability,
        "equivalent": list(e.equivalent),
        "parameters": [_value(v) for v in e.parameters],
        "instead": {other: [_value(v) for v in values] for other, values in e.instead.items()},
        "equation": e.equation,
        "source": e.source,
    }


def _value(v: Value) -> dict[str, Any]:
    return {"name": v.name, "value": v.value, "std": v.std, "unit": v.unit}


def _span(s: Span) -> dict[str, Any]:
    return {
        "flight": s.flight,
        "start_s": s.start_s,
        "stop_s": s.stop_s,
        "motion": s.motion,
        "mean_mv": 1e3 * s.mean_V,
        "share": s.share,
    }


def _candidate(c: Candidate) -> dict[str, Any]:
    return {
        "id": "+".join(c.ids) or NONE,
        "holdout_rmse_mv": 1e3 * c.held_out_rms_V,
        "delta_bic": c.delta_bic,
        "probability": c.probability,
        "excess": c.excess,
    }


def _id(quantity: str) -> str:
    """What a program calls it: `temperature_rise`."""
    return quantity.replace(" ", "_")
