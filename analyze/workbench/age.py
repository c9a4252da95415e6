"""`twin age`: a life of many cycles, written as it goes."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import click

from analyze.checks import WrongUse, checked_pack, make_writable
from analyze.columns import as_csv, as_parquet
from analyze.version import version
from analyze.workbench.ageing_table import HEADER, ageing_columns, rows
from analyze.workbench.checkpoint import Checkpoint, CheckpointError, from_text, to_text
from analyze.workbench.drawn import (
    Ask,
    Drawn,
    load_sha256,
    pack_lines,
    pack_sha256,
    read_drawn,
    refusing,
)
from analyze.workbench.interrupt import asked_to_stop
from analyze.workbench.listing import print_table
from analyze.workbench.plots import ageing_svg
from analyze.workbench.watch import watching
from reports.quantity import fixed
from twin.ageing import Aged, Cycle, Regime, age
from twin.effects import AGEING
from twin.solution import Status
from twin.whole_file import write_whole

CHECKPOINT = "ageing.checkpoint.json"
SAVED_EVERY_S = 5.0
OKANE_CELL = "lg_m50"
ASSUMED = (
    "ageing   with the constants of O'Kane 2022 for the LG M50, not measured on this pack: trust "
    "differences between loads more than lifetimes"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Request(Ask):
    """The command line."""

    cycles: int
    repeat: bool
    rest_s: float
    charge_rate: float
    until_rate: float
    stop_at_capacity: float | None
    resume: bool


@dataclass(slots=True)
class _Life:
    """The run so far; `last` is the pack after the last whole cycle."""

    identity: Mapping[str, str]
    out: Path
    cycles: list[Cycle]
    last: Aged | None
    saved_s: float = 0.0

    def add(self, aged: Aged) -> None:
        """One more cycle; written if the last time was a while ago."""
        self.cycles.append(aged.cycle)
        if aged.cycle.status is Status.DONE:
            self.last = aged
        if time.monotonic() - self.saved_s > SAVED_EVERY_S:
            self.save()

    def save(self) -> None:
        """Tables, then the checkpoint; each whole."""
        columns = ageing_columns(self.cycles)
        write_whole(self.out / "ageing.csv", as_csv(columns))
        write_whole(self.out / "ageing.parquet", as_parquet(columns))
        if self.last is not None:
            whole = tuple(c for c in self.cycles if c.status is Status.DONE)
            checkpoint = Checkpoint(identity=self.identity, cycles=whole, last=self.last)
            write_whole(self.out / CHECKPOINT, to_text(checkpoint))
        self.saved_s = time.monotonic()


def run(request: Request) -> int:
    """Age, write and tell; the exit code."""
    choice = checked_pack(request.pack)
    with refusing():
        drawn = read_drawn(request, choice)
        regime = Regime(
            load=drawn.load,
            repeat=request.repeat,
            rest_s=request.rest_s,
            charge_rate=request.charge_rate,
            until_rate=request.until_rate,
        )
    if not drawn.pack.ages:
        raise WrongUse(_nothing_ages(drawn))
    if len(drawn.pack.cells()) > 1:
        raise WrongUse("the cells of this pack age unlike each other: leave out weak_cell")
    make_writable(request.out)
    identity = {
        "pack": pack_sha256(choice, drawn.use),
        "load": load_sha256(drawn.load),
        "protocol": _in_words(regime),
        "version": version(),
    }
    life = _begun(request, identity)
    click.echo(f"load     {drawn.name}: {_load_words(drawn)}\n{pack_lines(drawn.use)}")
    if choice.cell != OKANE_CELL:
        click.echo(ASSUMED)
    for text in drawn.doubts:
        click.echo(f"doubtful {text}", err=True)
    if life.last is not None:
        click.echo(f"going on after cycle {life.last.cycle.number}")
    with refusing():
        interrupted = _live(request, drawn, regime, life)
        life.save()
        picture = ageing_svg(life.cycles, repeated=request.repeat)
        write_whole(request.out / "ageing.svg", picture)
    return _tell(request, life, interrupted=interrupted)


def _live(request: Request, drawn: Drawn, regime: Regime, life: _Life) -> bool:
    """Cycles until enough, or the end of it; True if a person interrupted it."""
    done = life.last.cycle.number if life.last else -1
    if _faded(request, life):
        return False
    left = islice(age(drawn.pack, regime, after=life.last), max(request.cycles - done, 0))
    with (
        asked_to_stop("cycle") as stop,
        watching(request.cycles, "cycles", done=max(done, 0)) as tell,
    ):
        for aged in left:
            life.add(aged)
            tell(aged.cycle.number, _capacity_words(life))
            if _faded(request, life):
                break
            if stop() and aged is life.last and aged.cycle.number < request.cycles:
                return True
    return False


def _begun(request: Request, identity: Mapping[str, str]) -> _Life:
    """A new life, or the one in the folder."""
    file = request.out / CHECKPOINT
    shown = click.format_filename(file)
    if not file.exists():
        return _Life(identity=identity, out=request.out, cycles=[], last=None)
    if not request.resume:
        raise WrongUse(
            f"{shown} is there from an earlier run: --resume goes on with it; to begin anew "
            "remove it, or choose another --out"
        )
    try:
        found = from_text(file.read_text(encoding="utf-8"), identity, name=shown)
    except (CheckpointError, OSError, UnicodeDecodeError) as e:
        raise WrongUse(str(e)) from e
    return _Life(identity=identity, out=request.out, cycles=list(found.cycles), last=found.last)


def _faded(request: Request, life: _Life) -> bool:
    """The capacity has fallen below what was asked for."""
    if request.stop_at_capacity is None or not life.cycles:
        return False
    first, last = (life.cycles[k].health.capacity_C for k in (0, -1))
    return last < request.stop_at_capacity * first


def _nothing_ages(drawn: Drawn) -> str:
    ids = ", ".join(f'"{e.id}"' for e in AGEING)
    return (
        f"nothing in this pack ages: its physics are {', '.join(drawn.use.effect_ids) or 'none'}. "
        f'Switch on what should, e.g. in the pack file\n[twin]\nphysics = ["self_heating", {ids}]'
    )


def _in_words(regime: Regime) -> str:
    flown = "repeated to the cut-off" if regime.repeat else "flown once"
    return (
        f"{flown}, rest {regime.rest_s!r} s, charge {regime.charge_rate!r}C "
        f"until {regime.until_rate!r}C"
    )


def _load_words(drawn: Drawn) -> str:
    load = drawn.load
    seconds = float(load.time_s[-1] - load.time_s[0])
    return f"{seconds:.1f} s, {load.charge_C() / 3600:.3f} Ah"


def _capacity_words(life: _Life) -> str:
    first, last = (life.cycles[k].health.capacity_C for k in (0, -1))
    return f"{last / 3600:.3f} Ah, {100 * last / first:.1f} %"


def _tell(request: Request, life: _Life, *, interrupted: bool) -> int:
    """What came of it; the exit code."""
    where = click.format_filename(request.out)
    print_table(HEADER, rows(life.cycles))
    last = life.cycles[-1]
    click.echo(_lithium_words(last))
    click.echo(f"written to {where}: ageing.csv, ageing.parquet, ageing.svg, {CHECKPOINT}")
    if interrupted:
        click.echo(
            f"Interrupted after {last.number} of {request.cycles} cycles. The same command with "
            "--resume goes on.",
            err=True,
        )
        return 130
    if last.status is not Status.DONE:
        click.echo(
            f"Cycle {last.number} could not be completed; in the {last.stopped_in} "
            f"{last.status.value}. Under this regime the life of the pack ends after "
            f"{max(last.number - 1, 0)} whole cycles.",
            err=True,
        )
        return 1
    if _faded(request, life):
        click.echo(f"Capacity below {100 * (request.stop_at_capacity or 0):g} %: stopped.")
    return 0


def _lithium_words(last: Cycle) -> str:
    """Where the lithium went, and that none was lost by the arithmetic."""
    lost, health = last.health.lost, last.health
    parts = {
        "SEI": lost.sei_C, "SEI on cracks": lost.sei_on_cracks_C, "plated": lost.plated_C,
        "dead": lost.dead_C, "trapped": lost.trapped_C,
    }  # fmt: skip
    said = ", ".join(f"{name} {fixed(c / 3.6, 2)}" for name, c in parts.items())
    return (
        f"lithium lost [mAh]: {said}\n"
        f"audit since the start of life: lithium {health.lithium_error:.1e} of all, salt "
        f"{health.salt_change:.1e} of that in the electrolyte, charge {health.charge_error_C:.1e} C"
    )
