"""Shares with their intervals, and targets that are met, missed or not run."""

from dataclasses import replace

import pytest

from proof.outcome import Judged, Outcome
from proof.tally import NORMAL_95, Share, by_class, by_source, kinds_not_run, strong, weak
from proof.targets import Status, Target, targets
from proof.truth import KINDS
from tests.proof.proof_example import judged, opened, proof, recorded, simulated, truth


def of(name: str, trials: list[Judged]) -> Target:
    return next(t for t in targets(trials) if t.id == name)


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    [  # Newcombe, Stat. Med. 17, 857 (1998), table I, method 3
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_intervals_are_wilsons(count: int, of: int, low: float, high: float) -> None:
    assert Share(count=count, of=of).interval == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(("count", "of"), [(0, 1), (12, 12), (9, 10), (45, 50)])
def test_at_the_ends_of_an_interval_the_share_is_just_not_believed(count: int, of: int) -> None:
    share = Share(count=count, of=of)
    assert share.value is not None
    for p in share.interval:
        deviations2 = NORMAL_95**2 * p * (1 - p) / of
        own = p in (0.0, 1.0)  # nothing is beyond
        assert own or (share.value - p) ** 2 == pytest.approx(deviations2, rel=1e-9)


def test_of_none_nothing_is_known() -> None:
    assert Share(count=0, of=0).value is None
    assert Share(count=0, of=0).interval == (0.0, 1.0)


def test_every_trial_is_in_one_class_that_holds_no_other() -> None:
    trials = proof().trials
    whole = {"strong", "weak", "control", "real", "real foreign", "real control"}
    counted = sum(t.right.of for t in by_class(trials) if t.id in whole)
    assert counted == len(trials)
    parts = [t.right.of for t in by_class(trials) if t.id.startswith("strong ")]
    assert sum(parts) == sum(map(strong, trials))


def test_of_real_effects_those_as_large_as_the_error_of_the_twin_are_counted_by_themselves() -> (
    None
):
    one = judged(1, truth("temperature", "", "cold_pack", strength=1.0), Outcome.RIGHT, "named")
    below = replace(one, truth=replace(one.truth, strength=0.99))
    control = replace(one, truth=replace(one.truth, kind="real control"))
    counted = {t.id: t.right.of for t in by_class([one, below, control])}
    assert (counted["real"], counted["real above"]) == (2, 1)


def test_an_effect_at_the_limit_is_strong_and_one_without_a_strength_is_not() -> None:
    at = judged(1, truth("single", "", "leakage", strength=3.0), Outcome.RIGHT, "none")
    below = replace(at, truth=replace(at.truth, strength=2.99))
    unknown = replace(at, truth=replace(at.truth, strength=float("nan")))
    assert [strong(t) for t in (at, below, unknown)] == [True, False, False]
    assert [weak(t) for t in (at, below, unknown)] == [False, True, True]


def test_without_trials_no_target_is_met_or_missed() -> None:
    assert {t.status for t in targets([])} == {Status.NOT_RUN}
    assert kinds_not_run([]) == KINDS


def test_anything_said_of_a_control_is_a_false_alarm() -> None:
    control = judged(1, truth("real control", ""), Outcome.RIGHT, "none")
    assert of("false alarms", [control]).status is Status.MET
    told = of("false alarms", [control, replace(control, outcome=Outcome.WRONG, verdict="unknown")])
    assert (told.status, told.measured, told.short) == (Status.MISSED, 1.0, 1.0)


def test_real_cells_need_enough_trials_of_enough_cells() -> None:
    one = judged(1, truth("ageing", "", "leakage"), Outcome.RIGHT, "named", "leakage", source="a")
    many = [replace(one, source=s) for s in "abcd" * 3]
    assert of("real", many).status is Status.MET
    few = of("real", many[:11])
    assert (few.status, few.short, few.lacking) == (Status.MISSED, 0.0, "11 of at least 12 trials")
    same = of("real", [one] * 12)
    assert same.lacking == "1 of at least 4 cells"
    padded = [*many[:11], judged(2, truth("real control", ""), Outcome.RIGHT, "none")]
    assert of("real", padded).status is Status.MISSED  # controls do not count


def test_the_worst_channel_counts_and_one_that_no_twin_reaches_is_not_forgotten() -> None:
    warm = recorded()[1]  # 0.8 K and 2.6 K
    target = of("temperature recorded", [warm])
    assert (target.status, target.within, target.of) == (Status.MISSED, 1, 2)
    assert target.short == pytest.approx(0.6)
    better = replace(warm, channels=warm.channels[:1])
    assert (
        of("temperature recorded", [better]).absent,
        of("temperature recorded", [better]).of,
    ) == (1, 2)
    assert of("temperature recorded", [better]).status is Status.MISSED
    fixed = (*better.channels, opened("recording-b", "temperature", (14.0, 1.9)))
    assert of("temperature recorded", [replace(warm, channels=fixed)]).status is Status.MET


def test_where_nothing_was_named_the_twin_as_configured_is_judged() -> None:
    warm = recorded()[1]
    silent = replace(warm, channels=tuple(
        opened(c.recording, "temperature", (c.rms_before, None)) for c in warm.channels
    ))  # fmt: skip
    assert of("temperature recorded", [silent]).measured == 14.2


def test_temperatures_of_right_verdicts_are_a_target_beside_those_of_all() -> None:
    warm = recorded()[1]
    missed = replace(warm, outcome=Outcome.MISSED, verdict="none", named=(), channels=tuple(
        opened(c.recording, "temperature", (c.rms_before, None)) for c in warm.channels
    ))  # fmt: skip
    rightly, every = (
        of(name, [warm, missed]) for name in ("temperature recorded named", "temperature recorded")
    )
    assert (rightly.of, rightly.measured) == (2, 2.6)
    assert (every.of, every.measured) == (4, 14.2)


def test_real_cells_are_counted_each_by_itself_without_controls() -> None:
    assert [(t.id, t.right.count, t.right.of) for t in by_source(proof().trials)] == [
        ("LG M50", 1, 1),
        ("Melasta 6S, ETH", 1, 1),
        ("Panasonic", 0, 1),
        ("Samsung 30Q 3 Ah, USC", 1, 1),
    ]


def test_a_capacity_counts_by_its_size_whichever_way_it_is_off() -> None:
    aged = recorded()[2]
    assert of("capacity", [aged]).measured == pytest.approx(1 - 2.57 / 2.61)
    assert of("capacity", [replace(aged, capacity_C=None)]).status is Status.MISSED


def test_held_out_errors_count_only_where_something_was_named() -> None:
    named = [t for t in simulated() if t.verdict == "named"]
    target = of("held out simulated", simulated())
    assert target.of == len(named)
    assert target.measured == pytest.approx(14.0 / 8.0)
    assert of("held out floor", simulated()).status is Status.NOT_RUN


def test_what_the_tool_takes_for_noise_does_not_mend_the_figure_of_simulated_trials() -> None:
    wide = [replace(t, noise_V=1.0) for t in simulated()]
    assert of("held out simulated", wide) == of("held out simulated", simulated())
    real = [replace(t, noise_V=1.0) for t in recorded()]
    assert of("held out floor", real).measured == pytest.approx(11.0 / 8.0)
