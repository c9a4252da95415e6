"""`twin age`: a life of many cycles, written as it goes."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from itertools import islice

import click

from analyze.checks import WrongUse, checked_pack, writable
from analyze.interrupt import Asked, asked_to_stop
from analyze.pack_choice import PackChoice
from analyze.version import code_sha256, version
from analyze.workbench.ageing_table import (
    CELLS_HEADER,
    HEADER,
    cell_rows,
    rows,
)
from analyze.workbench.checkpoint import Checkpoint, CheckpointError, from_text
from analyze.workbench.drawn import (
    Drawn,
    beyond,
    in_air,
    load_sha256,
    pack_lines,
    pack_sha256,
    read_drawn,
    refusing,
)
from analyze.workbench.life import CHECKPOINT, Life, Request
from analyze.workbench.listing import print_table
from analyze.workbench.watch import watching
from reports.quantity import fixed
from twin.ageing import Cycle, Regime, age
from twin.effects import AGEING
from twin.solution import Status

OKANE_CELL = "lg_m50"
ASSUMED = (
    "ageing   with the constants of O'Kane 2022 for the LG M50, not measured on this pack: trust "
    "differences between loads more than lifetimes"
)


def run(request: Request) -> int:
    """Age, write and tell; the exit code."""
    choice = checked_pack(request.pack)
    with refusing():
        drawn = read_drawn(request, choice)
        if not drawn.pack.ages:
            raise WrongUse(_nothing_ages(drawn))
        lives = [_begun(asked, each, choice) for asked, each in _cases(request, drawn)]
    flown = ((life.drawn.pack, life.drawn.load) for life in lives)
    for text in (*drawn.doubts, *beyond(choice, flown)):
        click.echo(f"doubtful {text}", err=True)
    codes = []
    with ExitStack() as folders, asked_to_stop("cycle") as stop, refusing():
        for life in lives:
            folders.enter_context(writable(life.request.out))
        for life in lives:
            codes.append(_run(life, choice, stop))
            if stop() and len(codes) < len(lives):
                click.echo(f"{len(codes)} of {len(lives)} temperatures were begun.", err=True)
                return 130
    return max(codes)


def _cases(request: Request, drawn: Drawn) -> list[tuple[Request, Drawn]]:
    """One, or one for each temperature in a folder of its own."""
    out: list[tuple[Request, Drawn]] = []
    for celsius in dict.fromkeys(request.ambient_c or ()):
        pack, load = in_air(celsius, drawn.pack, drawn.load)
        use = replace(
            drawn.use,
            initial_K=pack.initial_K,
            ambient_K=load.ambient_K,
            origins={**drawn.use.origins, "initial_K": "--ambient-c", "ambient_K": "--ambient-c"},
        )
        asked = replace(request, out=request.out / f"{celsius:g}C")
        if asked.out in {other.out for other, _ in out}:
            raise WrongUse(f"--ambient-c: two temperatures have the folder {asked.out.name}")
        out.append((asked, replace(drawn, pack=pack, load=load, use=use)))
    return out or [(request, drawn)]


def _begun(request: Request, drawn: Drawn, choice: PackChoice) -> Life:
    """A new life, or the one in the folder."""
    regime = Regime(
        load=drawn.load,
        repeat=request.repeat,
        rest_s=request.rest_s,
        charge_rate=request.charge_rate,
        until_rate=request.until_rate,
        full_V=request.charge_to,
    )
    regime.check(drawn.pack)
    identity = {
        "pack": pack_sha256(choice, drawn.use),
        "load": load_sha256(drawn.load),
        "protocol": _in_words(regime),
        "version": f"{version()}, {code_sha256('twin')[:16]}",
    }
    found = _found(request, identity)
    return Life(
        request=request,
        drawn=drawn,
        regime=regime,
        identity=identity,
        cycles=list(found.cycles) if found else [],
        last=found.last if found else None,
    )


def _found(request: Request, identity: Mapping[str, str]) -> Checkpoint | None:
    """The run in the folder; WrongUse if there is one that is not to be gone on with."""
    file = request.out / CHECKPOINT
    shown = click.format_filename(file)
    if not file.exists():
        return None
    if not request.resume:
        raise WrongUse(
            f"{shown} is there from an earlier run: --resume goes on with it; to begin anew "
            "remove it, or choose another --out"
        )
    try:
        return from_text(file.read_text(encoding="utf-8"), identity, name=shown)
    except (CheckpointError, OSError, UnicodeDecodeError) as e:
        raise WrongUse(str(e)) from e


def _run(life: Life, choice: PackChoice, stop: Asked) -> int:
    """One life; the exit code."""
    _announce(life, choice)
    interrupted = _live(life, stop)
    life.save()
    life.draw()
    _tell(life)
    return _ended(life, interrupted=interrupted)


def _announce(life: Life, choice: PackChoice) -> None:
    """What is about to be done, and what it rests on."""
    drawn = life.drawn
    click.echo(f"load     {drawn.name}: {_load_words(drawn)}\n{pack_lines(drawn.use)}")
    if choice.cell != OKANE_CELL:
        click.echo(ASSUMED)
    if life.last is not None:
        click.echo(f"going on after cycle {life.done}")


def _live(life: Life, stop: Asked) -> bool:
    """Cycles until enough, or the end of it; True if a person interrupted it."""
    if life.faded():
        return False
    wanted = life.request.cycles
    left = wanted - life.done if life.last else wanted + 1  # the first charge is one more
    cycles = islice(age(life.drawn.pack, life.regime, after=life.last), max(left, 0))
    with watching(wanted, "cycles", done=life.done) as tell:
        for aged in cycles:
            life.add(aged)
            tell(aged.cycle.number, _capacity_words(life))
            if life.faded():
                break
            if stop() and aged is life.last and aged.cycle.number < wanted:
                return True
    return False


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
        + ("" if regime.full_V is None else f" at {regime.full_V!r} V a cell")
    )


def _load_words(drawn: Drawn) -> str:
    load = drawn.load
    seconds = float(load.time_s[-1] - load.time_s[0])
    return f"{seconds:.1f} s, {load.charge_C() / 3600:.3f} Ah"


def _capacity_words(life: Life) -> str:
    first, last = (life.cycles[k].health.capacity_C for k in (0, -1))
    return f"{last / 3600:.3f} Ah, {100 * last / first:.1f} %"


def _tell(life: Life) -> None:
    """What came of it."""
    tables = "ageing.csv, ageing.parquet"
    print_table(HEADER, rows(life.cycles))
    if life.unlike:
        tables += ", cells.csv, cells.parquet"
        print_table(CELLS_HEADER, cell_rows(life.cycles, life.unlike))
    click.echo(_lithium_words(life.cycles[-1]))
    where = click.format_filename(life.request.out)
    click.echo(f"written to {where}: {tables}, ageing.svg, {CHECKPOINT}")


def _ended(life: Life, *, interrupted: bool) -> int:
    """Why it ended; the exit code."""
    request, last = life.request, life.cycles[-1]
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
    if life.faded():
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
