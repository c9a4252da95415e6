"""The test that would tell candidates apart."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown, pack
from twin.effects import AnyEffect, InitialSoc, SelfHeating, SeriesResistance, WeakCell
from twin.load import Load
from twin.mismatch import Flight, advice
from twin.mismatch.advice import MOST_SAMPLES, advise, manoeuvres
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack

NOISE_V = 1e-3


def candidates(flight: Flight, *effects: AnyEffect) -> list[Any]:
    """Models of one effect each."""
    packs = [beyond_cut_offs(replace(flight.pack, effects=(e,))) for e in effects]

    def model(own: Pack) -> Any:
        problem = SimpleNamespace(flights=(flight,), pack=lambda *_: own)
        return SimpleNamespace(problem=problem, q=np.zeros(1))

    return [model(own) for own in packs]


def drawing(current_A: float, *, ambient_K: float = 298.15) -> Flight:
    own = flown(seed=1)
    current = np.full(own.time_s.size, current_A)
    return replace(own, load=Load(time_s=own.time_s, current_A=current, ambient_K=ambient_K))


def test_a_resistance_and_a_weak_cell_differ_in_a_manoeuvre_and_by_how_much_is_said() -> None:
    said = advise(
        candidates(drawing(8.0), SeriesResistance(resistance_ohm=0.01), WeakCell(soc_offset=-0.1)),
        NOISE_V,
    )
    assert "until empty: the candidates then differ by" in said


def test_one_candidate_and_a_pack_at_rest_need_no_advice() -> None:
    one, other = SeriesResistance(resistance_ohm=0.01), SeriesResistance(resistance_ohm=0.02)
    assert advise(candidates(drawing(8.0), one), NOISE_V) == ""
    assert advise(candidates(drawing(0.01), one, other), NOISE_V) == ""
    assert advise(candidates(drawing(-8.0), one, other), NOISE_V) == ""


@pytest.mark.parametrize("mean_A", [0.1, 8.0])
def test_manoeuvres_are_in_the_same_air_and_of_bounded_length(mean_A: float) -> None:
    for test in manoeuvres(pack(), mean_A, 2 * mean_A, 273.15):
        assert test.load.ambient_K == 273.15
        assert test.load.time_s.size <= MOST_SAMPLES + 10
        assert test.full == any(w in test.words for w in ("from a full", "the full", "from full"))


def test_a_charged_pack_is_full_whatever_it_started_a_recording_with() -> None:
    weak = WeakCell(cell=1, soc_offset=-0.1), WeakCell(cell=2, soc_offset=0.04)
    own = replace(
        pack(), initial_soc=0.9, soc_by_rest=True, effects=(InitialSoc(offset=0.02), *weak)
    )
    assert own.charged() == replace(pack(), initial_soc=0.96, effects=weak)


def test_a_manoeuvre_from_full_is_of_a_charged_pack(monkeypatch: pytest.MonkeyPatch) -> None:
    starts = {}

    def answer(own: Pack, load: Load) -> Any:
        starts[load.current_A.max(), load.time_s.size] = own.initial_soc
        assert own.cell == pack().cell  # that stops at its cut-offs
        return np.zeros(load.time_s.size)

    monkeypatch.setattr(advice, "_answer_V", answer)
    half = replace(drawing(8.0), pack=replace(pack(), initial_soc=0.9))
    advise(candidates(half, SelfHeating(), SeriesResistance()), NOISE_V)
    for test in manoeuvres(half.pack, 8.0, 8.0, 298.15):
        start = starts[test.load.current_A.max(), test.load.time_s.size]
        assert start == (1.0 if test.full else 0.9), test.words
