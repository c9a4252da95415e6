"""What `twin calibrate` makes of a life: check-ups to a pack that ages so."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import numpy as np

from analyze.checks import checked_pack
from analyze.interrupt import asked_to_stop
from analyze.names import printable
from analyze.pack_choice import PackChoice, cell_beside
from analyze.workbench.calibrated_files import Files
from analyze.workbench.drawn import Ask, beyond, pack_lines, read_drawn
from analyze.workbench.listing import print_table
from analyze.workbench.watch import watching
from twin.ageing import Regime
from twin.calibrate.ageing import AgedFit, LifeProgress, fit_life, told_of_life
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.check_ups import CheckUps, read_check_ups
from twin.calibrate.out import combination, toml_text
from twin.calibrate.polish import MOST_STEPS
from twin.effects import Sei
from twin.pack import Pack
from twin.whole_file import write_whole

HEADER = ("parameter", "value", "90 % from", "to", "unit", "of the prior's std", "")
SHOWN_STIFF = 0.5  # of the prior's standard deviation: combinations known better are told


@dataclass(frozen=True, slots=True, kw_only=True)
class Life:
    """What is asked for; `regime` makes one of a load."""

    check_ups: Path
    cycle: Path | None
    pack: Path
    out: Path
    between: str | None
    regime: Callable[..., Regime]

    @property
    def fit_file(self) -> Path:
        """The fit, beside the pack file."""
        return Files(self.out).ageing


def run_life(life: Life) -> int:
    """Fit, write and tell, in a folder that is there; the exit code."""
    choice = checked_pack(life.pack)
    ask = Ask(source=life.cycle, pack=life.pack, out=life.out, between=life.between, sensor=None,
              battery=None)  # fmt: skip
    drawn, ups = read_drawn(ask, choice), _read(life.check_ups)
    regime = life.regime(load=drawn.load)
    regime.check(drawn.pack)
    click.echo(f"life     {printable(life.check_ups.name)}: {len(ups)} check-ups, "
               f"{ups.cycle[-1]} cycles of {drawn.name}\n{pack_lines(drawn.use)}")  # fmt: skip
    for text in (*drawn.doubts, *beyond(choice, [(drawn.pack, drawn.load)])):
        click.echo(f"doubtful {text}", err=True)
    best, interrupted = _fitted(drawn.pack, regime, ups)
    told = told_of_life(best)
    write_whole(life.out, _pack_text(told, choice, life.out))
    write_whole(life.fit_file, _fit_text(told))
    _tell(told)
    names = ", ".join(click.format_filename(p) for p in (life.out, life.fit_file))
    click.echo(f"written  {names}")
    if interrupted:
        click.echo("Interrupted: the best so far.", err=True)
    return 130 if interrupted else 0


def _read(path: Path) -> CheckUps:
    name = printable(path.stem)
    with path.open(encoding="utf-8-sig", newline="") as stream:
        return read_check_ups(stream, name=name)


def _fitted(pack: Pack, regime: Regime, ups: CheckUps) -> tuple[LifeProgress, bool]:
    """The best, and whether a person stopped it there."""
    best = None
    with asked_to_stop("step") as stop, watching(MOST_STEPS, "steps") as tell:
        for done, best in enumerate(fit_life(pack, regime, ups), start=1):
            tell(done, f"life: {best.error:.2%} of the capacity")
            if stop():
                return best, True
    assert best is not None
    return best, False


def _pack_text(told: AgedFit, choice: PackChoice, out: Path) -> str:
    """The pack file with the fitted numbers, its cell as it lies from there."""
    content = choice.file.model_dump(exclude_none=True)
    content["pack"]["cell"] = cell_beside(choice.cell, out)
    for e in told.answer.estimates:
        table, _, name = e.name.partition(".")
        if table == Sei.id:
            content["effects"].setdefault(Sei.id, {})[name] = e.value
        elif table == "mechanics":
            content["mechanics"][name] = e.value
    return toml_text(content)


def _tell(told: AgedFit) -> None:
    print_table(HEADER, [_row(e) for e in (*told.answer.estimates, *told.answer.derived)])
    simulated_C = told.measured_capacity * told.course.capacity_C
    rows = [
        (str(n), f"{measured / 3600:.4f}", f"{simulated / 3600:.4f}",
         f"{simulated / measured - 1:+.2%}")
        for n, measured, simulated in zip(
            told.ups.cycle, told.ups.capacity_C, simulated_C, strict=True
        )
    ]  # fmt: skip
    print_table(("cycle", "capacity, Ah", "simulated", "off"), rows)
    for c in told.answer.stiff:
        if c.std < SHOWN_STIFF:
            parts = " ".join(f"{share:+.2f} {name}" for name, share in c.loadings)
            click.echo(f"known    to {c.std:.0%} of the prior: {parts}")
    open_ = [e.name for e in told.answer.estimates if e.verdict is Verdict.PRIOR]
    if open_:
        click.echo(f"unknown  this life does not tell {', '.join(open_)}: as the prior has it")


def _row(e: Estimate) -> tuple[str, ...]:
    ends = f"{e.lower:.4g}", f"{e.upper:.4g}"
    return e.name, f"{e.value:.5g}", *ends, e.unit or "1", f"{e.left_of_prior:.0%}", e.verdict.value


def _fit_text(told: AgedFit) -> str:
    """All that is known of the fit, as JSON."""
    estimates = (*told.answer.estimates, *told.answer.derived)
    document = {
        "parameters": [
            asdict(e) | {"verdict": e.verdict.name.lower(),
                         "prior": e.prior if np.isfinite(e.prior) else None}
            for e in estimates
        ],
        "correlations": {
            "names": told.answer.names,
            "matrix": np.round(told.answer.correlations, 4).tolist(),
        },
        "stiff": [combination(c) for c in told.answer.stiff],
        "sloppy": [combination(c) for c in told.answer.sloppy],
        "check_ups": {
            "cycle": told.ups.cycle.tolist(),
            "capacity_ah": (told.ups.capacity_C / 3600).tolist(),
            "simulated_ah": (told.measured_capacity * told.course.capacity_C / 3600).tolist(),
            "before_ah": (told.before.capacity_C / 3600).tolist(),
        },
    }  # fmt: skip
    return json.dumps(document, indent=2, allow_nan=False) + "\n"
