"""What a command is to draw, from which pack: a flight log or a CSV, and the pack file."""

import hashlib
import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt

from analyze.checks import WrongUse, check_sensor, is_log
from analyze.conceal import Channel, without
from analyze.find import sensor_beside
from analyze.names import printable
from analyze.pack_choice import BEYOND, PackChoice, beyond_tests, cell_of
from analyze.pipeline import Source, read_flight
from analyze.replaying import judged_of, load_of
from analyze.start import pack_of, pack_use
from flightlogs.errors import LogError
from flightlogs.held import measured_anew, voltage_held_warning
from flightlogs.quality import saturation_warning, unsaturated
from reports.flight import PackUse
from reports.quantity import ampere_hours, celsius, fixed
from segment import Segment, cut
from twin.bpx_file import CellError
from twin.calibrate.table import CalibrationError
from twin.columns import TableError
from twin.constants import ZERO_CELSIUS_K
from twin.graded import graded
from twin.load import Between, Load, LoadError
from twin.load_csv import read_load_csv
from twin.mismatch import MismatchError
from twin.pack import Pack, PackError
from twin.protocol import ProtocolError
from twin.renewed import renewed

FloatArray = npt.NDArray[np.float64]

REFUSED = (
    CalibrationError, CellError, LoadError, LogError, MismatchError, PackError, ProtocolError,
    TableError,
)  # fmt: skip
SEPARATOR = "\n         "


@dataclass(frozen=True, slots=True, kw_only=True)
class Ask:
    """The options that the commands share."""

    source: Path | None
    pack: Path
    out: Path
    between: str | None
    sensor: Path | None
    battery: int | None
    concealed: frozenset[Channel] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """A load and the pack it is drawn from.

    Attributes:
        name: of the file.
        load: with samples added where the file is sparse (`graded`), so that least voltage and
            energy are known well.
        recorded_V: (n,) at its times, NaN where there is none.
        judged: (n,) bool, the samples that count in the error.
        pack: as it starts.
        use: its numbers, and where each comes from.
        doubts: what is doubtful in the files, in words; not yet what is `beyond` the tests.
        segments: of a log, cut by motion.
        temperature_K: (n,) of the pack, NaN where it was not measured; None if it never was.
        cell_voltage_V: (n, cells) likewise.
        recorded: (n,) bool, the samples that were not added; None if none was.
    """

    name: str
    load: Load
    recorded_V: FloatArray
    judged: npt.NDArray[np.bool_]
    pack: Pack
    use: PackUse
    doubts: tuple[str, ...]
    segments: tuple[Segment, ...] = ()
    temperature_K: FloatArray | None = None
    cell_voltage_V: FloatArray | None = None
    recorded: npt.NDArray[np.bool_] | None = None


@contextmanager
def refusing() -> Iterator[None]:
    """What is wrong with a file or an option becomes wrong use, with the same words."""
    try:
        yield
    except REFUSED as e:
        raise WrongUse(str(e)) from e
    except OSError as e:
        shown = f"{click.format_filename(e.filename)}: " if e.filename else ""
        raise WrongUse(f"{shown}{e.strerror or e}") from e


def pack_alone(choice: PackChoice) -> tuple[Pack, PackUse, tuple[str, ...]]:
    """The pack of a pack file, as it says or by default, and what was assumed of its cell."""
    cell, remarks = cell_of(choice.cell)
    use = pack_use(None, choice.file, cell, builtin=isinstance(choice.cell, str))
    return pack_of(use, cell), use, remarks


def read_drawn(ask: Ask, choice: PackChoice) -> Drawn:
    """The load of a log or a CSV; errors as in `refusing`."""
    assert ask.source is not None
    log = is_log(ask.source)
    return _refined(_of_log(ask.source, ask, choice) if log else _of_csv(ask, choice))


def _of_log(log: Path, ask: Ask, choice: PackChoice) -> Drawn:
    if ask.between:
        raise WrongUse(f"{click.format_filename(log)} is a flight log: --between belongs to a CSV")
    if ask.sensor:
        check_sensor(ask.sensor)
    flight = read_flight(
        Source(log=log, sensor=ask.sensor or sensor_beside(log), pack=choice, battery=ask.battery,
               concealed=ask.concealed)
    )  # fmt: skip
    recording = flight.recording
    return Drawn(
        name=printable(log.name),
        load=load_of(recording, flight.use),
        recorded_V=recording.voltage_V,
        judged=judged_of(recording) & unsaturated(recording.time_s, recording.current_A),
        pack=pack_of(flight.use, flight.cell),
        use=flight.use,
        doubts=tuple(w.message for w in recording.warnings if w.code != BEYOND),
        segments=cut(recording),
        temperature_K=recording.temperature_K,
        cell_voltage_V=recording.cell_voltage_V,
    )


