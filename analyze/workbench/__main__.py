"""`twin`: the workbench of the electrochemical twin."""

import warnings
from collections.abc import Mapping
from importlib import import_module
from os import environ
from pathlib import Path
from typing import NoReturn

import click

from analyze.interrupt import held, leave_with
from analyze.workbench.options import (
    BATTERY,
    BETWEEN,
    CELSIUS,
    PACK,
    AnyFile,
    HoldsOut,
    given,
    numbers,
    out,
    shared,
)
from analyze.workbench.regime import regime_options

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "1")
"""The twin has a thread a core itself. Where the linear algebra had its own, these waiting for each
other took half of two cores in `twin prove`, and a fifth of the work of `twin calibrate`."""


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="drone-battery-health", prog_name="twin")
def main() -> None:
    """Simulate a battery pack with the P2D twin, calibrate it, and find what it leaves out."""
    warnings.formatwarning = lambda message, *_, **__: f"warning  {message}\n"


@main.command()
@click.argument("source", metavar="[LOG|LOAD.csv]", required=False, type=AnyFile)
@shared
@out("what an earlier call left there is replaced.")
@click.option(
    "--ambient-c",
    metavar="NUMBERS",
    callback=numbers(*CELSIUS),
    help="Temperatures in °C, e.g. -10,0,25,40: one case each; pack and air begin with it. "
    "Default: as the recording or the pack file says.",
)
@click.option(
    "--c-rate",
    metavar="NUMBERS",
    callback=numbers(0.0),
    help="C-rates (multiples of the capacity per hour), e.g. 0.5,1,2,3: constant currents down to "
    "the cut-off, in place of a load; one case each.",
)
@click.option(
    "--scale",
    metavar="NUMBERS",
    callback=numbers(0.0),
    help="Factors on the current of the load: one case each.",
)
def replay(**options: object) -> None:
    """Draw a current from a pack and write what the twin answers.

    LOG is a flight log; LOAD.csv has a column time_s (or "Test Time / s") and current_A (or
    "Current / A"), discharge positive, at the terminals of the pack. Where the voltage was
    recorded (in the log, or a column voltage_V or "Voltage / V") the error is told too. With
    --c-rate no load is needed. What the pack file does not say is taken from the log or the CSV,
    else a full pack at 25 °C; a temperature that was measured is taken before the one it says.

    Writes replay.csv and replay.parquet (a row a sample and case), summary.csv (a row a case) and
    replay.svg.

    The exit code is 0 if every case was simulated to its end, 1 if one ended early (what came
    before is written), 2 if a file or an option cannot be used, 130 after Ctrl-C (the case at
    work is finished, and all are written).
    """
    _leave_with("analyze.workbench.replay", options | {"given": given()})


@main.command()
@click.argument("source", metavar="LOG|PROFILE.csv", type=AnyFile)
@shared
@out("an earlier run there is continued with --resume, never overwritten.")
@click.option(
    "--cycles",
    type=click.IntRange(min=1),
    metavar="N",
    required=True,
    help="How many in all; with --resume those of the earlier run are counted.",
)
@click.option(
    "--ambient-c",
    metavar="NUMBERS",
    callback=numbers(*CELSIUS),
    help="Temperatures in °C, e.g. -10,0,25,40: one life each, in folders -10C, 0C, ... of --out; "
    "pack and air begin with it. Default: as the recording or the pack file says.",
)
@regime_options
@click.option(
    "--stop-at-capacity",
    type=click.FloatRange(min=0.0, max=1.0),
    metavar="SHARE",
    help="Stop when less than this share of the first capacity is left, e.g. 0.8.",
)
@click.option(
    "--resume", is_flag=True, help="Go on after the last whole cycle in --out, if there is one."
)
def age(**options: object) -> None:
    """Repeat a flight, a rest, a charge and a rest, and write what becomes of the pack.

    LOG or PROFILE.csv is the load of one flight, as for `twin replay`. Cycle 0 is the first charge,
    from the start that the pack file or the log tells, so that every flight begins full. The pack
    file says what ages, e.g. physics = ["self_heating", "sei", "plating"] under [twin].

    Writes ageing.csv and ageing.parquet (a row a cycle), ageing.svg, and ageing.checkpoint.json,
    from which --resume goes on; the tables and the checkpoint every few seconds. Where the pack
    file has a weak_cell, cells.csv and cells.parquet tell the same of each kind of cell.

    The exit code is 0 if all cycles were done, or the capacity of --stop-at-capacity was reached;
    1 if a cycle could not be completed (all before is written); 2 if a file or an option cannot be
    used; 130 after Ctrl-C (the cycle at work is finished, and all are written).
    """
    _leave_with("analyze.workbench.age", options)


