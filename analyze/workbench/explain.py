"""`twin explain`: recordings of a pack and its twin -> what was left out."""

import filecmp
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import click
import numpy as np

from analyze.checks import WrongUse, check_pack_name, checked_pack, is_log, writable
from analyze.conceal import Channel
from analyze.interrupt import remembered
from analyze.job import sha256_of
from analyze.mismatching import allowed_of, remarks_of
from analyze.names import printable
from analyze.pack_choice import PackChoice, cell_beside
from analyze.workbench.drawn import Ask, Drawn, beyond, read_drawn, refusing
from analyze.workbench.explained import doubts_of, print_finding, print_packs, report_of
from analyze.workbench.reveal import revealed_of
from analyze.workbench.watch import watching
from reports.mismatch import Recorded, mismatch_page
from reports.render import render
from segment import motions_at
from twin.calibrate.doubt import Other
from twin.constants import ZERO_CELSIUS_K
from twin.mismatch import (
    Finding,
    Flight,
    Revealed,
    Verdict,
    adopted_text,
    explain,
    finding_json,
    reveal_json,
)
from twin.whole_file import write_whole

BEYOND_V = 0.5  # of a cell, outside its cut-offs: no sensor that is merely off
FULLEST, OVERFULL_V = 0.99, 0.1  # share of the samples below; of a cell, above its cut-off
MOST_CHARGE = 4.0  # of the capacity: no gain of a sensor is so far off
WARMER_K = 2.0  # than the pack file says: more than a thermometer errs
FILE, PAGE, REVEALED = "mismatch.json", "explain.html", "reveal.json"
ADOPTED = "# by twin explain --adopt, which may replace it\n"  # how such a pack file begins


@dataclass(frozen=True, kw_only=True)
class Request:
    """The command line."""

    sources: tuple[Path, ...]
    holdout: tuple[Path, ...]
    pack: Path
    out: Path
    adopt: Path | None
    between: str | None
    battery: int | None
    conceal: str
    reveal: tuple[Path, ...]
    floor_mv: float | None = None

    def __post_init__(self) -> None:
        if self.adopt:
            _check_adopt(self.adopt, self.pack)
        if self.floor_mv is not None and not math.isfinite(self.floor_mv):
            raise WrongUse(f"--floor-mv {self.floor_mv}: expected a number of mV")
        times = Counter(path.resolve() for path in self.logs)
        if twice := [path for path, n in times.items() if n > 1]:
            raise WrongUse(
                f"{click.format_filename(twice[0])} is given twice: what is fitted cannot be held "
                "out, and no recording counts twice"
            )
        for one, other in combinations(self.logs, 2):
            if one.is_file() and other.is_file() and filecmp.cmp(one, other, shallow=False):
                raise WrongUse(
                    f"{click.format_filename(other)} is a copy of {click.format_filename(one)}: "
                    "what is fitted cannot be held out, and no recording counts twice"
                )

    @property
    def logs(self) -> tuple[Path, ...]:
        """All recordings."""
        return *self.sources, *self.holdout

    @cached_property
    def named(self) -> Mapping[str, Path]:
        """Name -> recording; equal file names are told apart by their folders, or by number."""
        plain = [printable(path.name) for path in self.logs]
        whole = [printable(path.as_posix()) for path in self.logs]
        names = [
            name if plain.count(name) == 1 else w for name, w in zip(plain, whole, strict=True)
        ]
        return {
            name if names.count(name) == 1 else f"{name} ({k})": path
            for k, (name, path) in enumerate(zip(names, self.logs, strict=True), start=1)
        }

    @cached_property
    def concealed(self) -> frozenset[Channel]:
        """What --conceal says; WrongUse if there is no such channel."""
        known = {c.value: c for c in Channel}
        names = [name.strip() for name in self.conceal.split(",") if name.strip()]
        for name in names:
            if name not in known:
                raise WrongUse(f"--conceal: no channel {name!r}: expected {' or '.join(known)}")
        return frozenset(known[name] for name in names)


