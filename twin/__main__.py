"""`twin`: the workbench of the electrochemical twin."""

import sys
from pathlib import Path

import click

AnyFile = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="drone-battery-health", prog_name="twin")
def main() -> None:
    """Simulate a battery pack with the P2D twin."""


@main.command()
@click.argument("load", metavar="LOAD.csv", type=AnyFile)
@click.option("--pack", type=AnyFile, required=True, help="The pack, as pack.toml describes it.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    required=True,
    help="Folder for replay.csv and replay.svg.",
)
@click.option(
    "--between",
    type=click.Choice(["linear", "hold"]),
    default="linear",
    show_default=True,
    help="How the current runs between rows: straight (a sensor), or held (programmed steps).",
)
def replay(load: Path, pack: Path, out: Path, between: str) -> None:
    """Draw the current of LOAD.csv from a pack and write what the twin answers.

    LOAD.csv has a column time_s (or "Test Time / s") and current_A (or "Current / A"), discharge
    positive, at the terminals of the pack; with a column voltage_V (or "Voltage / V") the error is
    told too. A flight log is replayed by the `analyze` command.

    The exit code is 0 if the whole load was simulated, 1 if it ended early (what came before is
    written), 2 if a file or an option cannot be used.
    """
    from twin.bpx_file import CellError  # late: --help must not wait for them
    from twin.load import LoadError
    from twin.pack_file import PackFileError
    from twin.replay_command import Request, run

    try:
        text, finished = run(Request(load=load, pack=pack, out=out, between=between))
    except (CellError, LoadError, PackFileError, OSError, UnicodeDecodeError) as e:
        raise click.UsageError(str(e)) from e
    click.echo(text)
    sys.exit(0 if finished else 1)


if __name__ == "__main__":
    main()
