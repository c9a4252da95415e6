"""`twin prove`: trials in which the effect is in the data and concealed from the tool."""

import secrets
import shlex
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from importlib.util import find_spec
from os import cpu_count
from pathlib import Path
from typing import Any

import click

from analyze.checks import WrongUse, writable
from analyze.interrupt import asked_to_stop
from analyze.version import version
from analyze.workbench.listing import print_table
from analyze.workbench.watch import watching
from proof.check import Checked, OtherVersionError, check
from proof.ledger import LedgerError
from proof.outcome import Outcome, Proof
from proof.places import LEDGER, PAGE, PROOF, in_the_way
from proof.repeated import NEAR, can_make, drawn, repeated
from proof.run import Watch, code, prove
from proof.shown import show
from proof.simulated.draw import trials as simulated
from proof.targets import over_noise
from proof.trial import Trial, order
from reports.quantity import fixed

NEEDED = ("pybamm", "cryptography")
SOLVES, CELLS = "solves", "cells"
ANEW = "cells-anew"  # none of those that come with the program, nor of a run that took them
SHOWN = ("numpy", "scipy", "casadi", "pybamm", "cryptography")
SEEDS = 10**9
SHORT = 10  # digits of a hash that are printed


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """The command line."""

    out: Path
    seed: int | None
    trials: int
    recordings: Path | None
    jobs: int | None
    check: Path | None
    again: int | None = None
    anew: bool = False


def run(request: Request) -> int:
    """Make, judge, open, write and tell; the exit code."""
    if request.check is not None:
        return _check(request.check, request.again)
    if request.again is not None:
        raise WrongUse("--again: which proof is not said: give --check DIR with it")
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        raise WrongUse(
            f"{' and '.join(missing)} not installed: the truths of twin prove are made by another "
            "simulator and sealed: pip install '.[proof]' in a clone"
        )
    with writable(request.out):
        if folder := in_the_way(request.out):
            raise WrongUse(f"{click.format_filename(folder)} is in the way: move it elsewhere")
        return _proven(request)


def _proven(request: Request) -> int:
    start, seed = time.perf_counter(), request.seed
    if seed is None:
        seed = secrets.randbelow(SEEDS)
    trials = _trials(request, seed)
    if not trials:
        raise WrongUse("nothing to prove: give --trials or --recordings")
    click.echo(f"seed     {seed}: {len(trials)} trials")
    jobs = request.jobs or cpu_count() or 1
    command, versions = _again(request, seed), dict(_versions())
    asked_for: dict[str, Any] = {
        "seed": seed,
        "command": command,
        "versions": versions,
        "code": code(),
    }
    with asked_to_stop("trial") as asked, watching(3 * len(trials), "trials") as tell:
        watch = Watch(tell=_Counted(tell, len(trials)), stop=asked)
        done, left, ledger = prove(trials, request.out, jobs=jobs, watch=watch, asked=asked_for)
        stopped = asked()
    proof = Proof(
        **asked_for,
        trials=done,
        not_made=left,
        head=ledger.head,
        seconds=time.perf_counter() - start,
    )
    show(request.out, proof, ledger)
    _tell(proof)
    for file in (PROOF, PAGE):
        click.echo(f"written  {click.format_filename(request.out / file)}")
    if stopped:
        return 130
    return 1 if left else 0


class _Counted:
    """Where three phases of so many trials have come to."""

    PHASES = ("sealed", "judged", "compared")

    def __init__(self, tell: object, total: int) -> None:
        self._tell, self._total = tell, total

    def __call__(self, phase: str, done: int, of: int, name: str) -> None:
        assert callable(self._tell)
        before = self.PHASES.index(phase) * self._total
        self._tell(before + done + self._total - of, f"{phase} {name}")
        if done == of:
            click.echo(f"{phase:8s} {done} of {self._total}")