@main.command()
@click.argument("tests", metavar="[TEST.csv...]", nargs=-1, type=AnyFile)
@PACK
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    help="Pack file to write, e.g. calibrated.toml; its cell, page and fit lie beside it.",
)
@click.option(
    "--between",
    type=click.Choice(["hold", "linear"]),
    default="hold",
    show_default="hold for TEST.csv, linear for PROFILE.csv",
    help="How the current runs between rows: held (programmed steps), or straight (a sensor).",
)
@click.option(
    "--one-mount",
    is_flag=True,
    help="All tests were made in one mount, where the cell cools alike within about 5 %. Otherwise "
    "each test with a column of temperatures cools as its own mount does, within about 15 %.",
)
@click.option(
    "--evaluations",
    type=click.IntRange(min=0),
    metavar="N",
    default=4000,
    show_default=True,
    help="Limit on global-search simulations. The search is made where least squares leave more "
    "than noise; 0: no search. With --resume those of the earlier search are counted.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    metavar="N",
    default=0,
    show_default=True,
    help="Of the random numbers of the search: with the same seed it is the same search.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on from the fit that lies beside --out, and with its search where there was one, "
    "even if that was killed.",
)
@click.option(
    "--aged",
    type=AnyFile,
    metavar="LIFE.csv",
    help='Check-ups along a life: columns "Cycle", "Capacity / Ah" and, if measured, "Resistance / '
    'ohm". What ages the pack is fitted to them.',
)
@click.option(
    "--cycle",
    type=AnyFile,
    metavar="LOG|PROFILE.csv",
    help="With --aged: the load of one cycle of that life.",
)
@regime_options
def calibrate(**options: object) -> None:
    """Fit the parameters of a pack's cell to reference tests, and its ageing to a life.

    TEST.csv holds one test (0.1C, 2C, pulses, ...) at the terminals of the pack: columns whose
    headers name quantity and unit, such as "Test Time / s", "Current / A", "Voltage / V". The
    sign of the current is detected. The cell of the pack file is where the fit starts from, and
    what remains where the tests tell nothing. Where there is a column for each cell, such as
    "Cell 1 / V", its capacity, charge and resistance are told apart from those of the others.

    With --aged and --cycle the life is simulated as by `twin age` (its options from --repeat on),
    and SEI and elastic constants are fitted to its check-ups, those that act: physics under [twin]
    in the pack file says what does. Without TEST.csv the cell stays as the pack file has it.

    Writes a pack file, its cell as BPX (.bpx.json), a page (.html: measured beside simulated,
    every parameter with its interval and what the tests tell of it, further tests worth making),
    the same as numbers (.fit.json), where there was a search, what it evaluated (.search.json,
    every few seconds), and the fit to a life (.ageing.json). What an earlier calibration
    left there is replaced; one to tests is not by one to a life alone.

    The exit code is 0 if the fit came to its end, 2 if a file or an option cannot be used, 130
    after Ctrl-C (the best so far is written, with what was not computed named).
    """
    _leave_with("analyze.workbench.calibrate", options | {"given": given()})


