"""What a sceptic asks for has to be as good as it can be, or it proves nothing."""

from dataclasses import replace

import numpy as np
import pytest

from proof.baselines import baselines, by_chance, recordings
from proof.correction import Answered, _cross_validated, corrected
from proof.question import Question, Recording
from tests.proof import trials
from tests.twin.mismatch.recordings import NOISE_V, pack
from tests.twin.mismatch.test_begun import late
from twin.effects import LithiumInventoryLoss, SeriesResistance
from twin.mismatch import HYPOTHESES
from twin.simulate import simulate


def answered(residual_V: np.ndarray[tuple[int], np.dtype[np.float64]], seed: int) -> Answered:
    question = trials.asked(0.0, (seed, seed + 1))
    load = question.load(question.fitted[0])
    return Answered(
        load=load,
        solution=simulate(question.pack, load),
        residual_V=residual_V[: load.time_s.size],
    )


def test_a_correction_finds_the_terms_that_are_there_and_predicts() -> None:
    noise = np.random.default_rng([0, 99]).normal(0, 8e-3, 1201)
    own, ahead = answered(noise, 1), answered(noise[::-1], 3)

    def there(a: Answered) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        columns = a.library()
        return np.asarray(0.004 * columns["current"] - 1e-5 * columns["(current squared)²"] + 0.03)

    found = corrected([Answered(load=own.load, solution=own.solution,
                                residual_V=own.residual_V + there(own))])  # fmt: skip
    assert "current" in " ".join(found.names)
    error_V = found.at(ahead) - there(ahead)
    assert np.sqrt(np.mean(error_V**2)) < 0.1 * np.std(there(ahead))


def test_of_noise_alone_hardly_anything_is_made() -> None:
    noise = np.random.default_rng([1, 99]).normal(0, 8e-3, 1201)
    own = answered(noise, 1)
    found = corrected([own])
    assert np.std(found.at(own)) < 1.5e-3


def test_how_large_a_term_is_in_its_units_decides_nothing() -> None:
    """The small one is a ten-millionth of the other, as a change of temperature is of charge²."""
    random = np.random.default_rng([3, 99])
    large, small, blocks = random.normal(size=600), random.normal(size=600), np.arange(600) // 100
    y = large + small + random.normal(0, 0.1, 600)

    def left(size: float) -> float:
        columns = {"large": large / size, "small": size * small}
        return _cross_validated(columns, ["large", "small"], y, blocks)

    assert left(1e-8) == pytest.approx(left(1.0), rel=1e-6)
    assert left(1.0) < 7.0


def test_a_residual_that_is_cut_off_counts_where_it_is() -> None:
    noise = np.random.default_rng([2, 99]).normal(0, 8e-3, 1201)
    noise[:600] = np.nan
    assert np.isfinite(corrected([answered(noise, 1)]).constant_V)


def test_a_twin_that_is_empty_too_early_is_missed_by_that_too() -> None:
    """Nothing that counts for the engine is left out of what it is compared with."""
    question = trials.asked(0.0, (1, 2))
    (flight,) = question.flights(question.fitted[:1])
    empty = replace(flight, pack=replace(flight.pack, initial_soc=0.02))
    own = Answered.of(empty)
    assert own.solution.voltage_V.size < flight.time_s.size
    assert np.isfinite(own.residual_V).sum() == flight.judged.sum()
    assert own.residual_V[-1] > 0.5
    assert np.isfinite(corrected([own]).at(own)).all()


@pytest.mark.parametrize("named", [["series_resistance"], ["cold_pack", "weak_cell"]])
def test_an_effect_by_chance_is_another_with_about_as_many_numbers(named: list[str]) -> None:
    sizes = {h.id: len(h.fitted) for h in HYPOTHESES}
    seen = set()
    for seed in range(30):
        chosen = by_chance(named, seed, pack())
        assert not {h.id for h in chosen} & set(named)
        assert len({h.id for h in chosen}) == len(named)
        off = [abs(len(h.fitted) - sizes[e]) for h, e in zip(chosen, named, strict=True)]
        assert off == [e == "weak_cell" for e in named]  # no other has three
        seen |= {h.id for h in chosen}
    assert len(seen) > 2
    assert "weak_cell" not in {h.id for h in by_chance(named, 0, replace(pack(), series=1))}


