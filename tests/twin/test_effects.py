"""Every effect says what it is, as the interface in twin/effects/effect.py asks."""

from dataclasses import fields

import pytest

from twin.builtin import load_cell
from twin.effects import EFFECTS, FACTORS, MEASURED, AnyEffect, Factor, Mechanics
from twin.effects.effect import Effect
from twin.pack import Pack

ALL: tuple[AnyEffect, ...] = tuple(kind() for kind in (*(EFFECTS | MEASURED).values(), *FACTORS))
PLACES = {"cell"}  # of a weak cell: a choice, not a number that may be fitted


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.id)
def test_an_effect_tells_its_balance_equation_source_and_signature(effect: Effect) -> None:
    assert all((effect.id, effect.balance, effect.equation, effect.source, effect.signature))


@pytest.mark.parametrize("effect", [*ALL, Mechanics()], ids=lambda e: e.id)
def test_its_parameters_are_its_fields_within_their_bounds(effect: AnyEffect | Mechanics) -> None:
    assert {p.name for p in effect.parameters} == {f.name for f in fields(effect)} - PLACES
    for parameter in effect.parameters:
        assert getattr(effect, parameter.name) == parameter.value
        assert parameter.lower <= parameter.value <= parameter.upper
        assert parameter.prior_std > 0
        assert parameter.unit


def test_ids_are_unique() -> None:
    assert len({e.id for e in ALL}) == len(ALL)


@pytest.mark.parametrize("kind", FACTORS, ids=lambda k: k.id)
def test_a_factor_multiplies_the_numbers_it_names_and_no_others(kind: type[Factor]) -> None:
    bare = Pack(cell=load_cell("lipo_2200")).cell_parameters()
    twice = Pack(cell=load_cell("lipo_2200"), effects=(kind(factor=2.0),)).cell_parameters()
    assert {name: value / bare[name] for name, value in twice.items() if value != bare[name]} == (
        dict.fromkeys(kind.scales, 2.0)
    )
