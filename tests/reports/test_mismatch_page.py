"""The page of a mismatch: a sentence for each verdict, complete, honest, safe from names."""

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.font_manager import fontManager
from matplotlib.mathtext import MathTextParser

from reports.mismatch import headline, mismatch_page
from reports.mismatch.candidates import outcome
from reports.mismatch.drawn import MOST_DRAWN, chosen, mean_mV, stretches
from reports.mismatch.effects import effects, equation
from reports.mismatch.summary import errors_of, sizes_V
from reports.mismatch.words import CLAUSES, NAMES, clause, listed, name, number, percent
from reports.render import render
from segment.segment import Motion
from tests.reports.mismatch_example import NOISE_V, TIME_S, course, finding, pair, report
from tests.reports.test_calibration_page import EVIL
from tests.reports.test_page import DRAWING, parsed
from twin.effects import AnyEffect, SelfHeating
from twin.mismatch import Finding, Hidden, Revealed, Value, Verdict
from twin.mismatch.hypothesis import HYPOTHESES, Hypothesis


def html(of: Finding) -> str:
    return render(mismatch_page(report(of)))


def words(page: str) -> str:
    return " ".join(DRAWING.sub("", page).split())


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (Verdict.NONE, "The twin says what these recordings say"),
        (Verdict.NAMED, "The pack heats itself and the twin did not know"),
        (Verdict.AMBIGUOUS, "most likely it is self-heating (98 %)."),
        (
            Verdict.UNKNOWN,
            "(nearest comes self-heating, which leaves 8.2 mV); it follows",
        ),
    ],
)
def test_each_verdict_has_a_sentence_and_a_whole_page(verdict: Verdict, said: str) -> None:
    of = finding(verdict)
    assert said in headline(of)
    page = html(of)
    parsed(page)
    assert said in words(page)


def test_what_was_found_is_shown_with_its_size_equation_source_and_error() -> None:
    text = words(html(finding()))
    size_mV = 1e3 * sizes_V(finding())["self_heating"]
    for said in (
        f"({size_mV:.1f} mV of the pack&#39;s voltage)",
        "12.30 ± 0.60 W/(m² K)",
        "Bernardi",
        "8.2 mV with it and 35.2 mV without (noise 8.0 mV)",
        "--pack better.toml",
        "C\\,\\dot T",  # for those who do not see the drawing
        "rejected: misses what was held out",
        "rejected: more effects than are needed",
        "evidence lost (6 is strong)",
        "twice the logarithm of the odds",
    ):
        assert said in text


def test_errors_are_listed_by_recording_and_together_where_there_are_several() -> None:
    def rows(of: Finding) -> list[tuple[str, ...]]:
        section = next(s for s in mismatch_page(report(of)).sections if s.id == "fit")
        return [tuple(cell.text for cell in row) for row in section.tables[0].rows]

    of = finding()
    assert [r[:2] for r in rows(of)] == [("a.ulg", "fitted"), ("b.ulg", "held out")]
    own = of.courses[1]
    for row, values_V in zip((2, 3), (own.residual_V, own.after_V), strict=True):
        expected = 1e3 * np.sqrt(np.mean(values_V[own.judged] ** 2))
        assert float(rows(of)[1][row]) == pytest.approx(expected, abs=0.05)
    more = replace(of, courses=(*of.courses, course("c.ulg", ahead=True)))
    assert ("all", "held out", "35.2", "8.2", "8.0") in rows(more)


def test_the_size_of_an_effect_is_that_of_samples_that_count() -> None:
    rise_mV = 60.0 * TIME_S[TIME_S > 5.0] / TIME_S[-1]
    assert 1e3 * sizes_V(finding())["self_heating"] == pytest.approx(np.sqrt(np.mean(rise_mV**2)))


def test_a_pair_names_both_and_what_looks_the_same_and_the_test_that_tells() -> None:
    said = headline(pair())
    assert said.startswith("Two things were left out")
    assert "5.0 mΩ more in series" in said
    assert "cannot tell it from films on the electrodes" in said
    text = words(html(pair()))
    assert "What would tell more: full throttle for 60 s" in text
    assert text.count("<h2") == len(mismatch_page(report(pair())).sections)


