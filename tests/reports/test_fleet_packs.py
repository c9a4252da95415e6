"""Packs of a fleet: put together by their serial numbers, the weakest first."""

from dataclasses import replace

import pytest

from reports.fleet import Fleet, fleet_page
from reports.fleet_flights import FleetFlight
from reports.fleet_packs import COLUMNS, packs_of, packs_section
from reports.flight import PackUse
from reports.parts.damage import AssessmentPart, LossPart
from reports.parts.flight import WarningPart
from reports.result import Result
from reports.section import Section
from tests.reports import example
from tests.reports.mismatch_example import finding
from tests.reports.test_fleet import copied, flight
from twin.calibrate.answer import Verdict
from twin.calibrate.flight import FlightFit
from twin.mismatch import Verdict as Finds

PLACE = {c.title: k for k, c in enumerate(COLUMNS)}


def flown(folder: str, day: int | None, serial: str, *, capacity_ah: float = 2.05) -> FleetFlight:
    """By a pack with that much left of 2.2 Ah."""
    return flight(folder, day, pack=fitted(serial, example.flight_fit(), capacity_ah))


def fitted(serial: str, fit: FlightFit, capacity_ah: float) -> PackUse:
    estimates = tuple(
        replace(e, value=3600 * capacity_ah) if e.name == "capacity_C" else e for e in fit.estimates
    )
    use = example.fitted_pack()
    assert use.fitting is not None
    fitting = replace(use.fitting, outcome=replace(fit, estimates=estimates))
    return replace(use, serial=serial, fitting=fitting)


def section_of(*flights: FleetFlight) -> Section:
    page = fleet_page(Fleet(flights=flights, failures=(), passed_over=0, version="0"))
    return next(s for s in page.sections if s.id == "packs")


def column(section: Section, title: str) -> list[str]:
    return [row[PLACE[title]].text for row in section.tables[0].rows]


def test_flights_of_one_pack_stand_together_and_the_weakest_comes_first() -> None:
    section = section_of(
        flown("a", 1, "strong", capacity_ah=2.2),
        flown("b", 2, "weak", capacity_ah=1.9),
        flown("c", 5, "weak", capacity_ah=1.64),
        flown("d", 4, "weak", capacity_ah=1.62),
    )
    assert column(section, "pack") == ["weak", "strong"]
    assert column(section, "flights") == ["3", "1"]
    assert column(section, "last flown") == ["2025-06-05", "2025-06-01"]
    assert column(section, "capacity [Ah]") == [
        "1.640 ± 0.060 (2025-06-05)", "2.200 ± 0.060 (2025-06-01)",
    ]  # fmt: skip
    assert section.tables[0].rows[0][PLACE["capacity [Ah]"]].href == "c/report.html"
    assert column(section, "by the last 5 flights [Ah]") == ["1.64 (1.62 to 1.90)", "–"]
    assert column(section, "of rated [%]") == ["75", "100"]
    one = flown("a", 1, "strong").result
    charge_ah = sum(s.charge_ah for s in one.segments)
    assert column(section, "charge [Ah]") == [f"{3 * charge_ah:.2f}", f"{charge_ah:.2f}"]
    assert column(section, "full cycles")[0] == f"{3 * charge_ah / 2.2:.1f}"
    assert [n.text for n in section.notices] == [
        "Less than 80 % of the rated capacity is left in: weak (75 %)."
    ]
    doubtful = [row[PLACE["of rated [%]"]].doubt for row in section.tables[0].rows]
    assert doubtful == [True, False]


def test_a_pack_that_is_not_surely_worn_is_said_to_may_be() -> None:
    """1.75 +- 0.06 of 2.2 Ah: of ten such packs more than four have 80 %."""
    weak, less = flown("a", 1, "weak", capacity_ah=1.6), flown("b", 2, "w", capacity_ah=1.75)
    section = section_of(weak, less)
    assert [n.text for n in section.notices] == [
        "Less than 80 % of the rated capacity is left in: weak (73 %, by one flight alone). "
        "Less than 80 % of the rated capacity may be left, within the errors, in: "
        "w (80 %, by one flight alone)."
    ]


def by_autopilot(flight: FleetFlight) -> FleetFlight:
    quality = flight.result.quality.model_copy(update={"current_source": "autopilot"})
    return replace(flight, result=flight.result.model_copy(update={"quality": quality}))


