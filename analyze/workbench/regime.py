"""The options that say how a pack is cycled: between flights it rests, is charged, rests."""

from collections.abc import Callable

import click


def regime_options(command: Callable[..., None]) -> Callable[..., None]:
    """Of `twin age`, and of a life that `twin calibrate` is given."""
    positive = click.FloatRange(min=0.0, min_open=True)
    options = (
        click.option(
            "--repeat",
            is_flag=True,
            help="Repeat the load in each cycle until the pack is at its lower cut-off, or one of "
            "its cells is empty.",
        ),
        click.option(
            "--rest-s",
            metavar="SECONDS",
            type=click.FloatRange(min=0.0),
            default=1800.0,
            show_default=True,
            help="Rest before the charge, and after it.",
        ),
        click.option(
            "--charge-rate",
            metavar="RATE",
            type=positive,
            default=1.0,
            show_default=True,
            help="Constant current of the charge, in C.",
        ),
        click.option(
            "--until-rate",
            metavar="RATE",
            type=positive,
            default=0.05,
            show_default=True,
            help="Current that ends the charge at constant voltage, in C.",
        ),
        click.option(
            "--charge-to",
            metavar="VOLTS",
            type=positive,
            help="Voltage of a cell at which the charge is held. Default: its upper cut-off.",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command
