"""A life of cycles: lithium kept, continued to the last bit; health against simulated checks."""

from dataclasses import asdict, replace
from itertools import islice

import numpy as np
import pytest

from twin.ageing import Aged, Regime, age
from twin.builtin import load_cell
from twin.cell import Cell
from twin.constants import FARADAY_C_mol
from twin.effects import AGEING, SelfHeating, chosen
from twin.health import Examiner
from twin.load import Between, Load
from twin.pack import Pack
from twin.protocol import ConstantCurrent, FollowLoad, ProtocolError, Rest, charge_cc_cv, run
from twin.solution import Status

ALL = [e.id for e in AGEING]
T = np.arange(0.0, 120.0, 0.2)
FLIGHT = Load(time_s=T, current_A=20 + 10 * np.sin(T), ambient_K=290.0)


@pytest.fixture(scope="module")
def lipo() -> Cell:
    return load_cell("lipo_2200")


@pytest.fixture(scope="module")
def pack(lipo: Cell) -> Pack:
    heat = SelfHeating(heat_transfer_W_m2_K=12.0)
    return Pack(cell=lipo, initial_soc=0.9, effects=(heat, *chosen(ALL, heat_transfer_W_m2_K=0.0)))


@pytest.fixture(scope="module")
def life(pack: Pack) -> list[Aged]:
    return list(islice(age(pack, Regime(load=FLIGHT)), 6))


def test_the_lithium_of_a_life_is_what_there_was_at_its_start(life: list[Aged]) -> None:
    for aged in life:
        assert abs(aged.cycle.health.lithium_error) < 1e-12
        assert abs(aged.cycle.health.charge_error_C) < 1e-8


def test_what_is_lost_from_the_particles_is_found_by_mechanism(
    pack: Pack, life: list[Aged]
) -> None:
    new = run(pack, (Rest(duration_s=1.0),)).audit
    held_C = FARADAY_C_mol * float(new.negative_mol[0] + new.positive_mol[0])
    salt_C = FARADAY_C_mol * float(new.electrolyte_mol[0])
    first, last = life[0].cycle.health, life[-1].cycle.health
    for h in (first, last):
        found_C = sum(asdict(h.lost).values()) + h.salt_change * salt_C
        assert found_C == pytest.approx(h.lithium_loss * held_C, rel=1e-9)
    for name in ("sei_C", "sei_on_cracks_C", "dead_C", "trapped_C"):
        assert getattr(last.lost, name) > getattr(first.lost, name) > 0


def test_anions_take_part_in_nothing(life: list[Aged]) -> None:
    assert all(abs(a.cycle.health.salt_change) < 1e-9 for a in life)


def test_a_life_begins_with_a_charge_and_every_flight_begins_full(life: list[Aged]) -> None:
    zeroth, *cycles = (a.cycle for a in life)
    assert (zeroth.number, zeroth.drawn_C, zeroth.flown_s) == (0, 0.0, 0.0)
    assert zeroth.charged_C == pytest.approx(0.1 * 7920.0, rel=0.05)
    assert [c.number for c in cycles] == [1, 2, 3, 4, 5]
    for c in cycles:
        assert c.drawn_C == pytest.approx(FLIGHT.charge_C(), rel=1e-12)
        assert c.charged_C == pytest.approx(c.drawn_C, rel=5e-3)
        assert c.min_V <= c.end_V
        assert c.max_K > FLIGHT.ambient_K


@pytest.mark.parametrize(
    ("change", "charge", "time"),
    [
        ({"full_V": 4.1}, (0.7, 0.85), (0.7, 0.9)),
        ({"until_rate": 0.2}, (0.98, 0.995), (0.9, 0.95)),
        ({"charge_rate": 0.5}, (0.999, 1.001), (1.7, 2.0)),  # twice, but for the constant voltage
    ],
)
def test_how_far_how_long_and_how_fast_it_is_charged_is_what_the_regime_says(
    pack: Pack, change: dict[str, float], charge: tuple[float, float], time: tuple[float, float]
) -> None:
    """The first charge, from half, over that at 1C to the cut-off until C/20."""
    half = replace(pack, initial_soc=0.5)
    usual, own = (
        next(age(half, Regime(load=FLIGHT, rest_s=0.0, **how))).cycle for how in ({}, change)
    )
    assert own.status is Status.DONE
    assert charge[0] < own.charged_C / usual.charged_C < charge[1]
    assert time[0] < own.time_s / usual.time_s < time[1]


