"""`pack.toml`: a pack as its owner describes it; a key that is not known is an error."""

import tomllib
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from twin.at_rest import OVERFULL
from twin.effects import AnyEffect, InitialSoc, Mechanics, SelfHeating, WeakCell
from twin.pack import PackError, check_weak
from twin.pack_physics import PhysicsError, check_standard_errors
from twin.pack_physics import effects_of as physics_of
from twin.pack_physics import mechanics_of as constants_of

Text = Annotated[str, Field(min_length=1)]
Count = Annotated[int, Field(ge=1, le=1000)]
CapacityAh = Annotated[float, Field(gt=0.0, le=1000.0)]  # mAh are more
Celsius = Annotated[float, Field(ge=-60.0, le=120.0)]  # wider than any pack survives; K are more
UNITS = {
    "capacity_ah": "in Ah, 2.2 for 2200 mAh",
    "soc": "a share, 0.9 for 90 %",
    "temperature_c": "in °C, 25 for 298.15 K",
    "ambient_c": "in °C, 25 for 298.15 K",
}
"""Of keys whose value is too large, mostly in another unit."""
EXPECTED = {
    "int_type": "a whole number, without quotes",
    "float_type": "a number, without quotes",
    "string_type": "text in quotes",
    "tuple_type": "a list in brackets",
    "model_type": "a table",
    "dict_type": "a table",
}
"""By the type of a pydantic error: what a value of another kind should have been."""


class PackFileError(ValueError):
    """The pack file cannot be used; the text names the file, the key and what was expected."""


class _Table(BaseModel):
    """What is said of a key is in docs/pack_file.md too: `reports.pack_reference`."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


class PackTable(_Table):
    """`[pack]`: what it is made of."""

    name: Text
    """What the pages call it."""
    cell: Text
    """A built-in cell, or a BPX file beside the pack file (it ends in `.json`)."""
    capacity_ah: CapacityAh | None = None
    """Of the whole pack [Ah]; the cell is scaled to it. Without it that of the log, else of
    `parallel` cells as they are."""
    series: Count
    """Cells in series, the 4 of a 4S2P."""
    parallel: Count = 1
    """Strings side by side, the 2 of a 4S2P."""
    serial: str = ""
    """Serial number, by which a fleet page tells packs apart; one in the log comes first."""


class StartTable(_Table):
    """`[start]`: its state when the recording begins; what is absent is taken from the log.

    So is a temperature that was measured, whatever is said here.
    """

    soc: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """State of charge, a share: 0.9 for 90 %. Without it by the voltage at rest."""
    temperature_c: Celsius | None = None
    """Of the pack [°C]. Without it as warm as the air, else 25."""


class EnvironmentTable(_Table):
    """`[environment]`: what it loses its heat to."""

    ambient_c: Celsius | None = None
    """Of the air [°C]. Without it as warm as the pack at the start."""
    heat_transfer_W_m2_K: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    """From the surface of its cells to the air [W/(m2 K)]; without it 12, which nobody measured.
    What `twin explain` expects of heating too, where that is not switched on."""
    heat_transfer_std_W_m2_K: Annotated[float, Field(ge=0.0)] | None = None
    """Its standard error, as `twin calibrate` writes it."""


class TwinTable(_Table):
    """`[twin]`: which effects are switched on, and by how much the twin errs."""

    physics: Annotated[tuple[Text, ...], Field(strict=False)] | None = None  # TOML has lists
    """Ids of effects, from the lists below. Without it self-heating alone; `[]` is none."""
    cell_error_mv: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    """By how much the twin misses the voltage of one cell in tests that it was not fitted to
    [mV rms], as `twin calibrate` writes it: `twin explain` names nothing smaller."""


class PackFile(_Table):
    """A whole pack file.

    `[effects.<id>]`, `[standard_errors.<id>]` and `[mechanics]` as `pack_physics` takes them.
    """

    pack: PackTable
    start: StartTable = StartTable()
    environment: EnvironmentTable = EnvironmentTable()
    twin: TwinTable = TwinTable()
    standard_errors: dict[str, Any] = {}
    effects: dict[str, Any] = {}
    mechanics: dict[str, Any] = {}


def parse_pack_file(text: str, *, name: str) -> PackFile:
    """The pack that `text` describes; PackFileError, naming `name` and every bad key, if none."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as e:  # of numbers and lists beyond what Python reads too
        raise PackFileError(f"{name}: not valid TOML: {e}") from e
    try:
        file = PackFile.model_validate(document)
        mechanics_of(file)
        check_standard_errors(file.standard_errors)
        effects = effects_of(file)
        weak = [e for e in effects if isinstance(e, WeakCell)]
        check_weak(weak, file.pack.series)
        _check_start(file, effects)
    except ValidationError as e:
        raise PackFileError(f"{name}: " + "; ".join(map(_in_words, e.errors()))) from e
    except (PhysicsError, PackError) as e:
        raise PackFileError(f"{name}: {e}") from e
    return file


