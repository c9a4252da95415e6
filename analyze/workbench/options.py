"""Options that several commands of `twin` have."""

import math
from collections.abc import Callable
from pathlib import Path

import click
from click.core import ParameterSource

CELSIUS = -73.0, 126.0  # what a pack may have: 200 to 400 K
AnyFile = click.Path(exists=True, dir_okay=False, path_type=Path)


def numbers(
    above: float, most: float = math.inf
) -> Callable[[click.Context, click.Parameter, str | None], object]:
    """What reads `"0.5,1"` as (0.5, 1.0), each finite and within the bounds."""
    bounds = f"above {above:g}" + (f", {most:g} at most," if most < math.inf else "")

    def read(
        ctx: click.Context, param: click.Parameter, text: str | None
    ) -> tuple[float, ...] | None:
        if text is None:
            return None
        try:
            found = tuple(float(part) for part in text.split(","))
        except ValueError:
            found = ()
        if not found or not all(above < n <= most and n < math.inf for n in found):
            raise click.BadParameter(
                f"{text!r}: expected numbers {bounds} with commas between them", ctx, param
            )
        return found

    return read


PACK = click.option(
    "--pack",
    type=AnyFile,
    required=True,
    help="Pack file (TOML): the pack, its cell and its physics; keys in docs/pack_file.md.",
)
BETWEEN = click.option(
    "--between",
    type=click.Choice(["linear", "hold"]),
    show_default="linear",
    help="How the current of a CSV runs between rows: straight (a sensor), or held (programmed "
    "steps).",
)
BATTERY = click.option(
    "--battery",
    type=click.IntRange(min=0),
    metavar="N",
    help="Which battery of a log, counted from 0. Default: the one that carries the flight.",
)


def given() -> frozenset[str]:
    """Names of the parameters that stand on the command line; the others have their defaults."""
    ctx = click.get_current_context()
    named = ParameterSource.COMMANDLINE
    return frozenset(name for name in ctx.params if ctx.get_parameter_source(name) is named)


class HoldsOut(click.Command):
    """A command whose --holdout takes all up to the next option: `--holdout b.ulg c.ulg`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Each of several with the option before it, as click would have them."""
        spread: list[str] = []
        taking = False
        for arg in args:
            if arg.startswith("-"):
                taking = arg.partition("=")[0] == "--holdout"
            elif taking and spread[-1] != "--holdout":
                spread.append("--holdout")
            spread.append(arg)
        return super().parse_args(ctx, spread)


def shared(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say what is drawn from which pack."""
    options = (
        PACK,
        BETWEEN,
        click.option(
            "--sensor",
            type=AnyFile,
            help="Recording of a separate current sensor, for a log. Default: a file beside the "
            "log, flight.sensor.csv or flight.csv for flight.ulg.",
        ),
        BATTERY,
    )
    for option in reversed(options):
        command = option(command)
    return command


def out(what: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The option that says where the results go, and `what` becomes of earlier ones there."""
    kind = click.Path(path_type=Path)
    return click.option("--out", type=kind, required=True, help=f"Folder of the results; {what}")
