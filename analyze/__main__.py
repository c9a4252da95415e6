"""`analyze PATH...`: what each motion of a flight asked of the battery."""

from pathlib import Path

import click

from analyze.interrupt import held, leave_with

AnyPath = click.Path(exists=True, path_type=Path)
AnyFile = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=AnyPath)
@click.option(
    "--pack",
    type=AnyFile,
    help="Pack file (TOML): the battery, its cell and its physics; keys in docs/pack_file.md.",
)
@click.option(
    "--sensor",
    type=AnyFile,
    help="Recording of a separate current sensor, for a single log. Default: a file beside the "
    "log, flight.sensor.csv or flight.csv for flight.ulg.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("analysis"),
    show_default=True,
    help="Folder of the results; each log gets a folder in it.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Processes that share the logs of a folder.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Use the workers of this running Dask scheduler instead; they must see the same paths.",
)
@click.option("--force", is_flag=True, help="Analyse again what is up to date.")
@click.option(
    "--battery",
    type=click.IntRange(min=0),
    metavar="N",
    help="Which battery of the log, counted from 0. Default: the one that carries the flight.",
)
@click.option(
    "--pack-per-folder",
    is_flag=True,
    help="Each folder directly in PATH is one pack, with all logs below it: of `logs` the log "
    "logs/BAT7/LOGS/1.bin is of BAT7. Logs directly in PATH are of one pack, too. The folder's "
    "name is the serial number where neither log nor pack file has one.",
)
@click.option(
    "--thorough",
    is_flag=True,
    help="Judge the damage in full: also which feature of each motion drives it, and how many "
    "flights the pack would last, by constants of ageing that are an example unless yours were "
    "fitted.",
)
@click.option("-q", "--quiet", is_flag=True, help="Say only what failed.")
@click.option("-v", "--verbose", is_flag=True, help="Say what happened inside, too.")
@click.version_option(package_name="drone-battery-health", prog_name="analyze")
def main(**options: object) -> None:
    """Analyse flight logs: PX4 ULog and .px4log, MAVLink .tlog, ArduPilot .bin and .log.

    PATH is a log, or a folder that is searched for logs, also in the folders below it. For each
    log a folder with report.html, result.json and tables is written; for a folder index.html too.

    The exit code is 0 if all logs were analysed, 1 if some failed (each is named with its reason,
    the others are done), 2 if the command was not used as it should be, 130 after Ctrl-C.
    """
    if options["quiet"] and options["verbose"]:
        raise click.UsageError("-q and -v contradict each other")
    if options["scheduler"] and options["jobs"] != 1:
        raise click.UsageError("--jobs starts workers, --scheduler uses those of another: only one")

    def command() -> int:
        with held():
            from analyze.session import Options, run_session  # late: --help must not wait for it
        return run_session(Options(**options))  # type: ignore[arg-type]

    leave_with(command)


if __name__ == "__main__":
    main()
