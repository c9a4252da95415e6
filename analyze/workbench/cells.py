"""What a calibration found of the single cells of a pack: words and JSON."""

from dataclasses import asdict
from typing import Any

import click

from analyze.workbench.listing import print_table
from twin.calibrate.unlike import Difference, Unlike

NAMES = {"capacity_factor": "capacity", "soc_offset": "charge", "resistance_ohm": "resistance"}
SHOWN = {
    "capacity_factor": (100.0, "%"),
    "soc_offset": (100.0, "%"),
    "resistance_ohm": (1e3, "mOhm"),
}
"""Factor to what is shown, and its unit."""


def tell_cells(unlike: Unlike) -> None:
    """A row a cell: its difference from the mean with the 90 % interval."""
    heads = [f"{NAMES[d.quantity]}, {SHOWN[d.quantity][1]}" for d in unlike.differences]
    header = ("cell", *heads, "rms as the others, mV", "as it is")
    rows = [
        (
            str(k + 1),
            *(_interval(d, k) for d in unlike.differences),
            f"{1e3 * unlike.before_V[k]:.2f}",
            f"{1e3 * unlike.after_V[k]:.2f}",
        )
        for k in range(unlike.before_V.size)
    ]
    print_table(header, rows)
    for d in unlike.differences:
        said = (
            "differ beyond the noise" if d.beyond_noise else "are alike as far as the noise tells"
        )
        click.echo(f"cells    {NAMES[d.quantity]}: they {said} (chance {d.chance:.1g})")


def cells_document(unlike: Unlike) -> dict[str, Any]:
    """The same, in full."""
    return {
        "soc": unlike.soc,
        "differences": {d.quantity: _document(d) for d in unlike.differences},
        "weak_cells": [asdict(w) for w in unlike.weak],
        "rms_as_the_others_mV": (1e3 * unlike.before_V).tolist(),
        "rms_mV": (1e3 * unlike.after_V).tolist(),
    }


def _interval(d: Difference, cell: int) -> str:
    factor, _ = SHOWN[d.quantity]
    low, high = (factor * float(end[cell]) for end in d.interval)
    return f"{factor * float(d.value[cell]):+.3g} ({low:+.3g} to {high:+.3g})"


def _document(d: Difference) -> dict[str, Any]:
    low, high = d.interval
    return {
        "unit": d.unit,
        "value": d.value.tolist(),
        "std": d.std.tolist(),
        "lower_90": low.tolist(),
        "upper_90": high.tolist(),
        "chance": d.chance,
        "beyond_noise": d.beyond_noise,
    }
