"""Every effect says what it is, as the interface in twin/effects/effect.py asks."""

from dataclasses import fields

import pytest

from twin.effects import EFFECTS, MEASURED, AnyEffect, Mechanics
from twin.effects.effect import Effect

ALL: tuple[AnyEffect, ...] = tuple(kind() for kind in (EFFECTS | MEASURED).values())
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