def test_the_list_for_a_pack_file_keeps_what_the_pack_has() -> None:
    """As it stands it replaces that of the pack file."""
    both = {s.id: {r.label: r for r in s.rows} for s in effects(report(pair()))}
    heating = both["effect-self_heating"]["In a pack file"]
    resistance = both["effect-series_resistance"]["In a pack file"]
    assert heating.value == '[twin] physics = ["sei", "self_heating", "series_resistance"]'
    assert resistance.value == heating.value
    assert heating.note == (
        "and [environment] heat_transfer_W_m2_K = 12.3; better.toml has all of it"
    )
    assert resistance.note.startswith("and [effects.series_resistance] resistance_ohm = 0.005; ")
    (open_,) = effects(report(finding(Verdict.AMBIGUOUS)))
    row = next(r for r in open_.rows if r.label == "In a pack file")
    assert "--adopt" not in row.note
    assert "better.toml" not in row.note


def test_what_is_not_settled_is_never_stated() -> None:
    text = words(html(finding(Verdict.AMBIGUOUS)))
    assert text.count("the pack heats itself") == text.count("if it is this, the pack heats itself")
    assert "likeliest, not settled" in text


def test_an_unknown_one_is_described_and_never_named() -> None:
    text = words(html(finding(Verdict.UNKNOWN)))
    assert "A description, not a cause" in text
    assert "-12.3" in text
    assert "Before and after" not in text
    assert errors_of(finding(Verdict.UNKNOWN)) == (("as configured", 0.0352),)
    assert "Error as configured" in text
    assert "taken" not in {outcome(c, finding(Verdict.UNKNOWN)) for c in finding().candidates}


def test_what_explains_most_of_an_unknown_one_is_a_lead_and_what_explains_less_is_none() -> None:
    unknown = finding(Verdict.UNKNOWN)
    far = replace(unknown, candidates=unknown.candidates[2:])  # the likeliest leaves 21 of 35 mV
    assert "explains that; it follows the current squared." in headline(far)


def test_what_is_no_larger_than_the_noise_is_not_said_to_exceed_it() -> None:
    unknown = finding(Verdict.UNKNOWN)
    assert "more than the noise of 8.0 mV" in headline(unknown)
    near = replace(unknown, errors=replace(unknown.errors, held_out_before=8.02e-3))
    assert "off by 8.0 mV, no more than the noise of 8.0 mV, but not by chance" in headline(near)


def test_a_start_within_its_tolerance_is_not_told_as_noise() -> None:
    none = finding(Verdict.NONE)
    assert "(8.2 mV) is little more than the noise of 8.0 mV" in headline(none)
    assert "Error with starts within their tolerance" in words(html(none))
    less = replace(none, errors=replace(none.errors, held_out_after=7.1e-3))
    assert "what differs (7.1 mV) is no more than the noise of 8.0 mV" in headline(less)
    more = replace(none, errors=replace(none.errors, held_out_after=19.5e-3))
    assert "may err by: 19.5 mV at 8.0 mV of noise" in headline(more)
    assert "than the noise" not in headline(more)


def test_where_nothing_is_found_no_effect_has_a_section() -> None:
    ids = [s.id for s in mismatch_page(report(finding(Verdict.NONE))).sections]
    assert ids == ["summary", "where", "candidates", "provenance"]
    none = finding(Verdict.NONE)
    assert outcome(none.candidates[-1], none) == "taken"


@pytest.mark.parametrize("h", HYPOTHESES, ids=lambda h: h.id)
def test_every_hypothesis_has_words_and_an_equation_that_can_be_set(h: Hypothesis) -> None:
    assert h.id in NAMES
    assert h.id in CLAUSES
    changed = [
        Value(name=p.name, value=p.value + p.prior_std, std=1e-9, unit=p.unit) for p in h.parameters
    ]
    assert not re.search(r"nan|_|  ", clause(h.id, changed))
    kind: type[AnyEffect] = h.kind
    assert equation(kind.equation, "e") is not None


