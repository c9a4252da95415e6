"""A proof as JSON (`proof.json`; its schema is proof.schema.json)."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.outcome import Baseline, Judged, Named, Opened, Proof, Sized, Stamp
from proof.tally import Share, Tally, by_class, kinds_not_run
from proof.targets import Target, capacity_error, over_floor, over_noise, targets
from proof.truth import Truth
from twin.finite import finite

VERSION = 4
IN_JSON: Mapping[str, tuple[str, float]] = {
    "V": ("mv", 1e3),
    "K": ("k", 1.0),
    "1": ("ratio", 1.0),
    "": ("count", 1.0),
}
"""Unit -> ending of a key, and factor."""


def proof_json(proof: Proof) -> dict[str, Any]:
    """All of it but the courses of channels; mV, K, Ah, s; null for what is not finite."""
    return {key: finite(value) for key, value in _content(proof).items()}


def _content(proof: Proof) -> dict[str, Any]:
    return {
        "schema_version": VERSION,
        "seed": proof.seed,
        "command": proof.command,
        "classes": [_tally(t) for t in by_class(proof.trials)],
        "kinds_not_run": list(kinds_not_run(proof.trials)),
        "targets": [_target(t) for t in targets(proof.trials)],
        "trials": [_judged(t) for t in proof.trials],
        "not_made": [
            {"name": n.name, "source": n.source, "reason": n.reason} for n in proof.not_made
        ],
        "versions": dict(proof.versions),
        "code": proof.code,
        "ledger_head": proof.head,
        "seconds": proof.seconds,
    }


def _tally(t: Tally) -> dict[str, Any]:
    outcomes = {outcome.value: count for outcome, count in t.outcomes.items()}
    return {"id": t.id, "what": t.what, "outcomes": outcomes, "share_right": _share(t.right)}


def _share(share: Share) -> dict[str, Any]:
    low, high = share.interval
    return {
        "count": share.count, "of": share.of, "value": share.value, "low_95": low, "high_95": high,
    }  # fmt: skip


def _target(t: Target) -> dict[str, Any]:
    ending, factor = IN_JSON[t.unit]
    return {
        "id": t.id,
        "what": t.what,
        "status": t.status.value,
        "bound": "at least" if t.at_least else "at most",
        f"limit_{ending}": factor * t.limit,
        f"measured_{ending}": None if t.measured is None else factor * t.measured,
        "within": t.within,
        "of": t.of,
        "absent": t.absent,
        "lacking": t.lacking,
        "share_within": _share(t.kept),
    }


def _judged(j: Judged) -> dict[str, Any]:
    return {
        "name": j.name,
        "source": j.source,
        "truth": _truth(j.truth),
        "verdict": j.verdict,
        "named": [_named(n) for n in j.named],
        "outcome": j.outcome.value,
        "noise_mv": 1e3 * j.noise_V,
        "held_out_before_mv": 1e3 * j.held_out_before_V,
        "held_out_after_mv": 1e3 * j.held_out_after_V,
        "held_out_over_noise": over_noise(j),
        "held_out_over_floor": over_floor(j),
        "sized": [_sized(s) for s in j.sized],
        **compared_json(
            baselines=j.baselines,
            channels=j.channels,
            capacity_C=j.capacity_C,
            not_compared=j.not_compared,
        ),
        "capacity_error": capacity_error(j),
        "sealed": _stamp(j.sealed),
        "judged": _stamp(j.judged),
        "opened": _stamp(j.opened),
        "seconds": j.seconds,
    }


def compared_json(
    *, baselines: Sequence[Baseline], channels: Sequence[Opened], capacity_C: float | None,
    not_compared: str = "",
) -> dict[str, Any]:  # fmt: skip
    """What was computed when a truth was open."""
    return {
        "baselines": [_baseline(b) for b in baselines],
        "channels": [_channel(c) for c in channels],
        "capacity_ah": _ampere_hours(capacity_C),
        **({"not_compared": not_compared} if not_compared else {}),
    }


def _truth(t: Truth) -> dict[str, Any]:
    return {
        "kind": t.kind,
        "said": t.said,
        "verdicts": list(t.verdicts),
        "effects": [list(alike) for alike in t.effects],
        "also": list(t.also),
        "strength": t.strength,
        "floor_mv": 1e3 * t.floor_V,
        "sample_noise_mv": 1e3 * t.noise_V,
        "numbers": [
            {"effect": n.effect, "name": n.name, "value": n.value, "unit": n.unit}
            for n in t.numbers
        ],
        "capacity_ah": _ampere_hours(t.capacity_C),
        "details": dict(t.details or {}),
    }


def _named(n: Named) -> dict[str, Any]:
    return {"id": n.id, "probability": n.probability, "equivalent": list(n.equivalent)}


def _baseline(b: Baseline) -> dict[str, Any]:
    return {
        "id": b.id, "what": b.what, "numbers": b.numbers, "held_out_mv": 1e3 * b.held_out_V,
    }  # fmt: skip


def _sized(s: Sized) -> dict[str, Any]:
    return {
        "effect": s.effect, "name": s.name, "unit": s.unit,
        "true": s.true, "found": s.found, "std": s.std,
    }  # fmt: skip


def _channel(c: Opened) -> dict[str, Any]:
    ending, factor = IN_JSON[c.unit]
    return {
        "recording": c.recording,
        "channel": c.channel,
        "samples": int(c.time_s.size),
        f"rms_before_{ending}": factor * c.rms_before,
        f"rms_after_{ending}": None if c.rms_after is None else factor * c.rms_after,
        f"rms_named_{ending}": None if c.rms_named is None else factor * c.rms_named,
    }


def _stamp(s: Stamp) -> dict[str, str]:
    return {"utc": s.utc, "sha256": s.sha256, "entry": s.entry}


def _ampere_hours(charge_C: float | None) -> float | None:
    return None if charge_C is None else charge_C / 3600