def run(request: Request) -> int:
    """Explain, write and tell; the exit code.

    The verdict is written before a channel that is to be revealed is opened.
    """
    kept = tuple(sorted(c.value for c in request.concealed))
    _check_free(request.out)
    choice = checked_pack(request.pack)
    drawn = drawn_of(request, choice)
    recorded = tuple(Recorded(name=n, sha256=sha256_of(path)) for n, path in request.named.items())
    print_packs({name: d.use for name, d in drawn.items()})
    for text in doubts_of(drawn):
        click.echo(f"doubtful {text}", err=True)
    with ExitStack() as folders:
        for folder in (request.out, *([request.adopt.resolve().parent] if request.adopt else [])):
            folders.enter_context(writable(folder))
        finding = _explained(drawn, choice, len(request.sources), request.floor_mv)
        with refusing():
            _write_verdict(request.out, finding)
    print_finding(finding)
    drawn = _started(drawn, finding)
    adopted = _adopted(request, choice, finding)
    revealed: tuple[Revealed, ...] = ()
    try:
        with refusing():
            revealed = revealed_of(request.reveal, request.named, drawn, adopted)
        if revealed:
            write_whole(request.out / REVEALED, _json(reveal_json(revealed)))
    finally:  # a channel that cannot be read takes nothing from the page
        report = report_of(choice, recorded, drawn, finding, request.adopt if adopted else None)
        shown = replace(report, revealed=revealed, concealed=kept)
        with refusing():
            write_whole(request.out / PAGE, render(mismatch_page(shown)))
    for file in (FILE, PAGE, *([REVEALED] if revealed else [])):
        click.echo(f"written  {click.format_filename(request.out / file)}")
    if request.adopt and not adopted:
        raise WrongUse(f"--adopt: nothing was named, the verdict is {finding.verdict.value!r}")
    return 0


def _check_free(out: Path) -> None:
    """WrongUse if a folder has the name of a file of ours."""
    for name in (FILE, PAGE, REVEALED):
        if (out / name).is_dir():
            shown = click.format_filename(out / name)
            raise WrongUse(f"{shown} is a folder: move it out of the way")


def _check_adopt(adopt: Path, pack: Path) -> None:
    """WrongUse if that name is not for a pack file that is written."""
    shown = f"--adopt {click.format_filename(adopt)}"
    check_pack_name("--adopt", adopt, pack)
    try:
        own = not adopt.exists() or adopt.read_bytes().startswith(ADOPTED.encode())
    except OSError as e:
        raise WrongUse(f"{shown}: cannot be written: {e.strerror}") from e
    if not own:
        raise WrongUse(
            f"{shown} is there and was not written by an earlier --adopt: it is not replaced, give "
            "another name"
        )


def _drawn(path: Path, request: Request, choice: PackChoice) -> Drawn:
    ask = Ask(
        source=path, pack=request.pack, out=request.out, between=_between(path, request),
        sensor=None, battery=request.battery, concealed=request.concealed,
    )  # fmt: skip
    with refusing():
        drawn = read_drawn(ask, choice)
    check_voltage(drawn)
    check_charge(drawn)
    doubts = (
        *drawn.doubts,
        *beyond(choice, [(drawn.pack, drawn.load)]),
        *_warmer(drawn, choice),
        *_no_current(drawn),
        *_overfull(drawn),
    )
    return replace(drawn, doubts=doubts)


def _between(path: Path, request: Request) -> str | None:
    """What is said of CSVs is not said of a log beside them."""
    if request.between and is_log(path) and not all(map(is_log, request.logs)):
        return None
    return request.between


def check_voltage(drawn: Drawn) -> None:
    """WrongUse if there is no voltage to compare with, or not that of so many cells."""
    measured = drawn.recorded_V[drawn.judged & np.isfinite(drawn.recorded_V)]
    if not measured.size:
        raise WrongUse(
            f"{drawn.name}: no voltage was recorded, so there is nothing to compare the twin with: "
            "give a recording with one (a CSV needs a column such as 'Voltage / V')"
        )
    cell, series = drawn.pack.cell, drawn.pack.series
    low_V, high_V = cell.lower_cut_off_V - BEYOND_V, cell.upper_cut_off_V + BEYOND_V
    usual_V = float(np.median(measured))
    if not low_V <= usual_V / series <= high_V:
        fits = [n for n in range(1, 101) if low_V <= usual_V / n <= high_V]
        hint = f"; it fits {' or '.join(map(str, fits[:3]))} in series" if fits else ""
        raise WrongUse(
            f"{drawn.name}: {usual_V:.3f} V is {usual_V / series:.3f} V a cell with {series} in "
            f"series, but {cell.name} works from {cell.lower_cut_off_V} to "
            f"{cell.upper_cut_off_V} V: check series in the pack file and the unit{hint}"
        )


def check_charge(drawn: Drawn) -> None:
    """WrongUse if a pack gave or took far more charge than it holds."""
    pack = drawn.pack
    moved_C = float(np.ptp(drawn.load.drawn_C()))
    if moved_C > MOST_CHARGE * pack.rated_C:
        raise WrongUse(
            f"{drawn.name}: {moved_C / 3600:.2f} Ah between its fullest and its emptiest are "
            f"{moved_C / pack.rated_C:.1f} times the {pack.rated_C / 3600:.2f} Ah of the pack: "
            "check the unit of its current, and capacity_ah and parallel in the pack file"
        )


