"""Tables of the page that a sceptic asks for: controls, baselines, probabilities, causes, words."""

from dataclasses import replace
from typing import Any

import pytest

from proof.judge import VERDICT
from proof.judged import judged_trial
from proof.ledger import Entry
from proof.outcome import Baseline, Judged, Outcome
from proof.page.baselines import baselines
from proof.page.causes import cause
from proof.page.channels import channels
from proof.page.controls import controls
from proof.page.page import provenance
from proof.page.probabilities import probabilities, scored
from proof.page.sizes import sizes
from proof.page.summary import summary
from proof.page.told import in_data, where
from proof.page.trials import trials
from proof.places import SEALED, TRUTH
from proof.truth import Number
from reports.section import Section, Table
from tests.proof.proof_example import (
    NOISE_V,
    judged,
    proof,
    recorded,
    simulated,
    sized,
    truth,
)

ERRORS = ("noise_floor", "holdout_before", "holdout_after")
FLOOR = "The twin is stated to err by 20 mV rms: what changes the voltage by less has no name"


def there(made: Section | None) -> Section:
    assert made is not None
    return made


def texts(table: Table) -> list[list[str]]:
    return [[c.text for c in row] for row in table.rows]


def missed(verdict: str = "unknown", **more: Any) -> Judged:
    own = judged(1, truth("temperature", "", "cold_pack", strength=3.0), Outcome.MISSED, verdict)
    return replace(own, **more)


@pytest.mark.parametrize(
    ("own", "said", "not_said"),
    [
        (simulated(), "the twin's own equations", "no blind sample"),
        (recorded(), "no blind sample", "the twin's own equations"),
    ],
)
def test_the_headline_has_its_limits_below_it(own: list[Judged], said: str, not_said: str) -> None:
    lead = " ".join(summary(proof(own)).lead)
    assert said in lead
    assert not_said not in lead
    assert "independent and drawn anew" in summary(proof(own)).notes[0]


def test_what_is_drawn_from_the_seed_is_said_of_the_trials_that_there_are() -> None:
    def note(own: list[Judged]) -> str:
        return provenance(proof(own)).rows[0].note

    assert "drawn from it" in note(simulated())
    assert "only orders" not in note(simulated())
    assert "only orders" in note(recorded())
    assert "drawn from it" not in note(recorded())


def test_targets_and_kinds_that_were_not_run_take_one_line() -> None:
    (line,) = (n.text for n in summary(proof(simulated())).notices if n.text.startswith("Kinds"))
    assert line.endswith("; 8 targets that no trial tells of left out.")


def test_what_was_said_of_controls_is_split() -> None:
    nothing, odd = truth("control", ""), truth("real control", "")
    own = [
        judged(1, nothing, Outcome.RIGHT, "none"),
        judged(2, nothing, Outcome.WRONG, "unknown"),
        judged(3, odd, Outcome.RIGHT, "unknown"),
        judged(4, odd, Outcome.WRONG, "named", "leakage"),
        judged(5, odd, Outcome.MISSED, "failed"),
    ]
    (table,) = controls(proof(own))
    assert texts(table) == [
        ["simulated", "2", "1", "1", "0", "0", "0", "1"],
        ["recorded", "3", "0", "1", "0", "1", "1", "2"],
    ]
    assert controls(proof(own[:1]))[0].rows[0][-1].doubt is False
    assert controls(proof([missed()])) == ()


@pytest.mark.parametrize("verdict", ["failed", "stopped"])
def test_a_control_without_a_verdict_is_counted_as_that(verdict: str) -> None:
    (table,) = controls(proof([judged(1, truth("control", ""), Outcome.MISSED, verdict)]))
    assert [cell.text for cell in table.rows[0]][-2:] == ["1", "1"]


