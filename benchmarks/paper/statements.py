"""The paper's four statements (arXiv 2603.12791) asked of an assessment, each with its numbers."""

from dataclasses import dataclass

import numpy as np

from twin.damage import MEASURES, Assessment, Part, number

LINEAR = 0.1  # of what the baselines span: farther from a straight line is not nearly linear
RAISED = 0.001  # over a baseline: less is what profiles and segments leave open
NEAR = 0.01  # of a baseline: within it a motion is near it
SHOWN = ("lithium", "negative", "positive", "sei", "sei_on_cracks", "plating")


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Whether the twin supports a statement, and by which numbers."""

    statement: str
    supported: bool
    numbers: str


def verdicts(found: Assessment, part: Part = Part.WHOLE) -> tuple[Verdict, ...]:
    """Of flight and charge, or of the flight alone."""
    return (
        _linear(found, part),
        _all_above(found, "lithium", part),
        _material(found, part),
        _films(found, part),
    )


def _linear(found: Assessment, part: Part) -> Verdict:
    """Largest distance from the straight line of least squares, over what the baselines span."""
    amps, off = np.array(found.baselines.currents_A), {}
    for name in SHOWN:
        values = np.array([number(name, part)(c) for c in found.baselines.cycled])
        line = np.polyval(np.polyfit(amps, values, 1), amps)
        if np.ptp(values) > 1e-3 * abs(values).max():
            off[name] = float(np.abs(values - line).max() / np.ptp(values))
    return Verdict(
        statement="1 baselines nearly linear in current",
        supported=max(off.values()) <= LINEAR,
        numbers=", ".join(f"{name} {100 * v:.1f} %" for name, v in off.items()),
    )


def _excess(found: Assessment, measure: str, part: Part) -> dict[str, float]:
    return {n: own.excess[part][measure].value - 1 for n, own in found.motions.items()}


def _all_above(found: Assessment, measure: str, part: Part) -> Verdict:
    over = _excess(found, measure, part)
    return Verdict(
        statement="2 lithium loss above the baselines for all motions",
        supported=all(v > RAISED for v in over.values()),
        numbers=_percent(over),
    )


def _material(found: Assessment, part: Part) -> Verdict:
    sides = {side: _excess(found, side, part) for side in ("negative", "positive")}
    more = {n for over in sides.values() for n, v in over.items() if v > NEAR}
    return Verdict(
        statement="3 loss of active material beyond the baselines only for vertical",
        supported=more == {"vertical"},
        numbers="; ".join(f"{side}: {_percent(over)}" for side, over in sides.items()),
    )


def _films(found: Assessment, part: Part) -> Verdict:
    cracks, plain = (_excess(found, name, part) for name in ("sei_on_cracks", "sei"))
    near = all((abs(v) <= NEAR) == (n != "vertical") for n, v in plain.items())
    return Verdict(
        statement="4 SEI on cracks raised for all motions, plain SEI only for vertical",
        supported=all(v > RAISED for v in cracks.values()) and near,
        numbers=f"on cracks: {_percent(cracks)}; plain: {_percent(plain)}",
    )


def _percent(over: dict[str, float]) -> str:
    return ", ".join(f"{n} {100 * v:+.2f} %" for n, v in over.items() if np.isfinite(v)) or "none"


assert set(SHOWN) < set(MEASURES)