def _trials(request: Request, seed: int) -> tuple[Trial, ...]:
    """Simulated and recorded ones together, under names that tell nothing, in random order."""
    every = list(simulated(seed, request.trials, request.out.resolve() / SOLVES))
    if request.recordings is not None:
        from proof.recorded.shipped import put_into
        from proof.recorded.trials import recorded  # late: it needs the calibration

        cells = request.out.resolve() / (ANEW if request.anew else CELLS)
        if not request.anew:
            put_into(cells)
        every += recorded(request.recordings.resolve(), cells)
    return tuple(
        replace(every[place], name=f"trial-{number:03d}")
        for number, place in enumerate(order(seed, len(every)), start=1)
    )


def _again(request: Request, seed: int) -> str:
    parts = ["twin", "prove", "--seed", str(seed), "--trials", str(request.trials)]
    if request.recordings is not None:
        parts += ["--recordings", str(request.recordings), *(["--anew"] if request.anew else [])]
    return shlex.join(parts)


def _versions() -> Iterator[tuple[str, str]]:
    yield "drone-battery-health", version()
    for name in SHOWN:
        try:
            yield name, version_of(name)
        except PackageNotFoundError:
            continue


def _tell(proof: Proof) -> None:
    """A line a trial, what failed first."""
    order = {o: k for k, o in enumerate((Outcome.WRONG, Outcome.MISSED, Outcome.PART))}
    rows = [
        (
            t.outcome.value,
            t.truth.kind,
            f"{t.truth.strength:.1f}",
            " + ".join("|".join(own) for own in t.truth.effects) or t.truth.said[:40],
            " + ".join("|".join((n.id, *n.equivalent)) for n in t.named) or t.verdict,
            fixed(over_noise(t), 2),
        )
        for t in sorted(proof.trials, key=lambda t: (order.get(t.outcome, 9), t.truth.kind))
    ]
    print_table(("outcome", "kind", "x floor", "truth", "said", "held out, x noise"), rows)
    for n in proof.not_made:
        click.echo(f"not made {n.name} ({n.source}): {n.reason}", err=True)
    right = sum(t.outcome is Outcome.RIGHT for t in proof.trials)
    click.echo(f"right    {right} of {len(proof.trials)}, {len(proof.not_made)} not made")


def _check(out: Path, again: int | None) -> int:
    if find_spec("cryptography") is None:
        raise WrongUse(
            "--check: cryptography not installed: what was sealed cannot be opened again"
        )
    try:
        found = check(out)
    except FileNotFoundError as e:
        raise WrongUse(
            f"--check: no proof in {click.format_filename(out)}: {LEDGER} is missing; expected a "
            "folder that twin prove wrote: give the one that was its --out"
        ) from e
    except OtherVersionError as e:
        raise WrongUse(f"--check: {e}") from e
    except OSError as e:
        raise WrongUse(f"--check: no proof in {click.format_filename(out)}: {e}") from e
    except LedgerError as e:
        click.echo(f"broken   {e}", err=True)
        return 1
    _tell_broken(found.broken)
    click.echo(f"code     {_of_code(found)}")
    if found.broken:
        return 1
    click.echo(
        f"holds    {found.opened} trials: files, {PROOF} and ledger agree, and so does its order: "
        "sealed, judged, opened. Whoever writes them all can make them agree: that verdicts came "
        "first is shown by a hash that was published before, or by running it yourself, with a "
        "--seed of your own or with --again"
    )
    return 0 if again is None else _repeat(out, again)


def _of_code(found: Checked) -> str:
    if found.code == (installed := code()):
        return "what judged is what is installed"
    return (
        f"what judged ({found.code[:SHORT]}) is not what is installed ({installed[:SHORT]}), which "
        "may say otherwise"
    )


def _repeat(out: Path, count: int) -> int:
    """Tell what comes out again, trial by trial."""
    if not can_make():
        click.echo("again    no truth is made again: pybamm not installed: pip install '.[proof]'")
    broken, names = 0, drawn(out, count)
    with asked_to_stop("trial") as asked:
        for name in names:
            click.echo(f"again    {name}")
            found = tuple(repeated(out, name))
            _tell_broken(found)
            broken += bool(found)
            if asked():
                return 130
    click.echo(f"again    {len(names) - broken} of {len(names)} trials as written ({NEAR})")
    return 1 if broken else 0


def _tell_broken(found: Iterable[str]) -> None:
    for text in found:
        click.echo(f"broken   {text}", err=True)