def _check_start(file: PackFile, effects: Sequence[AnyEffect]) -> None:
    """PackError where a cell starts with a charge that none can have, as far as the file tells."""
    if file.start.soc is None:
        return
    soc = file.start.soc + sum(e.offset for e in effects if isinstance(e, InitialSoc))
    weak = [e.soc_offset for e in effects if isinstance(e, WeakCell)]
    for offset in (*weak, *([0.0] if len(weak) < file.pack.series else [])):
        if not 0.0 <= round(soc + offset, 9) <= OVERFULL:
            raise PackError(
                f"start.soc = {file.start.soc:g} with the offsets of initial_soc and weak_cell "
                f"lets a cell start at {soc + offset:g}: expected 0 to {OVERFULL:g} together"
            )


def effects_of(file: PackFile | None) -> tuple[AnyEffect, ...]:
    """Effects switched on, with their numbers.

    Where the file is silent only self-heating: the ageing constants at hand are those of the
    LG M50 of O'Kane 2022, and whoever takes them for another cell should say so.
    """
    if file is None:
        return (SelfHeating(),)
    transfer = file.environment.heat_transfer_W_m2_K
    if transfer is None:
        transfer = SelfHeating.parameters[0].value
    return physics_of(_listed(file), file.effects, heat_transfer_W_m2_K=transfer)


def mechanics_of(file: PackFile | None) -> Mechanics:
    """The elastic constants."""
    return constants_of(_listed(file), file.mechanics) if file else Mechanics()


def _listed(file: PackFile) -> tuple[str, ...]:
    return (SelfHeating.id,) if file.twin.physics is None else file.twin.physics


def cell_reference(pack: PackFile, folder: Path) -> str | Path:
    """The cell's BPX file, if the pack names one (relative to `folder`), else a built-in's name."""
    named = pack.pack.cell
    return folder / named if is_path(named) else named


def is_path(cell: str) -> bool:
    """True for what names a file: it ends in .json or contains a folder."""
    return cell.endswith(".json") or "/" in cell or "\\" in cell


def _in_words(error: ErrorDetails) -> str:
    where = tuple(str(part) for part in error["loc"])
    key = ".".join(where)
    if error["type"] == "missing":
        return f"{key} is missing"
    if error["type"] in EXPECTED:
        return f"{key}: expected {EXPECTED[error['type']]} (got {error['input']!r})"
    if error["type"] != "extra_forbidden":
        unit = UNITS.get(where[-1]) if key and error["type"] == "less_than_equal" else None
        hint = f"; it is {unit}" if unit else ""
        return f"{key}: {error['msg']} (got {error['input']!r}){hint}" if key else error["msg"]
    near = get_close_matches(key, list(_keys(PackFile)), n=1, cutoff=0.0)
    return f"unknown key {key}: did you mean {near[0]}?"


def _keys(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Every key of the file with its table, `pack.name`, and the tables themselves."""
    for name, field in model.model_fields.items():
        yield above + name
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from _keys(kind, f"{name}.")