def test_a_pack_is_not_retired_by_a_sensor_of_an_autopilot_that_reads_low() -> None:
    """A healthy pack has 75 % by one that reads 25 % low, and surely less than 80 at 66 only."""
    healthy = by_autopilot(flown("a", 1, "healthy", capacity_ah=1.65))
    (notice,) = section_of(healthy).notices
    assert notice.text.startswith("Less than 80 % of the rated capacity may be left, within")
    assert (
        "healthy (75 %, by one flight alone). Or the current sensor of the vehicle" in notice.text
    )
    assert "the mAh that the charger puts back" in notice.text
    worn = by_autopilot(flown("a", 1, "worn", capacity_ah=1.4))
    (notice,) = section_of(worn).notices
    assert notice.text.startswith("Less than 80 % of the rated capacity is left in: worn (64 %")


def test_a_pack_is_retired_only_if_the_last_two_flights_that_tell_it_agree() -> None:
    flights = (
        flown("a", 1, "x", capacity_ah=2.1),
        flown("b", 2, "x", capacity_ah=1.5),
        flown("c", 3, "x", capacity_ah=1.5),
    )
    assert [n.text for n in section_of(*flights[:2]).notices] == [
        "Less than 80 % of the rated capacity may be left, within the errors, in: "
        "x (68 %, but 95 % by the flight before)."
    ]
    assert [n.text for n in section_of(*flights).notices] == [
        "Less than 80 % of the rated capacity is left in: x (68 %)."
    ]


@pytest.mark.parametrize("code", ["current_scale_doubtful", "colder_than_board"])
def test_a_flight_whose_fit_is_doubtful_in_itself_retires_no_pack(code: str) -> None:
    """Of a sensor that reads 25 % low a healthy pack has 75 % of its capacity."""
    doubtful = flown("a", 1, "x", capacity_ah=1.65)
    warned = WarningPart(code=code, message="doubtful", where="")
    quality = doubtful.result.quality.model_copy(update={"warnings": (warned,)})
    result = doubtful.result.model_copy(update={"quality": quality})
    section = section_of(replace(doubtful, result=result))
    assert column(section, "capacity [Ah]") == column(section, "resistance [mΩ]") == ["–"]
    assert section.notices == ()


def test_a_flight_without_a_date_is_not_taken_for_the_last() -> None:
    section = section_of(
        flown("a", None, "one", capacity_ah=1.6), flown("b", 2, "one", capacity_ah=2.1)
    )
    assert column(section, "last flown") == ["2025-06-02"]
    assert column(section, "capacity [Ah]") == ["2.100 ± 0.060 (2025-06-02)"]
    assert not section.notices


def at(folder: str, day: int, start_c: float | None, *, more: float = 1.0) -> FleetFlight:
    """With that start temperature, None for one that the fit does not tell."""
    fit = example.flight_fit()
    told = {"verdict": Verdict.PRIOR} if start_c is None else {"value": start_c + 273.15}
    estimates = tuple(replace(e, **told) if e.name == "initial_K" else e for e in fit.estimates)
    pulse = replace(fit.pulse, value=more * 0.04)
    return flight(
        folder, day, pack=fitted("x", replace(fit, estimates=estimates, pulse=pulse), 2.05)
    )


def test_a_resistance_is_told_with_its_temperature_beside_that_of_the_first_flight_as_warm() -> (
    None
):
    cold, first, later = at("a", 1, 8.0, more=1.6), at("b", 2, 20.0), at("c", 3, 22.5, more=1.25)
    assert column(section_of(later, first, cold), "resistance [mΩ]") == ["50.0 (22 °C, +25 %)"]
    assert column(section_of(first), "resistance [mΩ]") == ["40.0 (20 °C)"]


def test_a_resistance_is_not_compared_with_that_of_a_colder_or_warmer_pack() -> None:
    assert column(section_of(at("a", 1, 20.0), at("b", 2, 10.0)), "resistance [mΩ]") == [
        "40.0 (10 °C)"
    ]
    assert column(section_of(at("a", 1, None), at("b", 2, None)), "resistance [mΩ]") == ["40.0"]


