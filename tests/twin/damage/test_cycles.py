"""Damage per flight: it adds up, accounts for the capacity, and settles with the cycles."""

from dataclasses import replace

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.constants import FARADAY_C_mol
from twin.damage import (
    MEASURES,
    CannotCycle,
    Cycled,
    Loss,
    Manoeuvre,
    Part,
    Protocol,
    Waveform,
    WaveformError,
    ageing,
    ageing_drawn,
    assess,
    constant,
    cycle,
    number,
)
from twin.damage.loss import Ledger
from twin.damage.study import CYCLES
from twin.effects import (
    AGEING,
    ActiveMaterialLoss,
    AnyEffect,
    ColdPack,
    CurrentGain,
    CurrentOffset,
    FilmResistance,
    InitialSoc,
    Sei,
    SelfHeating,
    VoltageGain,
    WeakCell,
)
from twin.load import Load
from twin.pack import Pack
from twin.protocol import ConstantCurrent, Rest, charge_cc_cv, run
from twin.simulate import simulate

SAMPLE_S = 0.5
T = np.arange(0.0, 30.0, SAMPLE_S)
CLIMBS = Waveform(
    current_A=17 + 8 * np.sign(np.sin(2 * np.pi * T / 15)) + 0.8 * np.sin(5 * T), sample_s=SAMPLE_S
)
SHORT = Protocol(cycles=2)


@pytest.fixture(scope="module")
def pack() -> Pack:
    return Pack(cell=load_cell("lipo_2200"), series=4)


@pytest.fixture(scope="module")
def climbs(pack: Pack) -> Cycled:
    return cycle(ageing(pack), CLIMBS, SHORT)


@pytest.mark.parametrize("part", ["whole", "in_flight"])
def test_what_the_particles_lost_is_found_where_it_went(climbs: Cycled, part: str) -> None:
    loss: Loss = getattr(climbs, part)
    assert loss.reactions_C == loss.sei_C + loss.sei_on_cracks_C + loss.dead_C
    assert loss.inventory_C + loss.plated_C == pytest.approx(loss.lithium_C, abs=1e-7)
    assert loss.inventory_C > 100 * 1e-7


@pytest.mark.parametrize(("faster", "least"), [(20.0, 0.004), (300.0, 0.04)])
def test_lithium_and_material_account_for_the_capacity_of_a_slow_discharge(
    faster: float, least: float
) -> None:
    """A pack that ages 20 or 300 times faster, in three flights; C/100 before and after."""
    quick = (
        Sei(solvent_diffusivity_m2_s=faster * 2.5e-22),
        ActiveMaterialLoss(rate_1_s=faster * 2.7778e-7),
        SelfHeating(),
    )
    pack = ageing(Pack(cell=load_cell("lipo_2200"), effects=quick))
    one, four = (cycle(pack, constant(15.0, 1.0), Protocol(cycles=n)) for n in (1, 4))
    measured_C = slow_C(pack, one.end_state) - slow_C(pack, four.end_state)
    assert 4 * four.capacity_C - one.capacity_C == pytest.approx(measured_C, rel=0.002)
    assert measured_C > least * 7920


def slow_C(pack: Pack, state: np.ndarray) -> float:
    """Between the cut-offs, while nothing ages.

    After a rest: just charged, the cell is above the voltage it would be charged to, the current of
    that voltage flows out of it at first, and a charge ends where the current does: 8 C too soon.
    """
    still = tuple(replace(e, strength=0.0) for e in pack.effects if isinstance(e, AGEING))
    asleep = replace(pack, effects=still)
    full = Rest(duration_s=3600.0), *charge_cc_cv(asleep, rate=0.05, until_rate=0.001)
    down = ConstantCurrent(current_A=2.2 / 100, until_V=asleep.cell.lower_cut_off_V)
    return run(asleep, (*full, down), state=state).require().steps[-1].charge_C


def test_a_constant_current_given_as_a_motion_equals_its_baseline(pack: Pack) -> None:
    """Between the baselines, sampled as a log is: interpolation and steps together."""
    steady = Waveform(current_A=np.full(40, 16.55), sample_s=SAMPLE_S)
    found = assess(pack, (Manoeuvre(name="steady", waveform=steady),), SHORT)
    own = found.motions["steady"]
    for part in Part:
        for name, ratio in own.excess[part].items():
            if part is Part.WHOLE or np.isfinite(ratio.value):
                assert ratio.value == pytest.approx(1.0, abs=0.005), (part, name)
    assert own.energy == pytest.approx(1.0, abs=1e-3)


def test_twice_the_cycles_change_the_normalised_numbers_by_a_thousandth_at_most(
    pack: Pack,
) -> None:
    motion = (Manoeuvre(name="climbs", waveform=CLIMBS),)
    few, many = (assess(pack, motion, Protocol(cycles=n)) for n in (CYCLES, 2 * CYCLES))
    for part in Part:
        for name, ratio in few.motions["climbs"].normalised[part].items():
            again = many.motions["climbs"].normalised[part][name].value
            assert again == pytest.approx(ratio.value, rel=0.001, nan_ok=True), (part, name)
    for c, d in zip(few.baselines.cycled, many.baselines.cycled, strict=True):
        for name in MEASURES:
            of = number(name, Part.WHOLE)
            share = [of(x) / of(a.baselines.reference) for x, a in ((c, few), (d, many))]
            assert share[1] == pytest.approx(share[0], rel=0.001)