@main.command(cls=HoldsOut)
@click.argument("sources", metavar="LOG...", nargs=-1, required=True, type=AnyFile)
@click.option(
    "--holdout",
    multiple=True,
    type=AnyFile,
    metavar="LOG...",
    help="Recordings of the same pack on which all is judged: all up to the next option. Without "
    "it the last of several LOGs; of a single one parts 2, 4 and 6 of seven.",
)
@PACK
@out("mismatch.json, explain.html and reveal.json there are replaced.")
@click.option(
    "--adopt",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="PACK.toml",
    help="Write the pack file with what was named switched on.",
)
@click.option(
    "--conceal",
    default="",
    metavar="CHANNELS",
    help="Channels to keep from the twin: temperature, cells, or both with a comma.",
)
@click.option(
    "--reveal",
    multiple=True,
    type=AnyFile,
    metavar="CSV",
    help="Measured temperature or cell voltages (time_s, temperature_c, cell_1_v, ...), read after "
    "the verdict is written and compared with the twin; may come several times. It belongs to the "
    "recording whose name it begins with, else to the last one.",
)
@click.option(
    "--floor-mv",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="MV",
    help="The twin's own error, rms of the pack's voltage in tests it was not fitted to. An effect "
    "has to change the voltage by more to be named. Default: what the pack file states of a cell "
    "(twin.cell_error_mv, which `twin calibrate` writes), else the error of the twin's numerics.",
)
@BETWEEN
@BATTERY
def explain(**options: object) -> None:
    """Say where recordings of a pack and its twin differ, and what was left out.

    A LOG is a flight log or a CSV with time, current and voltage; a current sensor's CSV beside a
    log (flight.sensor.csv or flight.csv) is used. Each known effect (of the cell,
    its ageing, the pack, the instruments) is fitted to the recordings and judged on what was not
    fitted; what is real and has no name among them is said to be unknown. explain.html shows it.

    The exit code is 0 if there is a verdict, 2 if a file or an option cannot be used, or if with
    --adopt the verdict names nothing (all else is written), 130 after Ctrl-C.
    """
    _leave_with("analyze.workbench.explain", options)


@main.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("proven"),
    show_default=True,
    help="Folder of the results; what an earlier call left there is replaced, but for the answers "
    "of the other simulator and the calibrated cells, which are used again.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    metavar="N",
    help="Which effects, strengths, packs and flights are drawn: the same seed, the same trials. "
    "Default: one that nobody knows beforehand.",
)
@click.option(
    "--trials",
    type=click.IntRange(min=0, max=10_000),
    metavar="M",
    default=60,
    show_default=True,
    help="How many truths are simulated, by PyBaMM: one in six without an effect, one in ten each "
    "with two, and with one that the tool does not know.",
)
@click.option(
    "--recordings",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    help="Folder with the public recordings (docs/recordings.md says which, and where from); what "
    "is there is used.",
)
@click.option(
    "--anew",
    is_flag=True,
    help="Calibrate the base twins of real cells anew, in place of those that come with the "
    "program: two to three hours.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Trials at once. Default: one a processor.",
)
@click.option(
    "--check",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    help="Do nothing but check a proof: every file against the ledger and its order, and what "
    "proof.json says against verdicts and truths. That they agree, not that they are genuine.",
)
@click.option(
    "--again",
    type=click.IntRange(min=1),
    metavar="N",
    help="With --check: judge N of its trials again, drawn by chance, and make simulated ones "
    "again from the seed; what comes out otherwise is broken. A verdict takes half a minute to "
    "some minutes, making a trial as long again.",
)
def prove(**options: object) -> None:
    """Put effects into data, conceal them, ask `twin explain`, and open the truth afterwards.

    Each truth is simulated by PyBaMM (with an effect drawn from the seed, none, or one that the
    tool does not know) or is a measured channel of a real recording that is kept from the tool. It
    is sealed, the verdict is written, then it is opened; ledger.jsonl has the hashes in that order.
    Beside each named effect stand a refit of the twin without new physics, a correction of the
    voltage without physics, and an effect drawn by chance. 60 trials take about 45 minutes on two
    processors. Needs the extra `proof`: pip install '.[proof]' in a clone.

    Writes proof.html, proof.json, ledger.jsonl, and a folder a trial: what was asked, the verdict,
    the truth.

    The exit code is 0 if every trial was judged, whatever the verdicts; 1 if some could not be (or
    if --check finds something), 2 if an option cannot be used, 130 after Ctrl-C (the trials at work
    are finished, what was judged is opened and shown).
    """
    _leave_with("proof.command", options)


def _leave_with(module: str, options: Mapping[str, object]) -> NoReturn:
    """Run what a module makes of its Request; it is imported late: --help must not wait for it."""

    def command() -> int:
        environ.setdefault(*ONE_THREAD)  # read when numpy is imported
        with held():
            late = import_module(module)
        return int(late.run(late.Request(**options)))

    leave_with(command)


if __name__ == "__main__":
    main()
