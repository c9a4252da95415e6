"""What `twin calibrate` says of tests and results."""

from collections.abc import Iterable, Sequence

import click

from analyze.workbench.calibrated_files import Files
from analyze.workbench.listing import print_table
from reports.calibration import (
    called,
    cell_estimates,
    grouped,
    headline,
    phrase,
    uncertain,
    word,
)
from reports.quantity import MISSING, ampere_hours, fixed, significant
from twin.calibrate.answer import Estimate
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import Calibration

SHOWN_ADVICE = 3
TESTS = ("test", "samples", "hours", "drawn Ah", "cell from V", "to V", "current from A", "to A")
PARAMETERS = ("parameter", "value", "90 % from", "to", "unit", "error, of the prior's", "verdict")
ERRORS = ("error a cell, RMS mV", "fitted", "predicted from the others", "noise")


def print_tests(tests: Sequence[ReferenceTest]) -> None:
    """What was read, and what was detected in it."""
    rows = [
        (
            t.name,
            str(t.time_s.size),
            fixed(t.time_s[-1] / 3600, 2),
            ampere_hours(float(t.drawn_C()[-1])),
            *(significant(float(v), 3) for v in (t.voltage_V.min(), t.voltage_V.max())),
            *(significant(float(v), 3) for v in (t.current_A.min(), t.current_A.max())),
        )
        for t in tests
    ]
    print_table(TESTS, rows)
    _print_remarks(_of_tests(tests), tests)


def print_found(found: Calibration, tests: Sequence[ReferenceTest]) -> None:
    """What came of it."""
    click.echo(f"\n{headline(found)}\n{uncertain(found)}")
    print_table(ERRORS, [(f.name, *map(_mV, (f.rms_V, f.held_out_rms_V, f.noise_V)))
                         for f in found.fitted])  # fmt: skip
    print_table(PARAMETERS, map(_row, cell_estimates(found)))
    said = set(_of_tests(tests))
    _print_remarks([r for r in found.remarks if r not in said], tests)
    for advice in found.advice[:SHOWN_ADVICE]:
        helped = ", ".join(f"{phrase(name)} to {left:.0%}" for name, left in advice.helps)
        shrunk = f", errors of {helped} of what they are" if helped else ""
        click.echo(f"further  {advice.name}: would add {advice.gain:.1f} nats{shrunk}")
    for text in found.missing:
        click.echo(f"missing  {text}: not computed")


def print_files(files: Files) -> None:
    """What was written, and what for."""
    told = (
        (files.pack, "the pack with its calibrated cell: for --pack"),
        (files.cell, "the cell (BPX)"),
        (files.page, "the page: open it in a browser"),
        (files.fit, "the fit, as numbers"),
        (files.search, "the search, for --resume"),
    )
    for path, what in told:
        if path.exists():
            click.echo(f"written  {click.format_filename(path)}: {what}")


def _of_tests(tests: Sequence[ReferenceTest]) -> list[str]:
    return [f"{t.name}: {r}" for t in tests for r in t.remarks]


def _print_remarks(remarks: Iterable[str], tests: Sequence[ReferenceTest]) -> None:
    for text in grouped(remarks, [t.name for t in tests]):
        click.echo(f"note     {text}")


def _row(e: Estimate) -> tuple[str, ...]:
    c = called(e.name, e.unit)
    values = (c.value(v) for v in (e.value, e.lower, e.upper))
    return (c.text, *values, c.unit, f"{e.left_of_prior:.0%}", word(e.verdict))


def _mV(value_V: float | None) -> str:
    return MISSING if value_V is None else fixed(1e3 * value_V, 2)