def test_damage_is_told_of_flight_and_charge(climbs: Cycled) -> None:
    assert 0 < climbs.in_flight.inventory_C < climbs.whole.inventory_C
    assert climbs.in_flight.plated_C < 0  # it strips on the way
    assert climbs.drawn_C == pytest.approx(climbs.flown_s * CLIMBS.mean_A, rel=0.01)
    assert climbs.flight.max_K > 305
    assert climbs.charge.anode_V < climbs.flight.anode_V
    assert climbs.flight.negative_stress_Pa[1] > climbs.charge.negative_stress_Pa[1] > 0
    assert climbs.charge.positive_stress_Pa[1] > climbs.flight.positive_stress_Pa[1]


def test_the_ledger_begins_at_nothing_and_knows_the_lithium_there_is(pack: Pack) -> None:
    ledger = Ledger(ageing(pack))
    new = run(ageing(pack), (Rest(duration_s=1.0),)).audit
    held_C = FARADAY_C_mol * float(new.negative_mol[0] + new.positive_mol[0])
    assert ledger.loss(ledger.new).lithium_C == 0.0
    assert ledger.cyclable_C == pytest.approx(held_C, rel=1e-12)


def test_unlike_cells_lose_what_their_mean_does(pack: Pack) -> None:
    weak = replace(ageing(pack), series=2)
    weak = replace(weak, effects=(*weak.effects, WeakCell(cell=1, capacity_factor=0.9)))
    both = cycle(weak, CLIMBS, Protocol(cycles=1))
    assert both.whole.inventory_C + both.whole.plated_C == pytest.approx(
        both.whole.lithium_C, abs=1e-7
    )


def test_how_a_recording_started_and_was_measured_is_nothing_to_a_cycle(pack: Pack) -> None:
    once, more = Protocol(cycles=1), (
        InitialSoc(offset=-0.2), ColdPack(start_offset_K=-15.0), VoltageGain(gain=1.1),
    )  # fmt: skip
    plain = cycle(ageing(pack), CLIMBS, once)
    own = ageing(replace(pack, initial_soc=0.8))
    stated = cycle(replace(own, effects=(*own.effects, *more)), CLIMBS, once)
    assert (stated.drawn_C, stated.energy_J) == pytest.approx((plain.drawn_C, plain.energy_J))
    assert stated.whole.inventory_C == pytest.approx(plain.whole.inventory_C)


def test_a_load_beyond_the_pack_is_said_to_be_so(pack: Pack) -> None:
    with pytest.raises(CannotCycle, match="flies this for"):
        cycle(ageing(pack), Waveform(current_A=np.full(600, 700.0), sample_s=SAMPLE_S), SHORT)


@pytest.mark.parametrize("sensor", [CurrentGain(gain=0.5), CurrentOffset(offset_A=-8.0)])
def test_a_pack_is_flown_empty_by_what_flows_not_by_what_was_recorded(
    pack: Pack, sensor: AnyEffect
) -> None:
    aged = ageing(pack)
    recorded = constant(16.0, 1.0)
    flown = cycle(replace(aged, effects=(*aged.effects, sensor)), recorded, Protocol(cycles=1))
    assert flown.drawn_C == pytest.approx(pack.rated_C, rel=0.1)
    assert flown.drawn_C / flown.flown_s == pytest.approx(8.0, rel=0.001)


@pytest.mark.parametrize("sensor", [(), (CurrentOffset(offset_A=-20.0),)])
def test_a_current_that_empties_no_pack_is_refused_before_it_is_flown(
    pack: Pack, sensor: tuple[AnyEffect, ...]
) -> None:
    """Of a pin that is not wired: 8 mA, 2.3e7 samples to the cut-off."""
    weak = replace(pack, effects=sensor)
    with pytest.raises(CannotCycle, match="not drawn in a day"):
        cycle(ageing(weak), constant(0.008, 0.1), SHORT)


def test_the_first_film_resists_in_what_was_fitted_without_one(pack: Pack) -> None:
    """SEI that is added resists by what grows; SEI that was stated with the cell, wholly."""
    load = Load(time_s=np.array([0.0, 0.1]), current_A=np.full(2, 20.0))

    def sag_V(own: Pack) -> float:
        return float(simulate(own, load).voltage_V[0])

    stated = replace(pack, effects=(Sei(),))
    assert sag_V(ageing(pack)) == pytest.approx(sag_V(pack), abs=1e-3)
    assert sag_V(ageing(stated)) == pytest.approx(sag_V(stated), abs=1e-3)
    assert sag_V(pack) - sag_V(stated) > 0.015  # about 1.1 mOhm of four cells


def test_packs_that_may_be_it_as_well_have_a_first_film_of_their_own(pack: Pack) -> None:
    def draw(own: Pack) -> tuple[Pack, ...]:
        return tuple(
            replace(own, effects=tuple(Sei(resistivity_ohm_m=r) if isinstance(e, Sei) else e
                                       for e in own.effects))
            for r in (1e5, 4e5)
        )  # fmt: skip

    for one in ageing_drawn(pack, draw):
        (film,) = (e for e in one.effects if isinstance(e, FilmResistance))
        (sei,) = (e for e in one.effects if isinstance(e, Sei))
        assert film.negative_ohm_m2 == pytest.approx(-sei.resistivity_ohm_m * 5e-9)
    stated = replace(pack, effects=(Sei(),))
    for one in ageing_drawn(stated, draw):
        assert not any(isinstance(e, FilmResistance) for e in one.effects)


@pytest.mark.parametrize(
    ("current_A", "said"), [(np.zeros(9), "discharges"), (np.full(3, np.nan), "finite")]
)
def test_a_waveform_that_cannot_be_repeated_is_refused(current_A: np.ndarray, said: str) -> None:
    with pytest.raises(WaveformError, match=said):
        Waveform(current_A=current_A, sample_s=0.1)