def test_no_effect_is_drawn_that_the_pack_states_within_errors() -> None:
    """As those of a cycler's sensors: it would be held, and lose to anything."""
    stated = replace(pack(), standard_errors={"clock_shift": {"shift_s": 0.02}})
    for own, there in ((pack(), True), (stated, False)):
        drawn = {h.id for k in range(60) for h in by_chance(["series_resistance"], k, own)}
        assert ("clock_shift" in drawn) == there


def test_what_the_verdict_says_looks_alike_is_no_other_effect() -> None:
    alike = [h.id for h in HYPOTHESES if len(h.fitted) == 1][:6]
    drawn = {h.id for k in range(60) for h in by_chance(["series_resistance"], k, pack(), alike)}
    assert drawn
    assert not drawn & set(alike)
    assert by_chance(["series_resistance"], 0, pack(), [h.id for h in HYPOTHESES]) == ()


def test_a_refit_is_not_ended_by_where_it_begins() -> None:
    """Of 12 % less lithium: from the twin as it is all numbers at once leave 23 mV of 8."""
    less = replace(pack(), effects=(LithiumInventoryLoss(lost=0.12),))
    question = trials.asked(0.0)

    def made(r: Recording) -> Recording:
        noise_V = np.random.default_rng(len(r.name)).normal(0.0, NOISE_V, r.time_s.size)
        return replace(r, voltage_V=simulate(less, question.load(r)).voltage_V + noise_V)

    question = replace(
        question,
        fitted=tuple(map(made, question.fitted)),
        held_out=tuple(map(made, question.held_out)),
    )
    verdict = {"verdict": "named", "effects": [{"id": "lithium_inventory_loss", "equivalent": []}]}
    (refit,) = (b for b in baselines(question, verdict) if b.id == "refit")
    assert refit.held_out_V < 1.25 * NOISE_V


def test_of_logs_that_begin_in_flight_all_are_judged_without_what_flowed_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What can explain the voltage leaves less so; an effect by chance leaves what it may."""
    truth = (SeriesResistance(resistance_ohm=0.006),)
    flights = [late(truth, seed) for seed in (1, 2)]
    given = [
        Recording(name=f.name, time_s=f.time_s, current_A=f.load.current_A, voltage_V=f.voltage_V)
        for f in flights
    ]
    question = Question(
        pack=flights[0].pack, ambient_K=flights[0].load.ambient_K, fitted=(given[0],),
        held_out=(given[1],),
    )  # fmt: skip
    verdict = {"verdict": "named", "effects": [{"id": "series_resistance", "equivalent": []}]}

    def held_out_V() -> dict[str, float]:
        return {b.id: b.held_out_V for b in baselines(question, verdict)}

    without_V = held_out_V()
    monkeypatch.setattr("proof.baselines.flown_before", lambda *_: None)
    with_V = held_out_V()
    assert set(without_V) == {"refit", "correction", "random"}
    assert all(without_V[name] < 0.95 * with_V[name] for name in ("refit", "correction"))
    assert without_V["random"] != with_V["random"]


def test_samples_that_stand_alone_count_for_nobody() -> None:
    """As for what was named: six of 1201, 0.3 V off."""
    question = trials.asked(trials.OHM)

    def struck(own: Recording) -> Recording:
        voltage_V = own.voltage_V.copy()
        voltage_V[100::200] += 0.3
        return replace(own, voltage_V=voltage_V)

    question = replace(
        question,
        fitted=tuple(map(struck, question.fitted)),
        held_out=tuple(map(struck, question.held_out)),
    )
    verdict = {"verdict": "named", "effects": [{"id": "series_resistance", "equivalent": []}]}
    refit, correction, _ = baselines(question, verdict)
    assert refit.held_out_V < 1.2 * NOISE_V
    assert correction.held_out_V < 1.5 * NOISE_V


def test_recordings_are_read_as_the_verdict_read_them() -> None:
    """From the files of the question, and with the mean of what an idle current's sensor makes."""
    question = trials.asked(trials.OHM)
    first = question.fitted[0]
    idle = first.time_s < 30
    noise_A = np.random.default_rng(2).normal(0.3, 0.2, first.time_s.size)
    idling = replace(first, current_A=np.where(idle, noise_A, first.current_A))
    (fitted,), (held_out,) = recordings(replace(question, fitted=(idling,)))
    assert np.ptp(fitted.load.current_A[5:280]) < 0.01
    np.testing.assert_array_equal(fitted.voltage_V, first.voltage_V)
    np.testing.assert_array_equal(held_out.load.current_A, question.held_out[0].current_A)
    assert fitted.load.ambient_K == question.ambient_K
    assert fitted.pack.initial_soc == question.pack.initial_soc