def test_a_life_is_continued_to_the_last_bit(pack: Pack, life: list[Aged]) -> None:
    again = list(islice(age(pack, Regime(load=FLIGHT), after=life[3]), 2))
    for got, expected in zip(again, life[4:], strict=True):
        assert got.cycle == expected.cycle
        np.testing.assert_array_equal(got.state, expected.state)


def test_a_flight_that_asks_for_too_much_ends_the_life(pack: Pack) -> None:
    long = Load(time_s=np.arange(0.0, 600.0), current_A=np.full(600, 22.0), ambient_K=290.0)
    *before, last = age(pack, Regime(load=long))  # 3.7 Ah from 2.2 Ah
    assert [a.cycle.status for a in before] == [Status.DONE]
    assert (last.cycle.status, last.cycle.stopped_in) == (Status.LOWER_CUT_OFF, "flight")
    assert 0 < last.cycle.drawn_C < long.charge_C()
    assert last.cycle.charged_C == 0.0
    assert abs(last.cycle.health.charge_error_C) < 1e-8
    assert not list(age(pack, Regime(load=long), after=last))


def test_a_flight_that_fails_at_once_ends_the_life(pack: Pack) -> None:
    _, last = age(pack, Regime(load=replace(FLIGHT, current_A=np.full(T.size, 5000.0))))
    assert (last.cycle.stopped_in, last.cycle.drawn_C) == ("flight", pytest.approx(0.0, abs=50.0))
    assert np.isnan([last.cycle.end_V, last.cycle.min_V, last.cycle.max_K]).all()


def test_a_repeated_load_empties_the_pack_in_every_cycle(pack: Pack) -> None:
    _, first, second = (
        a.cycle for a in islice(age(pack, Regime(load=FLIGHT, repeat=True, rest_s=0.0)), 3)
    )
    assert first.flown_s > 2 * FLIGHT.time_s[-1]
    assert first.drawn_C == pytest.approx(7920.0, rel=0.1)
    assert first.end_V == pytest.approx(pack.cell.lower_cut_off_V, abs=0.2)
    assert second.status is Status.DONE
    assert second.drawn_C < first.drawn_C


def test_a_pack_that_does_not_age_stays_as_it_is(lipo: Cell) -> None:
    zeroth, *_, last = (
        a.cycle.health for a in islice(age(Pack(cell=lipo), Regime(load=FLIGHT)), 4)
    )
    assert last.capacity_C == pytest.approx(zeroth.capacity_C, rel=1e-9)
    assert last.lithium_loss == pytest.approx(0.0, abs=1e-9)
    assert sum(asdict(last.lost).values()) == last.negative_loss == last.positive_loss == 0.0


def test_a_pack_of_many_cells_ages_as_one_of_them(lipo: Cell) -> None:
    effects = chosen(["sei", "plating"], heat_transfer_W_m2_K=0.0)
    one = Pack(cell=lipo, effects=effects)
    many = Pack(cell=lipo, effects=effects, series=4, parallel=3, capacity_C=3 * 7920.0)
    loads = (FLIGHT, replace(FLIGHT, current_A=3 * FLIGHT.current_A))
    a, b = (
        list(islice(age(p, Regime(load=load)), 2))[1].cycle
        for p, load in zip((one, many), loads, strict=True)
    )
    assert b.health.capacity_C == pytest.approx(3 * a.health.capacity_C, rel=1e-6)
    assert b.health.lithium_loss == pytest.approx(a.health.lithium_loss, rel=1e-3)
    assert b.health.lost.sei_C == pytest.approx(3 * a.health.lost.sei_C, rel=1e-4)
    assert b.health.resistance_ohm == pytest.approx(4 / 3 * a.health.resistance_ohm, rel=1e-5)
    assert b.energy_J == pytest.approx(12 * a.energy_J, rel=1e-6)


def resting(pack: Pack) -> Pack:
    """The same cell with all ageing held still; the state is laid out as before."""
    return replace(pack, effects=tuple(e(strength=0.0) for e in AGEING))


def worn(pack: Pack, aged: Aged) -> np.ndarray:
    """A state with losses large enough to be told from rounding, of lithium and of material."""
    layout, state = Examiner(pack)._model.layout, aged.state.copy()
    state[layout.slice_of("modes_n")] *= 0.9
    for name, left in (("left_n", 0.95), ("left_p", 0.85)):
        state[layout.slice_of(name)] = left
    return state