def test_baselines_are_counted_worse_as_good_and_better() -> None:
    one = judged(1, truth("single", "", "leakage"), Outcome.RIGHT, "named", "leakage")
    own = [
        replace(one, baselines=(Baseline(id="refit", what="", numbers=9,
                                         held_out_V=over * one.held_out_after_V),))
        for over in (1.06, 1.04, 0.96, 0.94, float("nan"))
    ]  # fmt: skip
    known = replace(own[1], truth=truth("fault", "", "series_resistance"))
    made = there(baselines(proof([*own, known])))
    assert texts(made.tables[0]) == [["base twin refitted", "6", "2", "3", "1", "1.0 ×"]]
    assert "In 4 of 6 trials the held-out error does not favour" in made.lead[-1]
    assert made.lead[-1].endswith("(1 recorded, 3 simulated). In 1 of these it holds the truth.")


def test_probabilities_are_scored_by_name_and_by_look_alikes() -> None:
    (heat, extra), (other,) = (
        list(scored(judged(1, truth("single", "", "leakage"), Outcome.WRONG, "named", *names)))
        for names in (("series_resistance~leakage", "weak_cell"), ("leakage~weak_cell",))
    )
    assert (heat.right, heat.first) == (True, False)
    assert (extra.right, extra.first) == (False, False)
    assert (other.right, other.first) == (True, True)


def test_probabilities_are_scored_in_bins_and_groups() -> None:
    right = judged(1, truth("single", "", "leakage"), Outcome.RIGHT, "named", "leakage")
    wrong = judged(2, truth("single", "", "leakage"), Outcome.WRONG, "named", "weak_cell")
    real = judged(3, truth("fault", "", "leakage"), Outcome.RIGHT, "named", "weak_cell~leakage")

    def at(t: Judged, probability: float) -> Judged:
        return replace(t, named=(replace(t.named[0], probability=probability),))

    (table,) = there(
        probabilities(proof([at(right, 1.0), at(wrong, 0.991), at(right, 0.99), at(real, 0.5)]))
    ).tables
    assert [r[:5] + r[6:] for r in texts(table)] == [
        ["simulated", "> 99 %", "2", "1", "50", "1", "50"],
        ["simulated", "95 to 99 %", "1", "1", "100", "1", "100"],
        ["recorded", "< 80 %", "1", "1", "100", "0", "0"],
    ]


def test_numbers_far_off_are_counted() -> None:
    heat = simulated()[2]
    far = sized("self_heating", "heat_transfer_W_m2_K", "W/m2/K", true=8.0, found=9.3)  # 3.25
    assert "1 of 2 beyond 3 (0.3 % expected)" in there(
        sizes(proof([heat, replace(heat, sized=(far,))]))
    ).lead[1]  # fmt: skip


def test_where_the_last_check_up_would_have_done_as_well_is_said() -> None:
    aged = recorded()[2]  # found 2.57 of 2.61 Ah
    own = [
        replace(aged, truth=replace(aged.truth, details={"fitted, Ah": fitted}))
        for fitted in (2.62, 2.66)
    ]
    table = there(channels(proof(own))).tables[-1]
    assert "In 1 of 2 the last check-up" in table.caption
    assert [r[-2] for r in texts(table)] == ["yes", "no"]


@pytest.mark.parametrize(
    ("own", "said"),
    [
        (missed("stopped", remarks=("stopped from outside after 32 s",)), "no verdict: stopped"),
        (missed("failed", remarks=("exit code 1: no file",)), "no verdict: exit code 1: no file"),
        (missed(truth=truth("temperature", "", "cold_pack", strength=0.8)),
         "seen, but not named. The effect is smaller than what the base twin errs"),
        (missed(remarks=(FLOOR, "a.csv: pauses", "heat leaves as much")),
         "The tool said: heat leaves as much"),
        (missed(held_out_before_V=1.2 * NOISE_V), "the twin as given misses only 1.2 × the floor"),
        (missed(held_out_after_V=2.0 * NOISE_V), "The best that the tool found leaves 2.0 ×"),
    ],
)  # fmt: skip
def test_a_failure_has_a_cause(own: Judged, said: str) -> None:
    assert said in cause(own)


