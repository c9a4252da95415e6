"""The damage on the page and in `result.json`, of a pack that is really cycled."""

import json
import re
from dataclasses import replace
from importlib import resources

import jsonschema
import numpy as np
import pytest

from analyze.output import _fleet_row
from reports.damage import assessment_part, loss_part
from reports.fleet_flights import FleetFlight
from reports.flight import FlightReport
from reports.flight_page import flight_page
from reports.quantity import significant
from reports.render import render
from reports.results import result_of
from reports.section import Section, Severity
from reports.sections.damage import _span, damage
from segment.profile import TooLittle
from segment.segment import Motion
from tests.reports import example
from tests.reports.example import SPANS
from twin.damage import Part
from twin.damage.cost import total
from twin.effects import AGEING
from twin.solution import Status

SCHEMA = json.loads((resources.files("reports") / "result.schema.json").read_text("utf-8"))
MEASURES = {"lithium", "negative", "positive", "sei", "sei_on_cracks", "plating", "total"}


def report(*, thorough: bool = False) -> FlightReport:
    return example.report(damage=example.study(thorough=thorough))


def shown(of: FlightReport) -> Section:
    section = damage(of)
    assert section is not None
    return section


@pytest.mark.parametrize("thorough", [False, True])
def test_the_result_keeps_the_schema_and_its_parts_agree(*, thorough: bool) -> None:
    whole = json.loads(result_of(report(thorough=thorough)).model_dump_json())
    jsonschema.Draft202012Validator(SCHEMA).validate(whole)
    hover = whole["motions"]["hover"]
    told, beside = hover["damage"], hover["relative_to_constant_current"]
    for name in ("per_flight", "in_flight", "per_minute", "per_ah", "per_wh", "per_km", "as_flown"):
        loss = told[name]
        parts = loss["sei_mah"] + loss["sei_on_cracks_mah"] + loss["plating_mah"]
        assert loss["total_mah"] == pytest.approx(parts)
        assert loss["lithium_mah"] >= loss["total_mah"]
    per_flight = told["per_flight"]["lithium_mah"]
    assert told["per_minute"]["lithium_mah"] * told["flown_s"] / 60 == pytest.approx(per_flight)
    assert told["per_ah"]["lithium_mah"] * told["charge_ah"] == pytest.approx(per_flight)
    assert told["per_wh"]["lithium_mah"] * told["energy_wh"] == pytest.approx(per_flight)
    assert told["distance_km"] == pytest.approx(0.5e-3 * told["flown_s"])
    assert set(beside["per_flight"]) == set(beside["in_flight"]) == MEASURES
    nothing = {"value": None, "std": None, "lower_95": None, "upper_95": None}
    assert beside["in_flight"]["positive"] == nothing
    ratio = beside["per_flight"]["lithium"]
    assert ratio["upper_95"] - ratio["value"] > 1.96 * ratio["std"] > 0  # Student's t of two
    assert ratio["lower_95"] == pytest.approx(max(2 * ratio["value"] - ratio["upper_95"], 0.0))
    assert set(told["other_order_95"]) == MEASURES
    assert beside["per_flight"]["sei"]["value"] == pytest.approx(1.0, abs=0.05)
    assert whole["motions"]["horizontal"]["damage"] is None
    assert [b["current_a"] for b in whole["assessment"]["baselines"]] == [18, 19, 20, 21]
    assert (told["counterfactuals"] is not None) == thorough
    assert (whole["assessment"]["life"] is not None) == thorough


def test_the_life_is_told_with_its_interval_and_what_ends_it() -> None:
    life = json.loads(result_of(report(thorough=True)).model_dump_json())["assessment"]["life"]
    assert [life[k]["flights"] for k in ("as_flown", "daily", "limited")] == [812, 405, None]
    lower, upper = life["as_flown"]["lower_95"], life["as_flown"]["upper_95"]
    assert upper / 812 == pytest.approx(812 / lower) == pytest.approx(np.exp(2.4469 * 0.3), 1e-3)
    assert life["motions"]["hover"]["flights"] == 900
    assert (life["cell_uncertain"], life["ageing"]) == (True, "assumed")
    section = shown(report(thorough=True))
    assert section.rows[0].value == "812"
    assert f"{significant(lower, 2)} to {significant(upper, 2)}" in section.rows[0].note
    (table,) = [t for t in section.tables if t.caption.startswith("Flights to 80 %")]
    why = "not reached: before that, in the flight the voltage reached the lower cut-off"
    assert [c.text for c in table.rows[2]][1:] == [why, "–"]
    assert [row[0].text for row in table.rows][-1] == "hover only"
    assert any("gives 870, the flight itself 812" in note for note in section.notes)
    assert any("factor 10 in the growth of SEI" in note for note in section.notes)


