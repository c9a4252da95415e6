"""The finding in a sentence, and what a pilot wants to know next."""

from collections.abc import Mapping

import numpy as np

from reports.mismatch.report import MismatchReport
from reports.mismatch.words import clause, listed, name, percent, sentence
from reports.quantity import fixed, significant
from reports.section import Notice, Row, Section, Severity
from twin.mismatch import Finding, NamedEffect, Verdict

CLEARLY = 1.05  # times the noise: both are printed to two digits
FOLLOWED = 2  # quantities in a sentence
LEAD = 0.5  # of what is missed: what leaves no more explains most of it, though not all
MORE_THAN_NOISE = 1.5  # times the noise: what is left by a stated error or a start, and is told so


def summary(report: MismatchReport) -> Section:
    """The sentence first."""
    finding = report.finding
    notices = [Notice(text=t, severity=Severity.DOUBT) for t in (*finding.remarks, *report.doubts)]
    if finding.advice:
        notices.insert(0, Notice(text=f"What would tell more: {finding.advice}."))
    return Section(
        id="summary",
        title="What came out",
        lead=(headline(finding), *filter(None, (beside(finding),))),
        notices=tuple(notices),
        rows=_rows(report),
    )


def headline(finding: Finding) -> str:
    """One sentence a pilot understands."""
    return SAID[finding.verdict](finding)


def beside(finding: Finding) -> str:
    """How much better it fits; "" where nothing was found."""
    if not finding.effects or finding.contradictory:
        return ""
    errors = finding.errors
    return (
        "On what was not fitted the twin's error is "
        f"{mV(errors.held_out_after)} mV with it and {mV(errors.held_out_before)} mV without "
        f"(noise {mV(errors.noise)} mV)."
    )


def mV(volts: float) -> str:
    """As it is printed."""
    return fixed(1e3 * volts, 1)


def sizes_V(finding: Finding) -> Mapping[str, float]:
    """Effect -> root mean square of what it does to the voltage, over all that counts."""
    made: dict[str, list[np.ndarray[tuple[int], np.dtype[np.float64]]]] = {}
    for course in finding.courses:
        for part in course.parts:
            made.setdefault(part.effect, []).append(part.voltage_V[course.judged])
    return {k: float(np.sqrt(np.mean(np.concatenate(v) ** 2))) for k, v in made.items()}


def of_effect(effect: NamedEffect, size_V: float | None) -> str:
    """Its clause, with what it is worth and what looks the same."""
    notes = [] if size_V is None else [f"{mV(size_V)} mV of the pack's voltage"]
    if effect.equivalent:
        notes.append(
            "these recordings cannot tell it from "
            f"{listed([name(other) for other in effect.equivalent], 'or')}"
        )
    return clause(effect.id, effect.parameters) + f" ({'; '.join(notes)})" * bool(notes)


def _named(finding: Finding) -> str:
    sizes = sizes_V(finding)
    clauses = [of_effect(e, sizes.get(e.id)) for e in finding.effects]
    if len(clauses) == 1:
        return sentence(clauses[0])
    return sentence(f"{COUNT[len(clauses)]} were left out of the twin: {'; '.join(clauses)}")


def _ambiguous(finding: Finding) -> str:
    if finding.contradictory:
        return sentence(
            "the recordings contradict each other, no twin is right for all: "
            f"{listed([name(e.id) for e in finding.effects])} is in some and not in others, or not "
            "as large"
        )
    found = [
        f"{listed([name(i) for i in (e.id, *e.equivalent)], 'or')} ({percent(e.probability)})"
        for e in finding.effects
    ]
    return sentence(
        f"the twin misses something that these recordings do not settle: most likely it is "
        f"{listed(found)}"
    )


def _unknown(finding: Finding) -> str:
    follows = [t.quantity for t in finding.terms] or [d.quantity for d in finding.drivers]
    off_V, noise_V = finding.errors.held_out_before, finding.errors.noise
    text = f"the twin is off by {mV(off_V)} mV, " + (
        f"which is more than the noise of {mV(noise_V)} mV"
        if off_V > CLEARLY * noise_V
        else f"no more than the noise of {mV(noise_V)} mV, but not by chance"
    )
    if finding.causes_sought:
        text += f", and no effect that it knows explains that{_nearest(finding)}"
    if follows:
        text += f"; it follows the {listed(follows[:FOLLOWED], 'and the')}"
    return sentence(text)


def _nearest(finding: Finding) -> str:
    """The likeliest of what was looked at, if it leaves little enough to be a lead."""
    first = next(c for c in finding.candidates if c.ids)
    if first.held_out_rms_V > LEAD * finding.errors.held_out_before:
        return ""
    names = listed([name(i) for i in first.ids])
    return f" (nearest comes {names}, which leaves {mV(first.held_out_rms_V)} mV)"


def _none(finding: Finding) -> str:
    errors = finding.errors
    differs, noise = f"{mV(errors.held_out_after)} mV", f"{mV(errors.noise)} mV"
    if errors.held_out_after > MORE_THAN_NOISE * errors.noise:
        return sentence(
            "the twin says what these recordings say, within what it, or how they start, may err "
            f"by: {differs} at {noise} of noise"
        )
    size = "no more" if errors.held_out_after <= errors.noise else "little more"
    return sentence(
        f"the twin says what these recordings say: what differs ({differs}) is {size} than the "
        f"noise of {noise}"
    )


COUNT = {2: "two things", 3: "three things"}
SAID = {
    Verdict.NONE: _none,
    Verdict.NAMED: _named,
    Verdict.AMBIGUOUS: _ambiguous,
    Verdict.UNKNOWN: _unknown,
}


def _rows(report: MismatchReport) -> tuple[Row, ...]:
    finding, errors = report.finding, report.finding.errors
    rows = [
        Row(label="Pack", value=" ".join(filter(None, (report.pack, report.layout)))),
        Row(label="Verdict", value=finding.verdict.value),
    ]
    rows += [
        Row(
            label=sentence(name(e.id))[:-1],
            value=percent(e.probability),
            note="probability that it, or what looks like it, is part of what was left out",
        )
        for e in finding.effects
    ]
    rows += [_error(f"Error {twin}", error_V) for twin, error_V in errors_of(finding)]
    over = significant(errors.held_out_before / errors.noise, 2)
    rows.append(
        Row(label="Noise", value=mV(errors.noise), unit="mV", note=f"{FLOOR} {over} times that")
    )
    if report.adopted:
        use = f"--pack {report.adopted}"
        rows.append(Row(label="To use it", value=use, note="with analyze, or twin replay and age"))
    return tuple(rows)


TWINS = {
    Verdict.NONE: ("as configured", "with starts within their tolerance"),
    Verdict.NAMED: ("before", "after"),
    Verdict.AMBIGUOUS: ("before", "after"),
    Verdict.UNKNOWN: ("as configured",),  # nothing was taken, so nothing comes after
}


def errors_of(finding: Finding) -> tuple[tuple[str, float], ...]:
    """Which twin, and its error on what was not fitted [V]."""
    both_V = finding.errors.held_out_before, finding.errors.held_out_after
    twins = TWINS[Verdict.UNKNOWN if finding.contradictory else finding.verdict]
    return tuple(zip(twins, both_V, strict=False))


def _error(label: str, error_V: float) -> Row:
    note = "recorded minus simulated, RMS, on what was not fitted"
    return Row(label=label, value=mV(error_V), unit="mV", note=note)


FLOOR = "scatter of the samples by themselves; the error as configured is"