def _of_csv(ask: Ask, choice: PackChoice) -> Drawn:
    assert ask.source is not None
    if ask.sensor or ask.battery is not None:
        raise WrongUse(
            f"{click.format_filename(ask.source)} is no flight log: "
            f"{'--sensor' if ask.sensor else '--battery'} belongs to one"
        )
    name = printable(ask.source.name)
    with ask.source.open(encoding="utf-8-sig", newline="") as stream:
        table = read_load_csv(stream, name=name)
    between = Between(ask.between or Between.LINEAR)
    measured = between is Between.LINEAR  # programmed steps stand at their largest as they please
    table = without(table, ask.concealed)
    table = renewed(table) if measured else table
    cell, remarks = cell_of(choice.cell)
    use = pack_use(None, choice.file, cell, builtin=isinstance(choice.cell, str), table=table)
    recorded_V = np.full(table.time_s.size, np.nan) if table.voltage_V is None else table.voltage_V
    judged, doubts = np.ones(recorded_V.size, dtype=bool), table.remarks
    if measured:
        judged = unsaturated(table.time_s, table.current_A)
        judged &= measured_anew(recorded_V, table.current_A)
        doubtful = (
            saturation_warning(table.current_A, name),
            voltage_held_warning(recorded_V, table.current_A, name),
        )
        doubts += tuple(w.message for w in doubtful if w)
    return Drawn(
        name=name,
        load=table.load(between=between, ambient_K=use.ambient_K),
        recorded_V=recorded_V,
        judged=judged,
        pack=pack_of(use, cell),
        use=use,
        doubts=(*doubts, *remarks),
        temperature_K=table.temperature_K,
        cell_voltage_V=table.cell_voltage_V,
    )


def _refined(drawn: Drawn) -> Drawn:
    """With samples added where they lie further apart than a step may be long."""
    fine = graded(drawn.load, drawn.pack.rated_C)
    where = np.searchsorted(fine.time_s, drawn.load.time_s)
    judged, recorded = (np.zeros(fine.time_s.shape, dtype=bool) for _ in range(2))
    judged[where], recorded[where] = drawn.judged, True

    def spread(values: FloatArray) -> FloatArray:
        out = np.full((fine.time_s.size, *values.shape[1:]), np.nan)
        out[where] = values
        return out

    warm, cells = drawn.temperature_K, drawn.cell_voltage_V
    return replace(
        drawn,
        load=fine,
        recorded_V=spread(drawn.recorded_V),
        judged=judged,
        recorded=recorded,
        temperature_K=None if warm is None else spread(warm),
        cell_voltage_V=None if cells is None else spread(cells),
    )


def beyond(choice: PackChoice, drawn: Iterable[tuple[Pack, Load]]) -> tuple[str, ...]:
    """What each pack and its load asks beyond the tests of the cell, in words, each once."""
    said = (w.message for pack, load in drawn for w in beyond_tests(choice, load, pack))
    return tuple(dict.fromkeys(said))


def in_air(celsius: float | None, pack: Pack, load: Load) -> tuple[Pack, Load]:
    """Pack and air at a temperature; as they are if none is given."""
    if celsius is None:
        return pack, load
    kelvin = celsius + ZERO_CELSIUS_K
    return replace(pack, initial_K=kelvin), replace(load, ambient_K=kelvin)


def load_sha256(load: Load) -> str:
    """Of all that a load is."""
    text = f"{load.between.value} {load.ambient_K!r}".encode()
    return hashlib.sha256(load.time_s.tobytes() + load.current_A.tobytes() + text).hexdigest()


def pack_sha256(choice: PackChoice, use: PackUse) -> str:
    """Of the files and of every number that was taken from them or from a log."""
    numbers = json.dumps(asdict(use), sort_keys=True)
    return hashlib.sha256(f"{choice.sha256} {numbers}".encode()).hexdigest()


def pack_lines(use: PackUse) -> str:
    """The pack in words, with the origin of what was a choice."""
    said = {
        "capacity_C": f"capacity {ampere_hours(use.capacity_C, 2)} Ah",
        "initial_soc": f"charge at the start {fixed(100 * use.shown_soc, 1)} %",
        "initial_K": f"temperature at the start {celsius(use.initial_K)} °C",
        "ambient_K": f"air {celsius(use.ambient_K)} °C",
    }
    parts = [f"{text} ({use.origins[field]})" for field, text in said.items()]
    return (
        f"pack     {use.name}: {use.series} in series, {use.parallel} parallel, of {use.cell}\n"
        f"         {SEPARATOR.join(parts)}\n"
        f"physics  {', '.join(use.effect_ids) or 'none beyond the isothermal P2D model'}"
    )