@pytest.mark.parametrize("h", HYPOTHESES, ids=lambda h: h.id)
def test_any_number_of_an_effect_may_be_all_that_is_told(h: Hypothesis) -> None:
    for p in h.parameters:
        alone = [Value(name=p.name, value=0.5 * p.upper, std=1e-9, unit=p.unit)]
        assert not re.search(r"nan|_|  |\(\)", clause(h.id, alone))
    assert "the recordings do" in clause(h.id, [])


def test_a_number_at_its_bound_is_shown_as_none() -> None:
    """A fit ends where rounding has it, 2e-23 Ohm; a small one beside a larger error is a size."""
    at_bound = Value(name="resistance_ohm", value=2e-23, std=6e-4, unit="Ohm")
    assert at_bound.shown == 0.0
    assert replace(at_bound, value=6e-5).shown == 6e-5
    assert "has nothing in series" in clause("series_resistance", [at_bound])


def test_an_effect_that_has_no_words_yet_is_named_by_its_id() -> None:
    assert clause("gas_generation", []) == "the twin has no gas generation, the recordings do"
    assert equation(r"\nosuchthing{x}", "e") is None


def test_an_equation_is_set_in_matplotlibs_own_fonts_whatever_its_list_of_fonts_holds(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    whole = equation(SelfHeating.equation, "e")
    few = [font for font in fontManager.ttflist if font.name == "DejaVu Sans"]
    monkeypatch.setattr(fontManager, "ttflist", few)
    MathTextParser._parse_cached.cache_clear()
    fontManager._findfont_cached.cache_clear()
    assert equation(SelfHeating.equation, "e") == whole
    assert not [r for r in caplog.records if "findfont" in r.message]


@pytest.mark.parametrize(
    ("effect", "first", "second", "said"),
    [
        ("film_resistance", ("negative_ohm_m2", 2.6e-3), ("positive_ohm_m2", 1.4e-3),
         "2.6 mΩ m² on the negative one and 1.4 mΩ m² on the positive one"),
        ("reaction_kinetics", ("negative_factor", 1.02), ("positive_factor", 0.86),
         "1.0 times on the negative one and 0.86 times on the positive one"),
        ("electrolyte_transport", ("diffusivity_factor", 0.6), ("conductivity_factor", 0.9),
         "salt diffuses in it 0.60 times as fast and it conducts 0.90 times as well"),
        ("ocv_hysteresis", ("negative_amplitude_V", 8.7e-3), ("positive_amplitude_V", 7.4e-3),
         "by up to 8.7 mV on the negative one and 7.4 mV on the positive one"),
    ],
)  # fmt: skip
def test_numbers_that_share_one_drop_of_voltage_are_said_together(
    effect: str, first: tuple[str, float], second: tuple[str, float], said: str
) -> None:
    """Both were fitted; the smaller, two deviations or less from nothing, is part of the size."""
    larger = Value(name=first[0], value=first[1], std=1e-4, unit="")
    smaller = Value(name=second[0], value=second[1], std=0.1, unit="")
    assert said in clause(effect, [larger, smaller])


def test_of_an_effect_with_several_parts_those_that_are_told_are_said() -> None:
    parts = [
        Value(name="capacity_factor", value=0.9, std=0.01, unit="1"),
        Value(name="soc_offset", value=-0.001, std=0.01, unit="1"),
        Value(name="resistance_ohm", value=0.0, std=1e-3, unit="Ohm"),
    ]
    assert clause("weak_cell", parts) == "one cell is not like the others: it holds 10 % less"


@pytest.mark.parametrize(
    ("effect", "number_", "value", "said"),
    [
        (
            "current_gain",
            "gain",
            1.25,
            "20 % too low, or the pack is 0.80 times as large as stated, as",
        ),
        (
            "current_gain",
            "gain",
            0.8,
            "25 % too high, or the pack is 1.2 times as large as stated: ",
        ),
        ("voltage_gain", "gain", 1.02, "the voltage sensor reads 2.0 % too high"),  # V_rec = g V
        ("current_offset", "offset_A", 0.5, "reads 0.50 A too low"),  # I = I_rec + offset
        ("clock_shift", "shift_s", 0.2, "recorded 0.20 s late"),  # I(t) = I_rec(t + shift)
        ("initial_soc", "offset", -0.03, "started 3.0 % emptier"),
        ("lithium_inventory_loss", "lost", 0.08, "8.0 % less lithium"),
        ("cold_pack", "start_offset_K", -8.0, "started 8.0 K colder than the twin was told"),
    ],
)
def test_signs_are_those_of_the_equations(
    effect: str, number_: str, value: float, said: str
) -> None:
    assert said in clause(effect, [Value(name=number_, value=value, std=1e-9, unit="")])


def test_words() -> None:
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed(["a", "b"], "or") == "a or b"
    assert listed([]) == ""
    assert [percent(p) for p in (0.9999, 0.5, 1e-6)] == ["> 99 %", "50 %", "< 1 %"]
    assert number("heat_transfer_W_m2_K") == "heat transfer"
    assert name("no_such") == "no such"


def test_motions_become_stretches_and_the_unknown_stays_white() -> None:
    made = stretches(course("a", ahead=False))
    assert [s.motion for s in made] == [Motion.HOVER, Motion.VERTICAL]
    assert (made[0].start_s, made[1].stop_s) == (0.0, pytest.approx(110.0))
    assert made[0].stop_s == made[1].start_s


def test_a_drawn_line_is_the_mean_over_a_second_of_what_counts() -> None:
    own = course("a", ahead=False)
    _, smooth = mean_mV(own, own.after_V)
    assert np.all(np.isnan(smooth) == ~own.judged)
    assert np.nanstd(smooth) == pytest.approx(1e3 * NOISE_V / np.sqrt(11), rel=0.2)
    _, straight = mean_mV(own, np.full(TIME_S.size, 0.05))
    assert np.nanmax(np.abs(straight - 50.0)) < 1e-9


def test_a_line_of_a_sparse_recording_is_broken_at_its_pauses_alone() -> None:
    own = course("a", ahead=False)
    sparse = replace(own, time_s=100.0 * TIME_S, judged=np.ones(TIME_S.size, dtype=bool))
    assert np.all(np.isfinite(mean_mV(sparse, own.after_V)[1]))
    paused = replace(sparse, time_s=sparse.time_s + 60.0 * (np.arange(TIME_S.size) >= 200))
    t, drawn = mean_mV(paused, own.after_V)
    (gap,) = np.flatnonzero(np.isnan(drawn)).tolist()
    assert gap == 200
    assert paused.time_s[199] < t[gap] < paused.time_s[200]


def test_of_many_recordings_the_worst_are_drawn_and_the_rest_is_said() -> None:
    many = [course(f"{k}", ahead=False) for k in range(MOST_DRAWN + 2)]
    quiet = replace(many[0], residual_V=many[0].after_V)
    courses = (quiet, *many[1:])
    assert quiet not in chosen(courses)
    assert "2 more recordings are not drawn" in words(html(replace(finding(), courses=courses)))


def test_names_and_texts_of_others_stay_text() -> None:
    of = finding()
    courses = tuple(replace(c, name=EVIL) for c in of.courses)
    spans = tuple(replace(s, flight=EVIL) for s in of.spans)
    page = html(replace(of, courses=courses, spans=spans, remarks=(EVIL,), advice=EVIL))
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_a_revealed_channel_is_shown_before_and_after() -> None:
    measured = 298.0 + TIME_S / 20
    warm = Revealed(
        flight="b.ulg", channel=Hidden.TEMPERATURE, time_s=TIME_S, measured=measured,
        before=np.full(TIME_S.size, 298.0), after=measured + 0.25,
    )  # fmt: skip
    rms_K = np.sqrt(np.mean((TIME_S / 20) ** 2))
    base = report(finding())
    text = words(render(mismatch_page(replace(base, revealed=(warm,), concealed=("temperature",)))))
    assert f"{rms_K:.2f} K RMS before, 0.25 K after" in text
    assert "temperature</td>" in text  # kept from the twin
    alone = replace(base, revealed=(replace(warm, after=None),))
    assert "there is no twin to adopt" in words(render(mismatch_page(alone)))


def test_the_same_finding_gives_the_same_bytes() -> None:
    assert html(pair()) == html(pair())