def test_a_life_without_a_number_is_a_sentence() -> None:
    study = example.study(thorough=True)
    assert study.lives is not None
    gentle = shown(report(thorough=True)).rows[1]
    why = "before that, in the flight the voltage reached the lower cut-off"
    assert (gentle.value, gentle.unit) == ("not reached", "")
    assert gentle.note == f"the same with no current above 24.0 A: {why}"
    lives = replace(study.lives, soon=study.lives.gentle)
    lives = replace(lives, gentle=study.lives.soon)
    other = shown(example.report(damage=replace(study, lives=lives))).rows[1]
    assert other.note == "the same with no current above 24.0 A; as flown not reached"
    lives = replace(lives, gentle=lives.soon)
    soon, gentle = shown(example.report(damage=replace(study, lives=lives))).rows
    assert (soon.value, soon.unit) == ("not reached", "")
    assert soon.note == f"if always flown and charged like this, at this temperature: {why}"
    assert gentle.note == f"the same with no current above 24.0 A: {why}"
    lives = replace(study.lives, gentle=study.lives.soon)
    gentle = shown(example.report(damage=replace(study, lives=lives))).rows[1]
    assert (gentle.value, gentle.unit) == ("812", "flights")
    assert gentle.note == "the same with no current above 24.0 A; as flown 812"


def test_a_pilot_reads_what_a_flight_costs_and_that_the_constants_are_an_example() -> None:
    section = shown(report())
    found = example.study(thorough=False).assessment
    own = found.motions["hover"].cycled.whole.inventory_C / 3.6
    held = found.pack.rated_C / 3.6
    share = f"about {significant(100 * own / held, 2)} % of its capacity"
    assert f"{share} (by example constants, not this pack's)" in section.lead[0]
    assert f"{significant(own, 2)} of {held:.0f} mAh are lithium that is lost" in section.lead[0]
    assert "hover costs" in section.lead[1]
    (notice,) = [n for n in section.notices if n.code == "ageing_assumed"]
    assert notice.severity is Severity.DOUBT
    assert "O'Kane 2022" in notice.text


def test_constants_that_the_pack_states_are_no_example() -> None:
    known = example.study(thorough=False)
    pack = known.assessment.pack
    stated = [replace(e, strength=0.5) if isinstance(e, AGEING) else e for e in pack.effects]
    found = replace(known.assessment, pack=replace(pack, effects=tuple(stated)))
    section = shown(example.report(damage=replace(known, assessment=found)))
    assert "% of its capacity (by its pack file)" in section.lead[0]
    assert not [n for n in section.notices if n.code == "ageing_assumed"]


def test_a_span_of_costs_has_one_number_where_both_are_printed_alike() -> None:
    assert _span([0.0432, 0.0427]) == "0.043"
    assert _span([0.0432, 0.031]) == "0.031 to 0.043"


def test_words_of_chemistry_are_told_once_and_the_inside_of_the_cells_is_closed() -> None:
    section = shown(report())
    assert any("SEI is a film on the negative electrode" in n for n in section.notes)
    assert [t.caption.split(":")[0] for t in section.tables if t.folded] == ["Inside the cells"]
    assert {"material, negative [10⁻⁶]", "material, positive [10⁻⁶]"} <= {
        c.title for c in section.tables[0].columns
    }


def test_a_loss_that_no_cell_would_survive_is_doubted() -> None:
    """As with O'Kane's constants for the LG M50 without stress-enhanced diffusion."""
    known = example.study(thorough=False)
    own = known.assessment.motions["hover"]
    fast = replace(own.cycled, whole=replace(own.cycled.whole, positive=0.1))
    found = replace(known.assessment, motions={"hover": replace(own, cycled=fast)})
    section = shown(example.report(damage=replace(known, assessment=found)))
    (notice,) = [n for n in section.notices if n.code == "implausible_loss"]
    assert "loses 10 % of its material" in notice.text
    assert not [n for n in shown(report()).notices if n.code == "implausible_loss"]


