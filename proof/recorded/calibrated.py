"""A pack whose cell is calibrated to reference tests, its cooling being known; kept in a folder."""

import hashlib
import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin.bpx_file import CellWarning
from twin.bpx_out import write_bpx
from twin.builtin import load_cell
from twin.calibrate.out import calibrated_cell
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import Calibration, conclude, fit, problem_of
from twin.effects import SeriesResistance
from twin.pack import Pack
from twin.whole_file import write_whole

VERSION = 11  # of what is kept: raise it where the same inputs give another calibration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibrated:
    """What least squares found.

    Attributes:
        pack: as it was given, with the calibrated cell, at the start of the first test.
        starts: state of charge at the start of each test.
        rms_V: measured minus simulated of each test.
    """

    pack: Pack
    starts: tuple[float, ...]
    rms_V: tuple[float, ...]


def calibrated(
    pack: Pack, tests: Sequence[ReferenceTest], cache: Path, *, only: Sequence[str] | None = None
) -> Calibrated:
    """By least squares to `tests`, or as `cache` (made if it is not there) has it from before.

    `only` names the parameters that are free, None all.
    """
    key = _key(pack, tests, only)
    cell_file, fit_file = cache / f"{key}.bpx.json", cache / f"{key}.json"
    if not (cell_file.exists() and fit_file.exists()):
        *_, best = fit(problem_of(pack, tests, only=only))
        found = conclude(best.problem, best.q, tests, cross_validate=False)
        cache.mkdir(parents=True, exist_ok=True)
        description = f"calibrated to {', '.join(t.name for t in tests)}"
        write_whole(cell_file, write_bpx(calibrated_cell(found), description=description))
        write_whole(fit_file, json.dumps(_numbers(found, len(tests)), indent=1) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CellWarning)  # of numbers that a fit moved far
        cell = load_cell(cell_file)
    told = json.loads(fit_file.read_text())
    kept = tuple(e for e in pack.effects if not isinstance(e, SeriesResistance))
    ohm = SeriesResistance(resistance_ohm=told["ohm"] * pack.series / pack.parallel)
    own = replace(pack, cell=cell, capacity_C=None, effects=(*kept, ohm))
    start = min(told["starts"][0], 1.0)
    return Calibrated(
        pack=replace(own, initial_soc=start),
        starts=tuple(told["starts"]),
        rms_V=tuple(told["rms_V"]),
    )


def _numbers(found: Calibration, tests: int) -> dict[str, float | list[float]]:
    mapped = [found.problem.mapped(found.q, k).numbers for k in range(tests)]
    return {
        "ohm": found.numbers["series_resistance_ohm"],
        "starts": [m["initial_soc"] for m in mapped],
        "rms_V": [float(min(f.rms_V, 1e3)) for f in found.fitted],  # JSON has no infinity
    }


def to_digits(value: float) -> float:
    """Six of them: what goes into a key is the same on another machine, which rounds otherwise."""
    return float(f"{value:.6g}")


def _key(pack: Pack, tests: Sequence[ReferenceTest], only: Sequence[str] | None) -> str:
    """Hash of all that goes in."""
    numbers = pack.series, pack.parallel, pack.capacity_C, pack.initial_soc, pack.initial_K
    settings = repr((VERSION, numbers, pack.effects, pack.mechanics, pack.moved, only))
    told = hashlib.sha256((write_bpx(pack.cell, description="") + settings).encode())
    for t in tests:
        told.update(repr((t.name, t.between, t.ambient_K)).encode())
        for values in (t.time_s, t.current_A, t.voltage_V):
            told.update(np.ascontiguousarray(values).tobytes())
    return f"cell-{told.hexdigest()[:16]}"
