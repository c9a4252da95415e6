"""The physics a pack file asks for: which effects, and with which numbers."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from twin.effects import EFFECTS, MEASURED, AnyEffect, Mechanics, SelfHeating, WeakCell
from twin.effects.effect import Parameter

LISTABLE = EFFECTS | MEASURED
PLACE = Parameter(name="cell", unit="1", value=0.0, lower=0.0, upper=1000.0, prior_std=1.0)
"""Of a weak cell; that the pack has so many is checked by `Pack`."""
NOT_ALONE = {PLACE.name, "outside"}  # say where something is, and not how much of it
LEAST_ERROR, MOST_ERROR = 1e-12, 1e12  # standard errors are positive
STRAINED = ("cracking", "active_material_loss", "stress_enhanced_diffusion")
"""Effects that the elastic constants act on."""


FOUND_AS = {
    "plating_stripping": "what `twin explain` finds as that is 'plating' with initial_mol_m3 in "
    "[effects.plating]: --adopt writes it so"
}


class PhysicsError(ValueError):
    """What is asked for cannot be; the text names the key and what was expected."""


def effects_of(
    listed: Sequence[str], tables: Mapping[str, Any], *, heat_transfer_W_m2_K: float
) -> tuple[AnyEffect, ...]:
    """The effects of `twin.physics`, with their numbers from `[effects.<id>]`.

    A number that is not given keeps its default. `[[effects.weak_cell]]` may come several times.

    Raises:
        PhysicsError: an id or key that is not known, a number out of bounds, numbers of an effect
            that is not listed, or an effect that is listed without the number it is nothing
            without (a resistance, a weakness).
    """
    for n, name in enumerate(listed):
        if name not in LISTABLE:
            hint = f" ({FOUND_AS[name]})" if name in FOUND_AS else ""
            raise PhysicsError(
                f"twin.physics: this version has no effect {name!r}{hint}; it has "
                f"{', '.join(LISTABLE)}"
            )
        if name in listed[:n]:
            raise PhysicsError(f"twin.physics: {name!r} is listed twice")
    for name in tables:
        if name not in LISTABLE:
            raise _unknown("effects", name, LISTABLE)
        if name not in listed:
            raise PhysicsError(
                f"effects.{name} has numbers, but twin.physics does not list {name!r}: add it there"
            )
    return tuple(
        effect for name in listed for effect in _built(name, tables.get(name), heat_transfer_W_m2_K)
    )


def mechanics_of(listed: Sequence[str], table: Mapping[str, Any]) -> Mechanics:
    """The elastic constants of `[mechanics]`; PhysicsError if one is impossible, or none acts."""
    if table and not set(listed) & set(STRAINED):
        raise PhysicsError(
            f"mechanics has numbers, but twin.physics lists none of {', '.join(STRAINED)}"
        )
    return Mechanics(**_numbers("mechanics", Mechanics.parameters, table))


def check_standard_errors(tables: Mapping[str, Any]) -> None:
    """PhysicsError if `[standard_errors.<id>]` names what no effect has, or is no such number."""
    for name, table in tables.items():
        if name not in MEASURED:
            raise _unknown("standard_errors", name, MEASURED)
        errors = [
            replace(p, lower=LEAST_ERROR, upper=MOST_ERROR) for p in MEASURED[name].parameters
        ]
        _numbers(f"standard_errors.{name}", errors, table)


def _built(name: str, given: Any, heat_transfer_W_m2_K: float) -> list[AnyEffect]:
    """One effect, or every weak cell."""
    if name == SelfHeating.id:
        if given is not None:
            raise PhysicsError(f"effects.{name}: its number is environment.heat_transfer_W_m2_K")
        return [SelfHeating(heat_transfer_W_m2_K=heat_transfer_W_m2_K)]
    if name == WeakCell.id:
        tables = given if isinstance(given, list) and given else [given]
        return [_weak_cell(table) for table in tables]
    kind: Callable[..., AnyEffect] = LISTABLE[name]
    return [kind(**_wanted(name, LISTABLE[name].parameters, given))]


def _weak_cell(given: Any) -> WeakCell:
    numbers = _wanted(WeakCell.id, (*WeakCell.parameters, PLACE), given)
    place = numbers.pop(PLACE.name, 0.0)
    if not place.is_integer():
        raise PhysicsError(f"effects.weak_cell.cell = {place}: expected a whole number")
    return WeakCell(cell=int(place)).at(numbers)


def _wanted(name: str, parameters: Sequence[Parameter], given: Any) -> dict[str, float]:
    """The numbers of an effect; PhysicsError if it is nothing without one and has none."""
    numbers = _numbers(f"effects.{name}", parameters, {} if given is None else given)
    if name in MEASURED and not numbers.keys() - NOT_ALONE:
        wanted = " or ".join(p.name for p in MEASURED[name].parameters if p.name not in NOT_ALONE)
        raise PhysicsError(
            f"twin.physics lists {name!r}, which is nothing without its number: "
            f"give {wanted} in [effects.{name}]"
        )
    return numbers


def _numbers(key: str, parameters: Sequence[Parameter], table: Any) -> dict[str, float]:
    """The numbers of a table, each known and within its bounds."""
    if not isinstance(table, dict):
        raise PhysicsError(f"{key} = {table!r}: expected a table of numbers, [{key}]")
    known = {p.name: p for p in parameters}
    for name, value in table.items():
        if name not in known:
            raise _unknown(key, name, known)
        p = known[name]
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not p.lower <= value <= p.upper:
            bounds = f"{p.lower:g} to {p.upper:g}" + (f" {p.unit}" if p.unit != "1" else "")
            raise PhysicsError(f"{key}.{name} = {value!r}: expected a number from {bounds}")
    return {name: float(value) for name, value in table.items()}


def _unknown(key: str, name: str, known: Collection[str]) -> PhysicsError:
    near = get_close_matches(name, list(known), n=1, cutoff=0.0)
    hint = f": did you mean {key}.{near[0]}?" if near else ": it has no numbers"
    return PhysicsError(f"unknown key {key}.{name}{hint}")