def test_what_a_verdict_remarks_is_at_hand() -> None:
    entries = {
        event: Entry(number=0, utc="", event=event, trial="", sha256={file: ""}, key="", before="")
        for event, file in (("sealed", SEALED), ("judged", VERDICT), ("opened", TRUTH))
    }
    verdict = {"verdict": "none", "effects": [], "rmse_mv": dict.fromkeys(ERRORS, 1.0),
               "remarks": ["odd"]}  # fmt: skip
    own = judged_trial(
        truth("control", ""), verdict, entries, name="", source="", baselines=(), channels=(),
        capacity_C=None, seconds=1.0,
    )  # fmt: skip
    assert own.remarks == ("odd",)


def test_of_many_right_names_the_first_stands_for_all() -> None:
    def said(*alike: str) -> str:
        return cause(missed(truth=truth("ageing", "", "|".join(alike))))

    lost = ("lithium_inventory_loss", "active_material_loss_negative", "series_resistance")
    assert said(*lost) == "lost lithium or the like seen, but not named"
    assert said(*lost[:2]) == "lost lithium or lost negative material seen, but not named"


def test_where_no_cause_is_at_hand_none_is_made_up() -> None:
    assert cause(missed(remarks=(FLOOR,))) == "another temperature than stated seen, but not named"


def test_effects_are_told_by_name_number_and_unit() -> None:
    def told(kind: str, said: str, *numbers: Number, source: str = "PyBaMM") -> str:
        own = truth(kind, said, *(n.effect for n in numbers), numbers=numbers)
        made = judged(1, own, Outcome.RIGHT, "none", source=source)
        return in_data(made).replace("\N{NO-BREAK SPACE}", " ")

    gain = Number(effect="current_gain", name="gain", value=4 / 3, unit="1")
    shift = Number(effect="clock_shift", name="shift_s", value=-0.5, unit="s")
    ohm = Number(effect="series_resistance", name="resistance_ohm", value=0.0014, unit="Ohm")
    assert told("fault", "the current was recorded with current_gain -0.25: gain 1.333", gain) == (
        "gain of the current sensor: 1.333"
    )
    cooling = Number(effect="self_heating", name="heat_transfer_W_m2_K", value=40, unit="W/m2/K")
    assert told("fault", "", cooling) == "self-heating: heat transfer 40 W/(m² K)"
    assert told("fault", "", shift) == "clocks that disagree: shift -0.5 s"
    pair = "electrolyte_transport: 0.554 (-ln of the factor) and series_resistance: 0.0014 (Ohm)"
    assert told("pair", pair, ohm) == (
        "transport in the electrolyte: 0.575 times as much and resistance in series: 1.4 mΩ"
    )
    assert told("foreign", "foreign:loose_connector: 0.0191 (Ohm)") == "loose connector: 0.0191 Ohm"
    assert told("temperature", "it is cold (a cell, MIT)", source="a cell, MIT") == "it is cold"


def test_the_recording_is_said_and_its_owner_once() -> None:
    own = judged(1, truth("temperature", "", details={"recording 1": "2C", "recording 2": "3C",
                                                      "in its list": "trial-h15"}),
                 Outcome.RIGHT, "none", source="Leaf cell (batterysim, MIT)")  # fmt: skip
    assert where(own).text == "Leaf cell: 2C and 3C"
    assert where(own).whole == own.source


def test_what_is_not_right_comes_first_among_all_trials() -> None:
    tables = there(trials(proof())).tables
    single = next(
        t for t in tables if t.caption == "Simulated by PyBaMM, single: 2 right of 5 trials"
    )
    assert [r[1] for r in texts(single)] == ["wrong", "missed", "missed", "right", "right"]
    assert "recorded" not in tables[0].caption.lower()
    assert "real control" in tables[-1].caption
