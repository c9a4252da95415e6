"""The page of a proof: failures first and whole, figures as they were measured, safe from names."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from benchmarks.proof_figure import figure_png
from benchmarks.proof_figure import main as draw
from proof.out import proof_json
from proof.outcome import Baseline, Judged, NotMade, Outcome, Proof
from proof.page import proof_page
from proof.page.baselines import MOST_LISTED, baselines, holds_truth, won
from proof.page.channels import MOST_DRAWN, channels
from proof.page.confusion import (
    FOREIGN,
    NOTHING,
    SEVERAL,
    concealed,
    confusion,
    matrix,
    said_of_concealed,
)
from proof.page.failed import failed
from proof.page.protocol import in_order, protocol
from proof.page.sizes import sizes
from proof.page.summary import headline, result, summary
from proof.page.words import LONGEST, not_named, not_there, short, why
from proof.targets import targets
from reports.render import render
from reports.section import Section
from tests.proof.proof_example import (
    NOISE_V,
    judged,
    named,
    opened,
    proof,
    recorded,
    simulated,
    truth,
)
from tests.reports.test_calibration_page import EVIL
from tests.reports.test_page import DRAWING, parsed

CONTROL = judged(1, truth("control", "nothing", strength=1.0), Outcome.RIGHT, "none")
PAIR = truth("pair", "", "leakage", "sensor_lag")


def html(of: Proof) -> str:
    return render(proof_page(of))


@cache
def whole() -> str:
    return html(proof())


def words(page: str) -> str:
    return " ".join(DRAWING.sub("", page).split())


def there(made: Section | None) -> Section:
    assert made is not None
    return made


@pytest.mark.parametrize(
    ("trials", "missing"),
    [
        (None, set[str]()),
        ([], {"trials", "confusion", "probabilities", "baselines", "sizes", "channels"}),
        (simulated(), {"channels"}),
        ([CONTROL], {"probabilities", "baselines", "sizes", "channels"}),
        (recorded(), {"sizes"}),
    ],
    ids=["whole", "no trial", "simulated", "controls", "recorded"],
)
def test_what_was_not_run_has_no_section_and_the_page_is_whole(
    trials: list[Judged] | None, missing: set[str]
) -> None:
    of = proof(trials)
    every = ["summary", "failed", "protocol", "trials", "confusion", "probabilities",
             "baselines", "sizes", "channels", "provenance"]  # fmt: skip
    page = whole() if trials is None else html(of)
    assert re.findall('<section id="([a-z]+)"', page) == [i for i in every if i not in missing]
    parsed(page)
    assert not re.search(r"\bnan\b|\binf\b", words(page))


def test_the_headline_counts() -> None:
    assert headline(proof()) == (
        "4 of 8 simulated effects at three times the noise or more were judged right; 1 false "
        "alarm in 3 controls; 3 of 4 right on recordings of real cells."
    )
    assert headline(proof([])) == "No trial was judged."
    assert headline(proof([CONTROL])) == "0 false alarms in 1 control."
    weak = [t for t in simulated() if t.name == "trial-09"]
    assert headline(proof(weak)) == "0 of 1 verdict right."


def test_targets_say_by_how_much_they_are_missed() -> None:
    rows = {r[0].text: r[1] for r in summary(proof()).tables[1].rows}
    assert rows["right, simulated effects at 3 × noise or more"].text == "missed by 40.0 points"
    assert rows["right, recorded on real cells, controls not counted"].text == (
        "missed by 5.0 points; 4 of at least 12 trials"
    )
    every = "concealed temperature, rms, recorded, of all: where none was named, the temperature "
    assert rows[f"{every}that was told"].text == "missed by 0.60 K"
    assert (
        rows["charge of the check-up held out, relative error"].text == "missed: 1 without a figure"
    )
    met = rows["concealed voltage of the weakest cell, rms, recorded"]
    assert (met.text, met.doubt) == ("met", False)
    assert "concealed temperature, rms, simulated" not in rows  # was not run
    assert summary(proof([])).tables == ()


def test_a_target_that_is_missed_by_little_is_not_missed_by_nothing() -> None:
    held = next(t for t in targets(proof().trials) if t.id == "held out simulated")
    assert result(replace(held, limit=1.5, measured=1.5004)) == "missed by 0.0004 ×"


def test_every_failure_is_told_with_its_reason_and_what_is_left() -> None:
    of = proof()
    own = failed(of)
    failing = [t for t in of.trials if t.outcome is not Outcome.RIGHT]
    told, not_made = own.tables
    assert not told.folded
    assert len(told.rows) == len(failing)
    for t in failing:
        (texts,) = ([c.text for c in row] for row in told.rows if row[0].text == t.name)
        assert t.outcome.value == texts[1]
        assert t.truth.said == texts[3]
        assert texts[6].startswith(why(t))
        assert float(texts[7].split()[0]) == pytest.approx(t.held_out_after_V / NOISE_V, rel=0.05)
    assert [c.text for c in told.rows[0][:2]] == ["trial-02", "wrong"]
    assert "no size from 0.005" in not_made.rows[0][2].text
    assert "None of 1 verdict is other than right." in failed(proof([CONTROL])).lead[0]


def test_reasons() -> None:
    def said(verdict: str, *effects: str, **more: Any) -> str:
        own = replace(PAIR, **more)
        return why(judged(1, own, Outcome.WRONG, verdict, *effects))

    assert said("named", "leakage") == "a slow current sensor not named"
    assert said("named", "leakage", "sensor_lag", "weak_cell") == (
        "a weak cell named, which is not there"
    )
    assert said("named", "leakage", "weak_cell") == (
        "a weak cell named instead of a slow current sensor"
    )
    assert said("none") == "leakage and a slow current sensor taken for noise"
    assert said("unknown", effects=()) == "what is there seen, but not named"
    alarm = judged(1, truth("control", ""), Outcome.WRONG, "unknown")
    assert why(alarm) == "there is nothing, and something was said to be there"
    assert why(CONTROL) == ""


def test_one_name_stands_for_one_effect_and_what_comes_with_it_may_be_named() -> None:
    both = judged(1, PAIR, Outcome.PART, "named", "leakage~sensor_lag")
    assert len(not_named(both)) == 1
    swapped = judged(1, PAIR, Outcome.RIGHT, "named", "leakage~sensor_lag", "leakage")
    assert not_named(swapped) == ()
    also = replace(both, truth=replace(PAIR, also=("weak_cell",)),
                   named=named("leakage", "weak_cell"))  # fmt: skip
    assert not_there(also) == ()
    vague = judged(1, PAIR, Outcome.PART, "named", "weak_cell~a~b~c~leakage")
    assert [n.id for n in not_there(vague)] == ["weak_cell"]  # it looks like too much


def test_the_matrix_counts_what_looks_the_same_under_its_truth() -> None:
    counts = matrix(t for t in simulated() if t.truth.kind != "pair")
    film = counts["film_resistance", "film_resistance"]
    assert (film.trials, film.alike, film.worst) == (1, 1, Outcome.RIGHT)
    assert counts["series_resistance", "current_gain"].worst is Outcome.WRONG
    assert counts[NOTHING, "clock_shift"].trials == 1
    assert counts[FOREIGN, FOREIGN].worst is Outcome.RIGHT
    assert counts["current_gain", NOTHING].worst is Outcome.MISSED
    more = judged(1, truth("single", "", "leakage"), Outcome.WRONG, "named", "leakage", "weak_cell")
    assert matrix([more])["leakage", SEVERAL].trials == 1


def test_trials_on_real_cells_are_counted_by_what_was_concealed() -> None:
    counts = matrix(recorded(), put_in=concealed, said=said_of_concealed)
    assert {key: (c.trials, c.alike, c.worst) for key, c in counts.items()} == {
        (NOTHING, NOTHING): (1, 0, Outcome.RIGHT),
        ("temperature", "temperature"): (1, 0, Outcome.RIGHT),
        ("ageing", "ageing"): (1, 0, Outcome.RIGHT),  # by the second of two that are right
        ("ageing", FOREIGN): (1, 0, Outcome.MISSED),
        ("weak cell", "weak cell"): (1, 0, Outcome.RIGHT),
    }
    warm = truth("temperature", "", "self_heating")
    alike = judged(1, warm, Outcome.RIGHT, "named", "leakage~self_heating", source="a cell")
    other = judged(2, warm, Outcome.WRONG, "named", "leakage", source="a cell")
    counts = matrix([alike, other], put_in=concealed, said=said_of_concealed)
    assert counts["temperature", "temperature"].alike == 1
    assert counts["temperature", "leakage"].worst is Outcome.WRONG
    (figure,) = there(confusion(proof(recorded()))).figures
    assert figure.caption == "Recorded on real cells, by what was concealed; 5 trials."
    assert "ageing said to be not in the library: 1" in figure.description


def test_where_a_baseline_won_is_said() -> None:
    of = proof()
    assert [(t.name, b.id) for t, b in won(of.trials)] == [("trial-16", "correction")]
    own = there(baselines(of))
    assert own.tables[1].caption == "Where a baseline won"
    assert "A baseline predicted what was held out better" in failed(of).lead[1]
    beaten = [t for t in of.trials if t.name != "trial-16"]
    assert there(baselines(proof(beaten))).tables[1].folded


def test_many_wins_are_listed_the_clearest_first() -> None:
    beaten = next(t for t in proof().trials if t.baselines)
    trials = [
        replace(beaten, baselines=(replace(beaten.baselines[0], held_out_V=1e-4 * k),))
        for k in range(1, MOST_LISTED + 4)
    ]
    first, rest = there(baselines(proof(trials[::-1]))).tables[1:3]
    assert (len(first.rows), len(rest.rows), rest.folded) == (MOST_LISTED, 3, True)
    assert first.rows[0][4].text == "0.1"


def test_a_refit_of_the_base_twin_may_hold_the_truth() -> None:
    refit = Baseline(id="refit", what="", numbers=9, held_out_V=0.01)
    resistance = judged(1, truth("single", "", "series_resistance"), Outcome.RIGHT, "none")
    heat = judged(1, truth("single", "", "self_heating"), Outcome.RIGHT, "none")
    assert holds_truth(resistance, refit)
    assert not holds_truth(heat, refit)
    assert not holds_truth(CONTROL, refit)


def test_hashes_are_cut_but_not_lost() -> None:
    of = proof()
    page = whole()
    for t in of.trials:
        assert f'title="{t.sealed.sha256}; entry {t.sealed.entry}"' in page
    assert of.head in words(page)
    assert of.command in words(page)
    assert "the last truth was sealed before the first verdict" in words(page)


def test_columns_of_sentences_are_wide() -> None:
    assert whole().count('<td class="sentences">') > len(proof().trials)


def test_an_order_that_is_not_kept_is_told() -> None:
    late = replace(CONTROL, sealed=CONTROL.opened)
    assert in_order(CONTROL)
    assert not in_order(late)
    assert protocol(proof([late])).notices[0].text.startswith("Not sealed, judged and opened in")
    other = judged(2, CONTROL.truth, Outcome.RIGHT, "none")
    between = replace(other, sealed=replace(other.sealed, utc="2026-11-21T18:06:30.000+00:00"))
    assert "some truths were sealed after" in protocol(proof([CONTROL, between])).notices[0].text


def test_sizes_are_judged_in_stated_deviations() -> None:
    own = there(sizes(proof()))
    found, absent = (tuple(c.text for c in row) for row in own.tables[0].rows)
    assert found[-2:] == ("2.3", "11")  # (8.9 - 8) / 0.4, and 0.9 of 8
    assert absent[-2] == "not told"
    assert absent[1].endswith("as what looks the same")
    assert "0 of 1 within 1" in own.lead[1]
    film = simulated()[3]
    missed = replace(film, verdict="none", named=())
    assert there(sizes(proof([missed]))).tables[0].rows[0][-2].text == "not named"


def test_channels_are_drawn_up_to_a_number_and_all_listed() -> None:
    warm = recorded()[1]
    many = tuple(opened(f"r{k}", "temperature", (5.0, 0.1 * k)) for k in range(MOST_DRAWN + 3))
    own = there(channels(proof([replace(warm, channels=many)])))
    assert "3 more are in the table alone" in own.figures[0].caption
    assert "r0:" not in own.figures[0].description
    assert len(own.tables[0].rows) == len(many)


def test_a_long_name_keeps_both_its_ends() -> None:
    text = short("a" * 50 + "z" * 50)
    assert (len(text) <= LONGEST, text[0], text[-1]) == (True, "a", "z")


def test_names_and_texts_of_others_stay_text() -> None:
    evil = EVIL * 5
    own = [
        replace(t, name=f"{k}{evil}", source=evil, truth=replace(t.truth, said=evil),
                channels=tuple(replace(c, recording=evil) for c in t.channels),
                baselines=tuple(replace(b, what=evil) for b in t.baselines))
        for k, t in enumerate(proof().trials)
    ]  # fmt: skip
    odd = judged(99, truth("single", evil, evil), Outcome.WRONG, "named", evil)
    of = replace(proof([*own, odd]), command=evil, versions={evil: evil},
                 not_made=(NotMade(name=evil, source=evil, reason=evil),))  # fmt: skip
    page = html(of)
    parsed(page)
    assert "<script" not in page
    assert "&lt;script&gt;" in page


@pytest.mark.parametrize("trials", [None, [], [CONTROL]], ids=["whole", "no trial", "controls"])
def test_the_drawing_for_the_readme(trials: list[Judged] | None) -> None:
    assert figure_png(proof(trials)).startswith(b"\x89PNG")


def test_the_drawing_is_made_again_from_what_was_written(tmp_path: Path) -> None:
    """Of two runs as of one that has the trials of both, with noise beside the floor of one."""
    noisy = [replace(t, truth=replace(t.truth, noise_V=0.02)) for t in recorded()]
    for name, trials in (("a", simulated()), ("b", noisy)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "proof.json").write_text(json.dumps(proof_json(proof(trials))))
    draw(tmp_path / "proof.png", [tmp_path / "a", tmp_path / "b"])
    assert (tmp_path / "proof.png").read_bytes() == figure_png(proof([*simulated(), *noisy]))


def test_the_same_proof_gives_the_same_bytes() -> None:
    assert html(proof()) == whole()
