"""What came out, in a few lines for whoever flies the pack."""

import math
from collections import Counter

from reports.calibration.names import called, in_order, phrase, with_unit
from reports.calibration.report import CalibrationReport
from reports.quantity import fixed
from reports.section import Notice, Row, Section, Severity
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.checks import Fitted, stated_error_V
from twin.calibrate.run import Calibration

AS_NOISE = 1.3  # an error over the noise up to which it is called noise
NAMED = 4  # parameters in a sentence


def summary(report: CalibrationReport) -> Section:
    """The sentence, and what a pilot wants to know next."""
    found = report.found
    return Section(
        id="summary",
        title="What came out",
        lead=(headline(found), *filter(None, (uncertain(found),))),
        notices=_notices(found),
        rows=_rows(report),
    )


def headline(found: Calibration) -> str:
    """One sentence: error, how many parameters are identified, partly so, and not."""
    estimates = cell_estimates(found)
    count = Counter(e.verdict for e in estimates)
    parts = [f"identify {count[Verdict.IDENTIFIED]}"]
    for verdict, words in WORDS.items():
        if count[verdict]:
            parts.append(f"{words} {count[verdict]}")
    listed = f"{', '.join(parts[:-1])} and {parts[-1]}" if parts[1:] else parts[0]
    return (
        f"The calibrated cell follows {_error(found.fitted)}; of its {len(estimates)} parameters "
        f"{'these tests' if found.fitted[1:] else 'this test'} {_s(found, listed)}."
    )


WORDS = {
    Verdict.PARTLY: "tell something of",
    Verdict.AT_BOUND: "push to its bound",
    Verdict.UNTOLD: "do not narrow",
    Verdict.PRIOR: "do not show",
}


def _s(found: Calibration, listed: str) -> str:
    """The verbs as one test has them."""
    if found.fitted[1:]:
        return listed
    for plural, one in (("identify", "identifies"), ("tell ", "tells "), ("push ", "pushes "),
                        ("do not", "does not")):  # fmt: skip
        listed = listed.replace(plural, one)
    return listed


def _error(tests: tuple[Fitted, ...]) -> str:
    done = [f for f in tests if math.isfinite(f.rms_V)]
    if not done:
        return "none of its tests to the end"
    worst = max(done, key=lambda f: f.rms_V)
    which = f"its {len(done)} tests" if done[1:] else "its test"
    if len(done) < len(tests):
        which = f"{len(done)} of its {len(tests)} tests to the end,"
    noise = (
        "as close as their noise allows"
        if all(f.rms_V <= AS_NOISE * f.noise_V for f in done)
        else f"the noise is {fixed(1e3 * max(f.noise_V for f in done), 1)} mV"
    )
    return f"{which} to {fixed(1e3 * worst.rms_V, 1)} mV a cell ({noise})"


def uncertain(found: Calibration) -> str:
    """What is not identified, the least known first."""
    open_ = [e for e in cell_estimates(found) if e.verdict is not Verdict.IDENTIFIED]
    worst = sorted(open_, key=lambda e: -e.left_of_prior)
    if not worst:
        return ""
    names = ", ".join(phrase(e.name) for e in worst[:NAMED])
    more = f" and {len(worst) - NAMED} more (below)" if len(worst) > NAMED else ""
    return f"Uncertain: {names}{more}."


def cell_estimates(found: Calibration) -> list[Estimate]:
    """Of all parameters of the cell, in the order in which they are shown."""
    told = (*found.answer.estimates, *found.answer.derived)
    return [told[k] for k in in_order([e.name for e in told])]


def _notices(found: Calibration) -> tuple[Notice, ...]:
    out = []
    if found.missing:
        text = f"Interrupted: not computed are {', '.join(found.missing)}."
        out.append(Notice(text=text, severity=Severity.DOUBT))
    if early := [f.name for f in found.fitted if not math.isfinite(f.rms_V)]:
        text = f"The simulated cell does not come to the end of {', '.join(early)}."
        out.append(Notice(text=text, severity=Severity.DOUBT))
    estimates = cell_estimates(found)
    if bound := [phrase(e.name) for e in estimates if e.verdict is Verdict.AT_BOUND]:
        text = (
            f"At the edge of what was let: {', '.join(bound)}. The cell to start from, or the "
            "model, may not be that of this pack."
        )
        out.append(Notice(text=text, severity=Severity.DOUBT))
    return tuple(out)


def _rows(report: CalibrationReport) -> tuple[Row, ...]:
    found = report.found
    start = found.problem.pack.cell.name
    held = [f.held_out_rms_V for f in found.fitted if f.held_out_rms_V is not None]
    capacity = [e for e in found.answer.estimates if e.name == "capacity_C"]
    rows = [Row(label="Pack", value=" ".join(filter(None, (report.pack, report.layout))))]
    rows += [
        Row(
            label="Capacity of a cell",
            value=with_unit(e),
            note=f"90 % within {called(e.name).value(e.lower)} and {called(e.name).value(e.upper)}",
        )
        for e in capacity
    ]
    rows.append(Row(label="Cell to start from", value=start))
    if held:
        rows.append(_held_out(held))
    use, note = f"--pack {report.pack_file}", "with analyze, or twin replay, age and explain"
    if error_V := stated_error_V(found.fitted):
        stated = f"errs by {fixed(1e3 * error_V, 1)} mV a cell in tests it was not fitted to (what "
        stated += "it misses where a voltage dives counts for less)"
        note += f"; it states that it {stated}"
    rows.append(Row(label="To use it", value=use, note=note))
    if found.advice:
        rows.append(Row(label="Further test worth most", value=found.advice[0].name))
    return tuple(rows)


def _held_out(held: list[float]) -> Row:
    """The worst prediction, of those that come to the end of their test."""
    whole = [v for v in held if math.isfinite(v)]
    note = "a cell, RMS: the worst of the tests, each predicted from the others"
    if len(whole) < len(held):
        note += f"; {len(held) - len(whole)} of {len(held)} predictions end early"
    worst_mV = 1e3 * max(whole) if whole else None
    return Row(
        label="Error in a test not fitted to", value=fixed(worst_mV, 1), unit="mV", note=note
    )