def test_a_start_temperature_that_was_measured_is_taken_as_it_is() -> None:
    one = at("a", 1, 20.0)
    fit = one.result.pack.fit
    assert fit is not None
    quantities = tuple(q for q in fit.quantities if q.name != "initial_K")
    own = fit.model_copy(update={"quantities": quantities})
    pack = one.result.pack.model_copy(update={"fit": own})
    result = one.result.model_copy(update={"pack": pack})
    assert column(section_of(replace(one, result=result)), "resistance [mΩ]") == ["40.0 (25 °C)"]


def test_what_the_twin_misses_is_that_of_the_last_flight() -> None:
    flights = (
        flight("a", 1, pack=replace(example.pack(), serial="x"), mismatch=finding()),
        flight("b", 2, pack=replace(example.pack(), serial="x"), mismatch=finding(Finds.UNKNOWN)),
    )
    assert column(section_of(*flights), "what the twin misses") == ["not known"]
    assert column(section_of(flights[0]), "what the twin misses") == ["self-heating (98 %)"]


def test_what_no_flight_tells_is_not_told_and_its_pack_comes_last() -> None:
    fit = example.flight_fit()
    untold = tuple(
        replace(e, verdict=Verdict.PRIOR) if e.name == "capacity_C" else e for e in fit.estimates
    )
    badly = tuple(
        replace(e, std=0.2 * 3600) if e.name == "capacity_C" else e for e in fit.estimates
    )
    section = section_of(
        flight("a", 1, pack=fitted("a untold", replace(fit, estimates=untold), 2.2)),
        flight("d", 4, pack=fitted("c told badly", replace(fit, estimates=badly), 1.2)),
        flight("b", None, pack=replace(example.pack(), serial="b by a pack file")),
        flown("c", 3, "told"),
    )
    assert column(section, "pack") == ["told", "a untold", "b by a pack file", "c told badly"]
    assert column(section, "capacity [Ah]")[1:] == ["–"] * 3
    assert column(section, "of rated [%]")[1:] == ["–"] * 3
    assert column(section, "last flown")[2] == "–"
    assert section.notices == ()


def test_lost_lithium_is_the_mean_of_the_flights_that_were_judged() -> None:
    def judged(result: Result, mah: float) -> Result:
        part = AssessmentPart.model_construct(in_flight=LossPart.model_construct(lithium_mah=mah))
        return result.model_copy(update={"assessment": part})

    flights = [flown("a", k, "x") for k in (1, 2, 3)]
    results = [f.result for f in flights]
    each = [judged(results[0], 0.25), judged(results[1], 0.5), results[2]]
    each[2] = each[2].model_copy(update={"assessment": None})
    both = [replace(f, result=r) for f, r in zip(flights, each, strict=True)]
    (pack,) = packs_of(both)
    assert pack.lost_mah == pytest.approx(0.375)
    assert packs_of(both[2:])[0].lost_mah is None


def test_flights_of_a_pack_that_nothing_names_are_counted_and_not_put_together() -> None:
    section = section_of(flown("a", 1, ""), flown("b", 2, ""), flown("c", 3, "x"))
    assert column(section, "pack") == ["x"]
    (notice,) = section.notices
    assert notice.text.startswith("Flights whose pack is not known: 2.")
    assert packs_section([flown("a", 1, "")]).tables == ()
    page = fleet_page(Fleet(flights=(flown("a", 1, ""),), failures=(), passed_over=0, version="0"))
    (flights,) = page.sections
    assert flights.notices[0].text.startswith("Flights whose pack is not known: 1.")


def test_a_copy_of_a_flight_is_no_second_one() -> None:
    one = flown("a", 1, "x")
    assert column(section_of(one, copied(one, "b")), "flights") == ["1"]


def test_what_nobody_rated_is_no_share_of_a_cell_that_stands_in() -> None:
    """2.05 Ah told, 2.2 Ah of the built-in cell before."""
    use = replace(fitted("x", example.flight_fit(), 2.05), rated_C=None)
    section = section_of(flight("a", 1, pack=use))
    assert column(section, "capacity [Ah]") == ["2.050 ± 0.060 (2025-06-01)"]
    assert column(section, "of rated [%]") == ["–"]
    charge_ah = sum(s.charge_ah for s in flight("a", 1, pack=use).result.segments)
    assert column(section, "full cycles") == [f"{charge_ah / 2.05:.1f}"]