def _overfull(drawn: Drawn) -> tuple[str, ...]:
    """What is doubtful in a voltage to which no such pack is charged."""
    drawing = drawn.judged & (drawn.load.current_A >= 0.0) & np.isfinite(drawn.recorded_V)
    cell, series = drawn.pack.cell, drawn.pack.series
    most_V = float(np.quantile(drawn.recorded_V[drawing], FULLEST)) if drawing.any() else 0.0
    if most_V / series <= cell.upper_cut_off_V + OVERFULL_V:
        return ()
    return (
        f"{most_V:.2f} V while it is not charged are {most_V / series:.2f} V a cell with {series} "
        f"in series, and {cell.name} is full at {cell.upper_cut_off_V} V: are there more cells in "
        "series than the pack file says, or does the sensor read too much?",
    )


def _warmer(drawn: Drawn, choice: PackChoice) -> tuple[str, ...]:
    """What is doubtful in the temperature of the pack file beside this recording."""
    stated_C, measured_C = choice.file.start.temperature_c, drawn.use.initial_K - ZERO_CELSIUS_K
    if stated_C is None or abs(measured_C - stated_C) <= WARMER_K:
        return ()
    return (
        f"The pack started at {measured_C:.1f} °C, as was measured, not at the {stated_C:g} °C "
        "of the pack file: what is measured is taken.",
    )


def _no_current(drawn: Drawn) -> tuple[str, ...]:
    """That the pack never drew any."""
    if drawn.load.current_A.any():
        return ()
    return ("The current is zero throughout: is the right column taken for it?",)


def flight_of(drawn: Drawn, name: str, allowed: tuple[Other, ...]) -> Flight:
    """As the engine takes it, with cells that may be its own as well."""
    return Flight(
        name=name,
        pack=drawn.pack,
        load=drawn.load,
        voltage_V=drawn.recorded_V,
        judged=drawn.judged,
        motion=motions_at(drawn.load.time_s, drawn.segments),
        temperature_K=drawn.temperature_K,
        cell_voltage_V=drawn.cell_voltage_V,
        recorded=drawn.recorded,
        allowed=allowed,
        start_std=drawn.use.soc_std,
    )


def flights_of(
    drawn: Mapping[str, Drawn], choice: PackChoice
) -> tuple[list[Flight], tuple[str, ...]]:
    """All of one pack file, and why no other cells are known that may be its own as well."""
    first = next(iter(drawn.values()))  # the cell is that of one pack file
    allowed, untold = allowed_of(first.pack, choice)
    return [flight_of(d, name, allowed) for name, d in drawn.items()], untold


def drawn_of(request: Request, choice: PackChoice) -> dict[str, Drawn]:
    """Name -> recording; what is to be concealed is."""
    return {name: _drawn(path, request, choice) for name, path in request.named.items()}


def _explained(
    drawn: Mapping[str, Drawn], choice: PackChoice, fitted: int, floor_mv: float | None
) -> Finding:
    """By the first so many recordings; the others are held out."""
    slow_V = None if floor_mv is None else 1e-3 * floor_mv
    first = next(iter(drawn.values()))
    flights, untold = flights_of(drawn, choice)
    with refusing(), watching(None, "models") as tell, remembered() as interrupted:
        looked_at = 0

        def progress(ids: Sequence[str]) -> None:
            nonlocal looked_at
            looked_at += 1
            tell(looked_at, " + ".join(ids))

        found = explain(flights[:fitted], flights[fitted:], slow_V=slow_V, progress=progress)
        if interrupted():
            raise KeyboardInterrupt
    stated = floor_mv is not None
    return found.remarked((*remarks_of(first.use, found.verdict, stated=stated), *untold))


def _started(drawn: Mapping[str, Drawn], finding: Finding) -> dict[str, Drawn]:
    """Packs as full as was found where nothing had told it."""
    return {
        name: replace(d, pack=replace(d.pack, initial_soc=finding.starts[name][0]))
        if name in finding.starts
        else d
        for name, d in drawn.items()
    }


def _write_verdict(out: Path, finding: Finding) -> None:
    """What an earlier call left goes: it is not of this verdict."""
    for name in (PAGE, REVEALED):
        (out / name).unlink(missing_ok=True)
    write_whole(out / FILE, _json(finding_json(finding)))


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=1) + "\n"


def _adopted(request: Request, choice: PackChoice, finding: Finding) -> str:
    """The text of the pack file with what was named, "" if nothing was; written if asked for."""
    if finding.verdict is not Verdict.NAMED:
        return ""
    path = request.adopt or request.pack
    text = adopted_text(finding, choice.file, cell=cell_beside(choice.cell, path))
    if request.adopt:
        write_whole(path, ADOPTED + text)
        click.echo(f"adopted  {click.format_filename(path)}")
    return text