def test_the_costliest_stretch_is_named() -> None:
    flown = example.study(thorough=False).attribution
    rates = {
        (s.start_s, s.stop_s): c.loss.inventory_C / c.duration_s
        for s, c in zip(flown.spans, flown.costs, strict=True)
        if s.name != "ground"
    }
    start_s, stop_s = max(rates, key=rates.__getitem__)
    assert f"from {start_s:.0f} to {stop_s:.0f} s" in shown(report()).lead[2]


def test_the_drawing_has_a_star_a_motion_and_a_circle_a_baseline() -> None:
    first, second = shown(report()).figures
    assert "SEI on cracks" in first.svg
    assert "constant current" in first.svg
    values = example.study(thorough=False).assessment.motions["hover"].normalised[Part.WHOLE]
    assert f"{values['sei'].value:.3f}" in first.description
    assert len(re.findall("<svg", first.svg + second.svg)) == 2


def test_the_tables_have_a_row_a_motion_and_why_only_if_thorough() -> None:
    quick, thorough = (shown(report(thorough=t)).tables for t in (False, True))
    assert len(thorough) == len(quick) + 2
    assert [row[0].text for row in quick[0].rows] == ["hover", *4 * ["constant current"]]
    assert len(thorough[-2].rows) == 5
    html = render(flight_page(report(thorough=True)))
    assert "What each motion did to the battery" in html
    assert not re.search(r"\bnan\b", html, re.IGNORECASE)


def test_what_could_not_be_told_is_said() -> None:
    assert damage(example.report()) is None
    reason = "No motion lasted long enough."
    section = shown(example.report(no_damage=reason))
    assert [n.text for n in section.notices] == [reason]
    none = replace(
        example.study(thorough=False).assessment,
        motions={},
        cannot={"vertical": "the pack flies 1 s"},
    )
    section = shown(example.report(damage=replace(example.study(thorough=False), assessment=none)))
    assert any("Vertical could not be repeated" in n.text for n in section.notices)
    assert len(section.figures) == 1


def test_a_flight_that_cannot_be_simulated_to_its_end_has_no_cost_as_it_was_flown() -> None:
    """Of a pack stated too small: the damage of a half of it would be shown as that of all."""
    own = example.study(thorough=False)
    whole = own.attribution
    half = replace(whole, status=Status.LOWER_CUT_OFF, costs=whole.costs[: len(whole.costs) // 2])
    ended = replace(own, attribution=replace(half, whole=total(half.costs)))
    result = result_of(example.report(damage=ended))
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(result.model_dump_json()))
    assert result.assessment is not None
    assert result.assessment.in_flight is None
    last_s = SPANS[-1][2]
    reason = result.assessment.not_assessed["flight"]
    assert reason.startswith(f"{half.spans[len(half.costs) - 1].stop_s:.0f} of {last_s:.0f} s can")
    begun = {s.name for s in half.spans[len(half.costs) - 1 :]}
    assert half.by_name().keys() == {s.name for s in half.spans} - begun
    (notice,) = (n for n in shown(example.report(damage=ended)).notices if reason in n.text)
    assert notice.text.startswith("What this flight cost as it was flown is not known to its end")
    assert not any("took most lithium" in text for text in shown(example.report(damage=ended)).lead)
    row = _fleet_row(FleetFlight(folder="a", log="a.ulg", result=result))
    assert row["lithium_lost_mah"] is None


def test_a_motion_without_a_profile_has_its_reason_in_the_result() -> None:
    short = TooLittle(motion=Motion.VERTICAL, source_s=6.0, reason="6.0 s of vertical motion")
    profiles = {**example.report().profiles, Motion.VERTICAL: short}
    result = result_of(example.report(damage=example.study(thorough=False), profiles=profiles))
    assert result.assessment is not None
    assert result.assessment.not_assessed == {"vertical": "6.0 s of vertical motion"}


def test_what_lies_on_the_ground_is_not_lost_in_the_air() -> None:
    """Films grow with time: minutes before the take-off would count almost as flown ones."""
    own = example.study(thorough=False)
    first, *rest = own.attribution.spans
    assert first.name == "ground"
    flown = replace(own.attribution, spans=(replace(first, name="hover"), *rest))
    without, told = (
        part.in_flight.lithium_mah
        for s in (own, replace(own, attribution=flown))
        if (part := assessment_part(s, {})) and part.in_flight
    )
    on_ground = loss_part(own.attribution.costs[0].loss, own.cyclable_C).lithium_mah
    assert told - without == pytest.approx(on_ground)
    assert on_ground > 0