def test_the_capacity_is_that_of_a_slow_discharge_of_the_worn_cell(
    pack: Pack, life: list[Aged]
) -> None:
    still, state = resting(pack), worn(pack, life[-1])
    expected_C = Examiner(still).examine(state, 0.0).capacity_C
    charged = run(still, charge_cc_cv(still, rate=0.05, until_rate=0.001), state=state).require()
    whole = ConstantCurrent(current_A=2.2 / 100, until_V=still.cell.lower_cut_off_V)
    drawn_C = run(still, (whole,), state=charged.end_state).require().steps[0].charge_C
    assert drawn_C < 0.9 * 7920.0
    # C/100 leaves a millivolt; at the steep ends that is a thousandth of the charge
    assert drawn_C == pytest.approx(expected_C, rel=3e-3)


def test_a_new_cell_has_the_charge_of_its_stoichiometry_window(lipo: Cell) -> None:
    pack = Pack(cell=lipo)
    got = Examiner(pack).examine(Examiner(pack).new, 0.0).capacity_C
    n, held = lipo.negative, FARADAY_C_mol * lipo.negative.max_concentration_mol_m3
    solid_m3 = n.specific_area_m2_m3 * n.particle_radius_m / 3 * n.thickness_m * lipo.area_m2
    window = n.stoichiometry_max - n.stoichiometry_min
    # its cut-offs are a few millivolts off the ends of the window, as the file has them
    assert got == pytest.approx(held * solid_m3 * window, rel=5e-3)


def test_the_resistance_is_that_of_a_pulse_with_steps_of_chosen_length(pack: Pack) -> None:
    still = replace(resting(pack), initial_soc=0.5)
    examiner = Examiner(still)
    got = examiner.examine(examiner.new, 0.0)
    steps = (Rest(duration_s=1.0), ConstantCurrent(current_A=2.2, duration_s=10.0))
    rest, pulse = run(still, steps).require().steps
    drop_V = rest.voltage_V[-1] - pulse.voltage_V[[0, -1]]
    expected = drop_V / 2.2
    # half of the window is not half of the capacity to the last per mille
    assert [got.resistance_ohm, got.resistance_10s_ohm] == pytest.approx(expected, rel=5e-3)


def test_health_is_not_what_the_pack_has_just_done(pack: Pack) -> None:
    still = replace(resting(pack), initial_soc=1.0)
    examiner = Examiner(still)
    flown = run(still, (FollowLoad(load=FLIGHT),)).require()
    before = examiner.examine(examiner.new, 0.0)
    after = examiner.examine(flown.end_state, FLIGHT.charge_C())
    for name in ("capacity_C", "resistance_ohm", "resistance_10s_ohm"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), rel=1e-7), name


def test_resistance_grows_as_films_do(life: list[Aged]) -> None:
    grown = np.diff([a.cycle.health.resistance_ohm for a in life])
    assert np.all(grown > 0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rest_s": -1.0}, "rest_s = -1"),
        ({"charge_rate": 0.01}, "until_rate = 0.05, charge_rate = 0.01"),
        ({"until_rate": 0.0}, "until_rate = 0.0"),
        ({"load": replace(FLIGHT, current_A=-FLIGHT.current_A)}, "discharges the pack"),
    ],
)
def test_an_impossible_regime_is_refused(changes: dict, said: str) -> None:
    with pytest.raises(ProtocolError, match=said):
        Regime(**({"load": FLIGHT} | changes))


@pytest.mark.parametrize("between", Between)
def test_a_refined_load_is_the_same_load(between: Between) -> None:
    load = Load(
        time_s=np.array([-3.0, 0.0, 0.5, 7.2]),
        current_A=np.array([1.0, 4.0, -2.0, 8.0]),
        between=between,
    )
    fine = load.refined(1.0)
    assert np.diff(fine.time_s).max() <= 1.0
    assert np.isin(load.time_s, fine.time_s).all()
    assert fine.charge_C() == pytest.approx(load.charge_C(), rel=1e-14)
    where = np.searchsorted(fine.time_s, load.time_s)
    np.testing.assert_array_equal(fine.current_A[where], load.current_A)
    np.testing.assert_allclose(fine.drawn_C()[where], load.drawn_C(), rtol=1e-13)
    assert load.drawn_C()[-1] == pytest.approx(load.charge_C(), rel=1e-14)
