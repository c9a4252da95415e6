"""The page of a calibration: complete, safe from names, honest about what is missing."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from reports.calibration import (
    CalibrationReport,
    SourceFile,
    calibration_page,
    called,
    cell_estimates,
    grouped,
    headline,
    uncertain,
)
from reports.calibration.cells import cells
from reports.calibration.drawings import labels, short
from reports.calibration.errors import errors
from reports.calibration.fits import busiest, fits
from reports.calibration.further import further, remarks
from reports.calibration.names import is_start
from reports.calibration.summary import summary
from reports.page import Page
from reports.render import render
from reports.section import Section
from tests.reports import example
from tests.reports.test_page import DRAWING, parsed
from tests.twin.calibrate.synthetic import cell_pack, measured
from twin.calibrate.answer import Verdict
from twin.calibrate.checks import Fitted
from twin.calibrate.parameters import ACTIVATIONS, WARMING
from twin.calibrate.run import ADVICE, Calibration, conclusions, problem_of
from twin.calibrate.unlike import Difference, Unlike

EVIL = '<script>alert("1")</script> $x_1$'


@cache
def found(names: tuple[str, ...] = ("2C", "pulses")) -> Calibration:
    """At the truth: a fit ends close to it, and takes longer."""
    pack = cell_pack()
    tests, truth, _ = measured(pack, 2, names)
    tests = [replace(t, remarks=("positive current is discharge",)) for t in tests]
    steps = conclusions(problem_of(pack, tests), truth, tests)
    told = next(c for c in steps if ADVICE not in c.missing)
    held = tuple(replace(f, held_out_V=f.simulated_V + 1e-3) for f in told.fitted)
    return replace(told, fitted=held if len(names) > 1 else told.fitted, missing=())


def report(
    of: Calibration,
    *,
    pack: str = "S500",
    doubts: tuple[str, ...] = (),
    unlike: Unlike | None = None,
) -> CalibrationReport:
    return CalibrationReport(
        found=of,
        pack=pack,
        pack_file="calibrated.toml",
        layout="4S1P",
        files=tuple(SourceFile(name=f.name, sha256="ab" * 32) for f in of.fitted),
        evaluations=0,
        seed=0,
        doubts=doubts,
        version="0.1.0",
        unlike=unlike,
    )


def page(of: Calibration, **changes: object) -> str:
    return render(calibration_page(report(of, **changes)))  # type: ignore[arg-type]


@cache
def usual() -> str:
    return page(found(), doubts=("4.2018 V beyond the cut-off",))


def content(*sections: Section | None) -> str:
    """A page of these alone."""
    kept = tuple(s for s in sections if s is not None)
    return render(Page(title="t", subtitle="s", sections=kept, version="1"))


def words(html: str) -> str:
    """The page without its drawings."""
    return DRAWING.sub("", html)


def renamed(of: Calibration, name: str) -> Calibration:
    """Its first test called something else, everywhere."""
    old = of.fitted[0].name

    def new(text: str) -> str:
        return text.replace(old, name)

    problem = of.problem.of_other_tests([replace(t, name=new(t.name)) for t in of.problem.tests])
    estimates = tuple(replace(e, name=new(e.name)) for e in of.answer.estimates)
    return replace(
        of,
        problem=problem,
        answer=replace(of.answer, estimates=estimates, names=tuple(map(new, of.answer.names))),
        information=replace(
            of.information,
            tests=tuple(map(new, of.information.tests)),
            names=tuple(map(new, of.information.names)),
        ),
        fitted=tuple(replace(f, name=new(f.name)) for f in of.fitted),
        remarks=tuple(map(new, of.remarks)),
    )


def cut(f: Fitted) -> Fitted:
    """The same test; the simulation ends half way."""
    half = f.time_s.size // 2
    gone = np.where(np.arange(f.time_s.size) < half, f.simulated_V, np.nan)
    return replace(f, simulated_V=gone, held_out_V=None)


@pytest.mark.parametrize("name", [*ACTIVATIONS, *WARMING])
def test_what_only_some_tests_tell_has_a_name_too(name: str) -> None:
    assert called(name).text != name


def test_every_test_and_every_parameter_is_there() -> None:
    html = usual()
    for f in found().fitted:
        assert f"<figcaption>{f.name}: " in html
        assert f"{1e3 * f.rms_V:.2f} mV RMS fitted, {1e3 * f.held_out_rms_V:.2f} mV" in html  # type: ignore[operator]
    told = found().answer
    for e in (*told.estimates, *told.derived):
        c = called(e.name, e.unit)
        row = re.search(rf"<tr><th scope=row>{re.escape(c.text)}</th>.*?</tr>", html)
        assert row is not None, e.name
        for value in (e.value, e.lower, e.upper):
            assert f">{c.value(value)}</td>" in row.group(), e.name
        assert f">{e.name}</td>" in row.group()
    drawn = re.findall(r"<svg .*?</svg>", html, re.DOTALL)
    assert len(drawn) == len(found().fitted) + 5
    for name in found().information.names:
        shown = sum(f">{called(name).text}<" in svg for svg in drawn)
        assert is_start(name) or shown == 4, name  # intervals, map, correlations, combinations


def test_every_advice_remark_and_doubt_is_there() -> None:
    html = words(usual())
    for advice in found().advice:
        assert f">{advice.name}</th>" in html
    assert "2C, pulses: positive current is discharge" in html
    assert "4.2018 V beyond the cut-off" in html
    corrected = replace(found(), remarks=("the open-circuit curve is corrected by 12 mV",))
    assert "the open-circuit curve is corrected by 12 mV" in content(remarks(report(corrected)))


def test_the_page_closes_every_tag_fetches_nothing_and_runs_nothing() -> None:
    got = parsed(usual())
    assert not got.open
    assert not got.fetched
    assert "script" not in got.tags
    assert len(got.ids) == len(set(got.ids))


def test_names_are_text_and_nothing_else() -> None:
    html = page(renamed(found(), EVIL), pack=example.EVIL, doubts=("<b>old</b>",))
    assert parsed(html).tags == parsed(usual()).tags
    assert html.count("&lt;script&gt;") > 5
    assert "$x_1$" in html  # no formula


def test_one_test_alone_has_a_page() -> None:
    html = page(found(("2C",)))
    assert "follows its test to" in html
    assert "predicted" not in re.sub(
        "<style>.*?</style>", "", words(html), flags=re.DOTALL
    ).replace("predicted from the other tests [mV]", "")
    assert "this test identifies" in html
    assert "it states that it errs by" not in html
    stated = r"it states that it errs by \d\.\d mV a cell in tests it was not fitted to"
    assert re.search(stated, page(found()))


def test_a_test_that_ended_early_is_said_to_have() -> None:
    first, second = found().fitted
    early = report(replace(found(), fitted=(cut(first), second)))
    html = words(content(summary(early), fits(early), errors(early)))
    at_min = first.time_s[first.time_s.size // 2 - 1] / 60
    assert f"2C: the simulated cell comes to {at_min:.1f} min of" in html
    assert "does not come to the end of 2C" in html
    assert "follows 1 of its 2 tests to the end, to 2." in headline(early.found)
    assert "– mV RMS fitted" in html
    assert not re.search(r"\b(nan|inf)\b", html, re.IGNORECASE)
    lost = report(
        replace(found(), fitted=(replace(first, held_out_V=cut(first).simulated_V), second))
    )
    row = next(r for r in summary(lost).rows if "not fitted to" in r.label)
    assert row.value == f"{1e3 * second.held_out_rms_V:.1f}"  # type: ignore[operator]
    assert "1 of 2 predictions end early" in row.note
    never = replace(first, simulated_V=np.full(first.time_s.size, np.nan), held_out_V=None)
    none = report(replace(found(), fitted=(never, cut(second))))
    assert "none of its tests to the end" in content(summary(none), fits(none), errors(none))


def test_what_was_not_computed_is_said_first() -> None:
    part = replace(found(), advice=(), missing=("2C predicted from the other tests", ADVICE))
    said = summary(report(part)).notices[0].text
    assert "not computed are 2C predicted from the other tests, further tests worth making" in said
    assert further(report(part)) is None


def test_the_sentence_counts_what_is_listed() -> None:
    count = {v: sum(e.verdict is v for e in cell_estimates(found())) for v in Verdict}
    text = headline(found())
    assert len(cell_estimates(found())) == 23  # Table I has 21, beside capacity and resistance
    assert f"of its 23 parameters these tests identify {count[Verdict.IDENTIFIED]}" in text
    assert f"tell something of {count[Verdict.PARTLY]}" in text
    assert count[Verdict.PRIOR] == 0  # it is at the truth, not at a fit: what is untold is moved
    assert f"do not narrow {count[Verdict.UNTOLD]}." in text
    assert "as close as their noise allows" in text
    least = max(cell_estimates(found()), key=lambda e: e.left_of_prior)
    assert uncertain(found()).startswith(f"Uncertain: {called(least.name).text.replace(':', '')}")
    worst = max(found().fitted, key=lambda f: f.rms_V)
    off = replace(worst, simulated_V=worst.simulated_V + 0.05)
    assert "50.0 mV a cell (the noise is 2." in headline(replace(found(), fitted=(off,))).replace(
        f"{1e3 * off.rms_V:.1f}", "50.0"
    )


def test_what_is_true_of_several_tests_is_said_once() -> None:
    remarks = ("a: sign", "b: sign", "b: odd", "no test ends", "c: sign")
    assert grouped(remarks, ("a", "b", "c")) == ("a, b, c: sign", "b: odd", "no test ends")


def test_the_stretch_with_most_pulses_is_drawn_larger() -> None:
    discharge, pulses = found().fitted
    assert busiest(discharge) is None
    stretch = busiest(pulses)
    assert stretch is not None
    inside = (pulses.time_s >= stretch[0]) & (pulses.time_s <= stretch[1])
    assert stretch[1] - stretch[0] < 0.1 * pulses.time_s[-1]
    assert np.ptp(pulses.current_A[inside]) == np.ptp(pulses.current_A)


def test_a_long_name_keeps_both_its_ends() -> None:
    assert short("0.1C", 9) == "0.1C"
    assert short("a" * 30 + "z", 9) == "aaaa…aaaz"


def test_what_all_names_begin_with_is_left_out_of_drawings() -> None:
    assert labels(["NMC_25_1C", "NMC_25_2C", "NMC_25_"]) == ["1C", "2C", "NMC_25_"]
    assert labels(["2C_0", "2C"]) == ["2C_0", "2C"]
    assert labels(["a_b"]) == ["a_b"]
    assert labels(["0.1C", "0.2C"]) == ["0.1C", "0.2C"]


def long_test(name: str, of: Fitted, samples: int) -> Fitted:
    """As noisy as can be, which is the worst for drawings."""
    t = np.linspace(0.0, 36000.0, samples)
    noise = np.random.default_rng(0).normal(0, 0.1, samples)
    return replace(
        of,
        name=name,
        time_s=t,
        current_A=np.sign(noise),
        measured_V=3.7 + noise,
        simulated_V=3.7 + noise[::-1],
        held_out_V=3.7 - noise,
        soc=1 - t / 36000,
    )


def test_large_tests_do_not_make_the_page_huge() -> None:
    first = found()
    names = [f"test number {k}" for k in range(9)]
    sampled = [replace(first.problem.tests[0], name=n) for n in names]
    many = replace(
        first,
        problem=first.problem.of_other_tests(sampled),
        fitted=tuple(long_test(n, first.fitted[0], 50_000) for n in names),
    )
    html = content(fits(report(many)), errors(report(many)))
    assert len(html.encode()) < 2_000_000


def test_cells_that_differ_have_a_section_and_cells_that_do_not_have_none() -> None:
    capacity = Difference(
        quantity="capacity_factor", unit="1", value=np.array([-0.06, 0.02, 0.04]),
        std=np.full(3, 0.005), chance=1e-9,
    )  # fmt: skip
    charge = Difference(
        quantity="soc_offset", unit="1", value=np.array([0.001, 0.0, -0.001]),
        std=np.full(3, 0.002), chance=0.4,
    )  # fmt: skip
    unlike = Unlike(
        soc=0.9, differences=(capacity, charge), weak=(), answer=None,
        before_V=np.array([0.035, 0.01, 0.02]), after_V=np.full(3, 0.002),
    )  # fmt: skip
    section = cells(report(found(), unlike=unlike))
    assert section is not None
    assert section.lead == (
        "The cells differ in capacity. Cell 1 is furthest from the others: the mean cell misses "
        "its voltage by 35.0 mV, its own numbers by 2.0 mV.",
    )
    assert [cell.text for cell in section.tables[0].rows[0]] == [
        "1", "-6.00 (-6.82 to -5.18)", "+0.10 (-0.23 to +0.43)", "35.0", "2.0",
    ]  # fmt: skip
    alike = replace(unlike, differences=(charge,))
    assert "no difference" in content(cells(report(found(), unlike=alike)))
    assert cells(report(found())) is None
