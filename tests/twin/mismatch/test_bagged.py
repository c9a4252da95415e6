"""Probabilities over recordings drawn anew by stretches: closed forms, and where they act."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.test_channels import chosen, measured
from twin.builtin import load_cell
from twin.effects import SeriesResistance
from twin.load import Load
from twin.mismatch import Flight
from twin.mismatch.bagged import DRAWS, bagged, stretches
from twin.mismatch.choose import judged, scale_of
from twin.mismatch.fit import fit
from twin.mismatch.split import split
from twin.pack import Pack
from twin.simulate import simulate

SURE = 3.0 / np.sqrt(DRAWS)  # three standard deviations of a probability, at most half of that


def test_what_wins_in_every_stretch_alike_is_as_sure_as_it_was() -> None:
    logs = np.array([0.0, -2.0, -7.0])
    even = np.repeat(logs[:, None] / 8, 8, axis=1)
    given = np.exp(logs) / np.exp(logs).sum()
    assert np.exp(bagged(logs, [even[:, :3], even[:, 3:]])) == pytest.approx(given, rel=1e-12)


@pytest.mark.parametrize("b", [2, 5, 20])
def test_what_wins_in_one_stretch_alone_is_not_sure(b: int) -> None:
    """Of b stretches drawn from b, one is missing with (1 - 1/b)^b; then both are as good."""
    better = np.zeros((2, b))
    better[1, 0] = -200.0
    probable = np.exp(bagged(better.sum(axis=1), [better]))
    assert probable[0] == pytest.approx(1.0 - 0.5 * (1.0 - 1.0 / b) ** b, abs=SURE)
    assert probable.sum() == pytest.approx(1.0)


def test_a_recording_of_one_stretch_changes_nothing() -> None:
    logs = np.array([-3.0, -1.0])
    assert np.diff(bagged(logs, [logs[:, None]])) == pytest.approx(np.diff(logs))


def test_short_flights_are_drawn_anew_as_stretches_of_one_are() -> None:
    """The first wins one by 100, the second the two others by 45 each."""
    flights = [np.array([[own], [0.0]]) for own in (100.0, -45.0, -45.0)]
    apart = bagged(np.array([10.0, 0.0]), flights)
    assert np.exp(apart[0]) == pytest.approx(1.0 - 8 / 27, abs=SURE)  # of 3 drawn it is none
    assert apart == pytest.approx(bagged(np.array([10.0, 0.0]), [np.hstack(flights)]))


def test_what_no_draw_favours_stays_finite() -> None:
    logs = np.array([0.0, -1e5])
    assert np.all(np.isfinite(bagged(logs, [np.repeat(logs[:, None] / 9, 9, axis=1)])))


def test_stretches_are_equal_and_skip_what_holds_nothing() -> None:
    at_s = np.array([0.0, 10.0, 199.0, 210.0, 601.0, 800.0])
    assert stretches(at_s, 200.0).tolist() == [0, 0, 0, 1, 2, 2]
    assert stretches(at_s, 1e6).tolist() == [0] * 6
    assert stretches(at_s[:0], 200.0).size == 0
    assert stretches(at_s[:1], 200.0).tolist() == [0]


def test_stretches_of_all_recordings_and_channels_add_up_to_the_likelihood() -> None:
    data = split([measured([], seed) for seed in (1, 2)], [], slow_V=0.01)
    for ids in ((), ("current_gain",)):
        own = fit(data, chosen(*ids))
        parts = own.by_stretch(2.0)
        assert [part.size for part in parts] == [1, 1]  # a minute each, of 200 s
        assert sum(part.sum() for part in parts) == pytest.approx(own.log_likelihood(2.0))


def test_where_an_error_is_stated_one_stretch_of_fourteen_decides_less() -> None:
    """A resistance, with 60 mV more that last 200 s: nothing else says what those samples say."""
    data = split([_discharged(seed, rate) for seed, rate in ((1, 1.0), (2, 0.8))], [], slow_V=0.012)
    names = "series_resistance", "solid_diffusion_positive"
    odds = []
    for own in (data, data.squared):
        models = judged(fit(own, chosen(name)) for name in names)
        assert models[0].ids == names[:1]
        scale = scale_of(m.fitted for m in models)
        plain = [m.fitted.log_evidence(scale) for m in models]
        odds.append((models[0].log_evidence - models[1].log_evidence, plain[0] - plain[1]))
    (bagged_odds, plain_odds), (odds_of_squares, plain_of_squares) = odds
    assert 0.0 < bagged_odds < 5.0 < 15.0 < plain_odds
    assert odds_of_squares == pytest.approx(plain_of_squares)


def _discharged(seed: int, rate: float) -> Flight:
    """Steadily, every 10 s, by 20 mOhm that the twin does not have."""
    twin = Pack(cell=load_cell("lg_m50"))
    time_s = np.arange(0.0, 2800.0 / rate, 10.0)
    load = Load(time_s=time_s, current_A=np.full(time_s.size, 5.0 * rate))
    truth = replace(twin, effects=(SeriesResistance(resistance_ohm=0.02),))
    voltage_V = simulate(truth, load).require().voltage_V
    voltage_V = voltage_V + np.random.default_rng(seed).normal(0.0, 1e-3, time_s.size)
    voltage_V[(time_s > 1800.0 / rate) & (time_s < 2000.0 / rate)] += 0.06
    return Flight(
        name=f"discharge {seed}", pack=twin, load=load, voltage_V=voltage_V,
        judged=np.ones(time_s.size, dtype=bool), motion=np.full(time_s.size, ""),
    )  # fmt: skip
