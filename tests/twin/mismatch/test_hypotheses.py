"""Effects as hypotheses: absent they change nothing, present they do what they say."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.mismatch.recordings import flown, pack
from twin.at_rest import open_circuit_V
from twin.effects import (
    ActivationEnergies,
    ActiveMaterialLossNegative,
    ActiveMaterialLossPositive,
    AnyEffect,
    ClockShift,
    ColdPack,
    CurrentGain,
    CurrentOffset,
    ElectrolyteTransport,
    InitialSoc,
    Leakage,
    LithiumInventoryLoss,
    Plating,
    ReactionKinetics,
    SelfHeating,
    SensorLag,
    SolidDiffusionPositive,
    VoltageGain,
    WeakCell,
)
from twin.effects.clock_shift import _as_rough, _between
from twin.effects.sensor_lag import slope_matrix
from twin.load import Between, Load
from twin.mismatch.hypothesis import APART_K, HYPOTHESES, UNCERTAIN, Hypothesis
from twin.mismatch.problem import Problem
from twin.mismatch.split import split
from twin.simulate import changeable, simulate
from twin.windows import Windows

CONTRACT = """self_heating cold_pack electrolyte_transport solid_diffusion_negative
solid_diffusion_positive reaction_kinetics ocv_hysteresis plating_stripping lithium_inventory_loss
active_material_loss_negative active_material_loss_positive film_resistance series_resistance
weak_cell initial_soc leakage current_gain current_offset sensor_lag clock_shift voltage_gain"""
SWITCHED = ("self_heating", "ocv_hysteresis", "plating_stripping")  # act with the numbers they have


def gusty(seconds: float = 30.0) -> Load:
    random = np.random.default_rng(1)
    t = np.arange(0.0, seconds, 0.1)
    return Load(time_s=t, current_A=16.0 + 4.0 * random.standard_normal(t.size))


def test_every_effect_of_the_contract_is_a_hypothesis() -> None:
    assert {h.id for h in HYPOTHESES} == set(CONTRACT.split())


@pytest.mark.parametrize("h", [h for h in UNCERTAIN if h.id not in SWITCHED], ids=lambda h: h.id)
def test_at_the_centre_of_its_prior_an_effect_is_absent(h: Hypothesis) -> None:
    configured, load = pack(), gusty(5.0)
    changed = h.within(configured, [p.value for p in h.priors(configured)])
    before, after = (simulate(p, load).voltage_V for p in (configured, changed))
    assert after == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize("h", HYPOTHESES, ids=lambda h: h.id)
def test_starts_and_centres_are_within_bounds(h: Hypothesis) -> None:
    configured = replace(pack(), initial_soc=0.9)
    limits = h.bounds(configured)
    for point in ([p.value for p in h.priors(configured)], *h.begins(configured)):
        assert all(low <= value <= high for value, (low, high) in zip(point, limits, strict=True))


def test_self_heating_is_expected_to_cool_as_the_pack_states() -> None:
    h = next(h for h in HYPOTHESES if h.id == "self_heating")
    (usual,), (stated,) = (
        h.priors(p) for p in (pack(), replace(pack(), heat_transfer_W_m2_K=30.0))
    )
    assert (usual.value, stated.value) == (12.0, 30.0)
    assert stated.prior_std < 0.3 * usual.prior_std
    assert h.begins(replace(pack(), heat_transfer_W_m2_K=30.0)) == ((30.0,),)
    known = replace(pack(), heat_transfer_W_m2_K=30.0, heat_transfer_std_W_m2_K=15.0)
    assert h.priors(known)[0].prior_std == 0.5
    hardly = replace(known, heat_transfer_std_W_m2_K=300.0)
    assert h.priors(hardly)[0].prior_std == usual.prior_std
    sure = replace(known, heat_transfer_std_W_m2_K=0.1)
    assert h.priors(sure)[0].prior_std == stated.prior_std


def test_heating_is_likely_beforehand_where_a_pack_states_how_it_cools_and_does_not_heat() -> None:
    h = next(h for h in HYPOTHESES if h.id == "self_heating")
    stated = replace(pack(), heat_transfer_W_m2_K=30.0)
    heated = replace(stated, effects=(SelfHeating(heat_transfer_W_m2_K=30.0),))
    assert h.before(stated) > 10 * h.before(pack())
    assert h.before(heated) == h.before(pack())
    others = [other for other in HYPOTHESES if other is not h]
    assert {other.before(stated) for other in others} == {h.before(pack())}


@pytest.mark.parametrize("name", ["lithium_inventory_loss", "active_material_loss_negative"])
def test_ageing_only_loses(name: str) -> None:
    h = next(h for h in HYPOTHESES if h.id == name)
    ((least, _),) = h.bounds(pack())
    assert least == 0.0
    assert len(h.begins(pack())) > 1
    assert all(value >= 0.0 for (value,) in h.begins(pack()))


def test_a_weak_cell_is_not_the_only_strong_one_unless_the_pack_says_so() -> None:
    h = next(h for h in HYPOTHESES if h.id == "weak_cell")
    capacity, _, ohm = h.bounds(pack())
    assert (capacity, ohm) == ((0.1, 1.05), (0.0, 0.5))
    strong = WeakCell(cell=2, capacity_factor=1.2, resistance_ohm=-1e-3)
    capacity, _, ohm = h.bounds(replace(pack(), effects=(strong,)))
    assert (capacity, ohm) == ((0.1, 1.2), (-1e-3, 0.5))


def test_an_effect_that_a_pack_has_is_changed_not_added() -> None:
    h = next(h for h in HYPOTHESES if h.id == "current_gain")
    twice = h.within(h.within(pack(), [1.1]), [1.2])
    assert twice.effects == (CurrentGain(gain=1.2),)


@pytest.mark.parametrize(
    ("effect", "name", "factor"),
    [
        (ElectrolyteTransport(diffusivity_factor=0.5), "electrolyte.diffusivity_factor", 0.5),
        (ElectrolyteTransport(conductivity_factor=0.5), "electrolyte.conductivity_factor", 0.5),
        (SolidDiffusionPositive(diffusivity_factor=0.2), "positive.diffusivity_factor", 0.2),
        (ReactionKinetics(negative_factor=3.0), "negative.rate_constant_mol_m2_s", 3.0),
        (ActiveMaterialLossNegative(lost=0.1), "negative.specific_area_m2_m3", 0.9),
    ],
)
def test_an_effect_of_the_cell_changes_its_number(
    effect: AnyEffect, name: str, factor: float
) -> None:
    before = pack().numbers()
    after = replace(pack(), effects=(effect,)).numbers()
    assert after[name] == pytest.approx(factor * before[name])


@pytest.mark.parametrize("kelvin", [298.15, 273.15])
def test_more_activation_energy_is_a_slower_rate_in_the_cold_alone(kelvin: float) -> None:
    more_J_mol = 12e3
    factor = float(np.exp(more_J_mol / 8.314462618 * (1 / 298.15 - 1 / kelvin)))
    cold = replace(pack(), initial_K=kelvin)
    energies = ActivationEnergies(negative_rate_J_mol=more_J_mol)
    same = ReactionKinetics(negative_factor=factor)
    assert cold.cell.reference_K == 298.15
    one, other, before = (
        simulate(replace(cold, effects=own), gusty(5.0)).voltage_V
        for own in ((energies,), (same,), ())
    )
    assert one == pytest.approx(other, abs=1e-7)
    assert (np.abs(one - before).max() > 1e-3) == (kelvin < 298.15)


def test_a_cell_that_lost_lithium_is_full_and_empty_at_the_same_voltages() -> None:
    configured = pack()
    numbers = replace(configured, effects=(LithiumInventoryLoss(lost=0.1),)).numbers()
    before, after = (Windows.of(n, configured.cell) for n in (configured.numbers(), numbers))
    assert after.ends_V == pytest.approx(before.ends_V, abs=1e-9)
    for own in (after.full, after.empty):
        held = own[0] * before.holds[0] + own[1] * before.holds[1]
        whole = before.full[0] * before.holds[0] + before.full[1] * before.holds[1]
        assert held == pytest.approx(0.9 * whole, rel=1e-9)


def test_a_cell_that_lost_material_is_full_as_before_and_empty_at_the_same_voltage() -> None:
    configured = pack()
    numbers = replace(configured, effects=(ActiveMaterialLossNegative(lost=0.1),)).numbers()
    before, after = (Windows.of(n, configured.cell) for n in (configured.numbers(), numbers))
    assert after.full == pytest.approx(before.full)
    assert after.ends_V == pytest.approx(before.ends_V, abs=1e-9)
    assert after.holds[0] == pytest.approx(0.9 * before.holds[0])


def test_a_cell_that_lost_much_positive_material_is_empty_where_that_is_full() -> None:
    configured = pack()
    numbers = replace(configured, effects=(ActiveMaterialLossPositive(lost=0.5),)).numbers()
    before, after = (Windows.of(n, configured.cell) for n in (configured.numbers(), numbers))
    assert after.full == pytest.approx(before.full)
    assert after.empty[1] == pytest.approx(1.0, abs=1e-6)
    assert after.ends_V[1] > before.ends_V[1] + 0.1


def test_no_cell_has_more_lithium_than_it_can_hold() -> None:
    with pytest.raises(ValueError, match="of its lithium rests at"):
        Windows.of(pack().numbers(), pack().cell).with_lithium(3.0)


def test_where_a_recording_starts() -> None:
    configured, load = replace(pack(), initial_soc=0.8), gusty(1.0)
    rest = replace(load, current_A=np.zeros(load.time_s.size))
    colder = replace(configured, effects=(ColdPack(start_offset_K=-10, ambient_offset_K=-5),))
    assert simulate(colder, load).temperature_K[0] == pytest.approx(288.15)
    assert changeable(colder, load)["ambient_K"] == pytest.approx(293.15)
    emptier = replace(configured, effects=(InitialSoc(offset=-0.1),))
    expected_V = 4 * open_circuit_V(configured.cell, 0.7)
    assert simulate(emptier, rest).voltage_V[0] == pytest.approx(expected_V, abs=1e-6)


def test_instruments() -> None:
    """Each against the load or voltage it stands for."""
    load = gusty()
    t, i = load.time_s, load.current_A
    for effect, current_A in (
        (CurrentGain(gain=1.1), 1.1 * i),
        (CurrentOffset(offset_A=-2.0), i - 2.0),
        (Leakage(current_A=0.5), i + 0.5),
    ):
        faulty = simulate(replace(pack(), effects=(effect,)), load)
        true = simulate(pack(), replace(load, current_A=current_A))
        assert faulty.voltage_V == pytest.approx(true.voltage_V, abs=1e-9)
        assert faulty.current_A == pytest.approx(i)  # what was recorded stays what was recorded
    shifted = ClockShift(shift_s=0.3).flowed_A(t, i)
    assert shifted[:-3] == pytest.approx(i[3:])
    doubled = simulate(replace(pack(), effects=(VoltageGain(gain=1.01),)), load)
    assert doubled.voltage_V == pytest.approx(1.01 * simulate(pack(), load).voltage_V)


def gusts(n: int, random: np.random.Generator) -> npt.NDArray[np.float64]:
    """A current in which gusts of a second come and go, at 10 Hz."""
    return 17.0 + np.convolve(random.normal(0.0, 0.3, n), np.ones(10), mode="same")


@pytest.mark.parametrize("shift_s", [-0.27, 0.05, 0.23, 2.55])
def test_a_clock_that_is_off_by_parts_of_a_sample_is_undone(shift_s: float) -> None:
    """Of a current that is straight between its own samples; straight lines smooth it twice."""
    random, n = np.random.default_rng(0), 3000
    t, true_A = 0.1 * np.arange(n, dtype=float), gusts(n, random)
    recorded_A = np.interp(t - shift_s, t, true_A) + random.normal(0.0, 0.03, n)
    inside = slice(30, -30)
    undone_A = ClockShift(shift_s=shift_s).flowed_A(t, recorded_A)[inside]
    straight_A = np.interp(t + shift_s, t, recorded_A)[inside]
    left_A, twice_A = (np.std(x - true_A[inside]) for x in (undone_A, straight_A))
    assert left_A < 0.8 * twice_A


@pytest.mark.parametrize("shift_s", [0.1, 0.2, 0.3])
def test_a_clock_that_is_off_is_undone_where_the_logger_is_too_slow_for_gusts(
    shift_s: float,
) -> None:
    """Random walks at 10 Hz, logged at 2 Hz: straight lines are best. Taken for straight between
    samples of their own they were off by 24 to 59 % more, by 20 % at most now."""
    t, true_A = 0.1 * np.arange(6000.0), gusts(6000, np.random.default_rng(0))
    seen = slice(0, None, 5)
    recorded_A, inside = np.interp(t - shift_s, t, true_A)[seen], slice(10, -10)

    def left_A(current_A: npt.NDArray[np.float64]) -> float:
        return float(np.std((current_A - true_A[seen])[inside]))

    undone_A = ClockShift(shift_s=shift_s).flowed_A(t[seen], recorded_A)
    assert left_A(undone_A) < 1.22 * left_A(np.interp(t[seen] + shift_s, t[seen], recorded_A))


def test_noise_of_a_sensor_does_not_tell_by_what_part_of_a_sample_a_clock_is_off() -> None:
    """Half a sample, 0.5 A: taken for 0.1 A, undoing straight lines made it more by half."""
    random, n = np.random.default_rng(0), 3000
    t, true_A = 0.1 * np.arange(n, dtype=float), gusts(n, random)
    recorded_A = np.interp(t - 0.35, t, true_A) + random.normal(0.0, 0.5, n)
    inside = slice(30, -30)

    def left_A(shift_s: float) -> float:
        undone_A = ClockShift(shift_s=shift_s, noise_A=0.5).flowed_A(t, recorded_A)
        return float(np.std((undone_A - true_A)[inside]))

    assert left_A(0.35) < 0.55
    assert left_A(0.35) < min(left_A(0.25), left_A(0.3), left_A(0.4), left_A(0.45))


def test_a_clock_that_is_right_leaves_a_recording_as_it_is() -> None:
    """And one that is hardly off leaves it nearly so, at the ends as well."""
    load = gusty()
    t, i = load.time_s, load.current_A
    assert ClockShift().flowed_A(t, i) == pytest.approx(i, abs=1e-12)
    assert ClockShift(shift_s=1e-6).flowed_A(t, i) == pytest.approx(i, abs=1e-3)


@pytest.mark.parametrize("n", [1, 2, 3, 20])
def test_a_clock_that_is_off_by_more_than_a_load_lasts(n: int) -> None:
    t, i = 0.1 * np.arange(n, dtype=float), np.linspace(1.0, 2.0, n)
    assert ClockShift(shift_s=3.0).flowed_A(t, i) == pytest.approx(np.full(n, i[-1]))
    assert ClockShift(shift_s=-3.0).flowed_A(t, i) == pytest.approx(np.full(n, i[0]))
    assert np.all(np.isfinite(ClockShift(shift_s=0.05).flowed_A(t, i)))


def test_a_lagging_sensor_is_undone() -> None:
    """Of a current whose lagged form is known exactly: a sine."""
    t = np.arange(0.0, 20.0, 0.1)
    lag_s, omega = 0.4, 1.0
    true = 20.0 * np.sin(omega * t)
    size, late = 20.0 / np.hypot(1, omega * lag_s), np.arctan(omega * lag_s)
    recorded = size * np.sin(omega * t - late)
    undone = SensorLag(lag_s=lag_s).flowed_A(t, recorded)
    assert undone[5:-5] == pytest.approx(true[5:-5], abs=0.02)


def test_slope_is_exact_for_a_parabola_at_uneven_times() -> None:
    t = np.cumsum(np.random.default_rng(0).uniform(0.05, 0.2, 50))
    for degree in (2, 4):
        assert slope_matrix(t, degree) @ (1 + 2 * t - 3 * t**2) == pytest.approx(2 - 6 * t)


@pytest.mark.parametrize("pause_s", [10.0, 61.0, 600.0])
def test_a_slope_across_a_pause(pause_s: float) -> None:
    t = 0.02 * np.arange(200) + np.where(np.arange(200) < 100, 0.0, pause_s)
    slope = slope_matrix(t, 4)
    assert slope @ t == pytest.approx(np.ones(200), abs=1e-6)
    assert slope @ (t - t[100]) ** 2 == pytest.approx(2 * (t - t[100]), rel=1e-5, abs=1e-4)


def test_a_lagging_sensor_is_undone_without_a_shift_of_time() -> None:
    """Of gusts, with noise: what is left of the lag does not look like a clock that is off."""
    random, n, lag_s = np.random.default_rng(0), 3000, 0.5
    t = 0.1 * np.arange(n)
    true = gusts(n, random)
    recorded = np.empty(n)
    recorded[0], keep = true[0], np.exp(-0.1 / lag_s)
    for k in range(n - 1):  # exact for straight pieces
        rate = (true[k + 1] - true[k]) / 0.1
        recorded[k + 1] = keep * (recorded[k] - true[k] + rate * lag_s) + true[k + 1] - rate * lag_s
    noisy = recorded + random.normal(0.0, 0.08, n)
    undone = SensorLag(lag_s=lag_s).flowed_A(t, noisy)
    assert np.std(undone - true) < 0.5 * np.std(noisy - true)
    shift_s = float(np.dot(undone - true, np.gradient(true, t)) / np.sum(np.gradient(true, t) ** 2))
    assert abs(shift_s) < 0.01


def test_lithium_that_a_cold_charge_plated_is_counted_and_strips() -> None:
    plated = replace(pack(), effects=(Plating(initial_mol_m3=200.0),))
    load = Load(time_s=np.arange(0.0, 60.0), current_A=np.full(60, 10.0), between=Between.HOLD)
    with_it, without = (simulate(p, load).require() for p in (plated, pack()))
    assert abs(with_it.audit.relative_error) < 1e-13
    assert np.all(with_it.voltage_V >= without.voltage_V)


def test_what_a_shifted_clock_makes_of_a_current_has_no_leap() -> None:
    """At half a sample it had one: there the nearest of two samples becomes the other.

    A clock that was off by just that was a place no fit could leave.
    """
    t = 0.1 * np.arange(400)
    i = 20.0 + np.random.default_rng(3).normal(0.0, 3.0, t.size)
    for shift_s in (-0.15, -0.1, -0.05, 0.05, 0.1, 0.25):
        before, after = (
            ClockShift(shift_s=shift_s + step_s, noise_A=1.0).flowed_A(t, i)
            for step_s in (-1e-9, 1e-9)
        )
        assert after == pytest.approx(before, abs=1e-5)


def test_between_its_samples_noise_is_as_rough_and_its_mean_stays() -> None:
    t = 0.1 * np.arange(20_000)
    noise = np.random.default_rng(4).normal(0.0, 1.0, t.size)
    for share in (0.0, 0.2, 0.5, 0.8, 1.0):
        between = _as_rough(noise, *_between(t, t[:-1] + 0.1 * share))
        assert 0.94 < np.std(between) < 1.02  # a straight line: 0.71
    level = np.full(t.size, 5.0)
    assert _as_rough(level, *_between(t, t[:-1] + 0.05)) == pytest.approx(level[:-1])


def test_a_pack_that_was_cold_says_that_the_air_was_and_each_alone_is_as_unknown_as_ever() -> None:
    h = next(h for h in HYPOTHESES if h.id == "cold_pack")
    offsets_K = [p.prior_std for p in h.parameters] * h.mixes
    covariance = offsets_K @ offsets_K.T
    assert np.sqrt(np.diag(covariance)) == pytest.approx([15.0, 15.0])
    apart = np.array([1.0, -1.0])
    assert np.sqrt(apart @ covariance @ apart) == pytest.approx(APART_K)


def test_numbers_come_back_from_coordinates_that_do_not_depend_on_each_other() -> None:
    some = [h for h in HYPOTHESES if h.id in ("series_resistance", "cold_pack")]
    flight = flown(seconds=20.0)
    problem = Problem(split([flight], [flight]).fitted, some)
    known = {
        "series_resistance": {"resistance_ohm": 0.01, "outside": 0.3},
        "cold_pack": {"start_offset_K": -20.0, "ambient_offset_K": -4.0},
    }
    (q,) = problem.starts_from(known)
    for name, own in problem.values(q).items():
        assert own == pytest.approx(known[name])
    told = problem.stds(q, np.diag([*[1.0] * 4, 0.0]))
    assert told["cold_pack"] == pytest.approx({"start_offset_K": 15.0, "ambient_offset_K": 15.0})
