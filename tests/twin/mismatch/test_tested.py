"""What reference tests say of effects of a cell's make, and what follows from it in a verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import NOISE_V, Stage, cell_pack, load_of
from tests.twin.mismatch.recordings import flown, pack
from twin.calibrate.out import pack_text
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import conclude, fit, problem_of
from twin.effects import ActivationEnergies, ColdPack
from twin.effects.activation_energies import ACTIVATION_STD_J_mol
from twin.load import Between, Load
from twin.mismatch import HYPOTHESES, Flight, explain
from twin.mismatch.fit import Data
from twin.mismatch.fit import fit as fitted_to
from twin.mismatch.hypothesis import UNCERTAIN
from twin.mismatch.sizes import uncertainty
from twin.mismatch.split import as_seen, own_whitener
from twin.mismatch.tested import OF_THE_MAKE, as_tested, by_calibration, by_tests
from twin.pack_file import parse_pack_file
from twin.simulate import simulate

SLOW: tuple[Stage, ...] = ((0.0, 60.0, 10.0), (0.1, 7200.0, 60.0))
FAST: tuple[Stage, ...] = ((0.0, 60.0, 10.0), (3.0, 600.0, 1.0), (0.0, 600.0, 5.0))
ERROR_V = 5e-3


def of(stages: tuple[Stage, ...], name: str = "test") -> ReferenceTest:
    own = cell_pack()
    time_s, current_A = load_of(stages, own.cell.nominal_capacity_C / 3600)
    load = Load(time_s=time_s, current_A=current_A, between=Between.HOLD)
    noise_V = NOISE_V * np.random.default_rng(1).standard_normal(time_s.size)
    return ReferenceTest(
        name=name, time_s=time_s, current_A=current_A,
        voltage_V=simulate(own, load).voltage_V + noise_V,
    )  # fmt: skip


def test_fast_tests_tell_more_than_slow_ones_and_an_error_takes_from_it() -> None:
    own = cell_pack()
    slow, fast = (by_tests([(of(stages), own)], ERROR_V) for stages in (SLOW, FAST))
    rough = by_tests([(of(FAST), own)], 10 * ERROR_V)
    priors = {(h.id, p.name): p.prior_std for h in UNCERTAIN for p in h.priors(own)}
    assert set(slow) == set(OF_THE_MAKE)
    for effect, numbers in fast.items():
        for name, std in numbers.items():
            assert 0 < std <= rough[effect][name] <= priors[effect, name]
            assert std <= slow[effect][name]
    salt = "electrolyte_transport", "diffusivity_factor"
    assert fast[salt[0]][salt[1]] < 0.5 * priors[salt] < slow[salt[0]][salt[1]]


def test_standard_errors_are_those_of_the_effect_fitted_to_the_tests() -> None:
    """The same by the engine's own fit of the effect to the same recording."""
    own, test = cell_pack(), of(FAST)
    h = next(h for h in HYPOTHESES if h.id == "electrolyte_transport")
    flight = replace(
        flown(seconds=20.0), pack=own, voltage_V=test.voltage_V,
        motion=np.full(test.time_s.size, ""),
        load=Load(time_s=test.time_s, current_A=test.current_A, between=Between.HOLD),
        judged=np.ones(test.time_s.size, dtype=bool),
    )  # fmt: skip
    one = as_tested(flight, ERROR_V)
    data = Data((one,), (one,))
    std = np.sqrt(np.diag(fitted_to(data, [h]).covariance(1.0)))
    got = by_tests([(test, own)], ERROR_V)[h.id]
    for k, p in enumerate(h.priors(own)):
        assert got[p.name] == pytest.approx(p.prior_std * std[k], rel=0.2)  # bends a little


def test_what_tests_tell_is_believed_of_a_flight() -> None:
    h = next(h for h in HYPOTHESES if h.id == "electrolyte_transport")
    known = {h.id: {"diffusivity_factor": 0.03, "conductivity_factor": 9.0}}
    told = replace(pack(), standard_errors=known)
    usual, believed = ([p.prior_std for p in h.priors(own)] for own in (pack(), told))
    assert believed == [0.03, usual[1]]


@pytest.mark.long
def test_a_cold_pack_is_not_called_slow_where_tests_know_how_fast_the_cell_is() -> None:
    """Colder by 8 K all is slower; a rate alone can look like it to a twin that states an error."""
    cold = (ColdPack(start_offset_K=-8.0),)
    flights = [flown(cold, seed=seed, noise_V=1e-3) for seed in (1, 2)]
    known = by_tests([(of(FAST), cell_pack())], ERROR_V)
    told = [replace(f, pack=replace(f.pack, standard_errors=known)) for f in flights]
    some = [h for h in HYPOTHESES if h.id in ("cold_pack", "solid_diffusion_positive")]

    def odds(own: Sequence[Flight]) -> float:
        found = explain(own, hypotheses=some, slow_V=4 * ERROR_V)
        losses = {c.ids: c.delta_bic for c in found.candidates}
        return losses["solid_diffusion_positive",] - losses["cold_pack",]

    assert odds(told) > odds(flights) + 6.0  # in twice the logarithm: strong


@pytest.mark.long
def test_a_calibration_says_what_its_tests_tell() -> None:
    own, tests = cell_pack(), [of(SLOW, "slow"), of(FAST, "fast")]
    free = ["capacity_C", *OF_THE_MAKE["reaction_kinetics"]]
    *_, last = fit(problem_of(own, tests, only=free))
    found = conclude(last.problem, last.q, tests, cross_validate=False)
    got = by_calibration(found, tests)
    assert set(got) == {"reaction_kinetics", "activation_energies"}
    both = by_tests([(t, own) for t in tests], ERROR_V)
    for effect, numbers in got.items():
        for name, std in numbers.items():
            assert std == pytest.approx(both[effect][name], rel=0.2)  # by other rates
    named = '[pack]\nname = "mine"\ncell = "lipo_2200"\nseries = 1\n'
    before = parse_pack_file(named, name="pack.toml")
    known = replace(found, problem=problem_of(replace(own, standard_errors=got), tests, only=free))
    assert by_calibration(known, tests) == got  # its tests do not count twice
    written = pack_text(found, own, before, cell="cell.bpx.json", standard_errors=got)
    new = parse_pack_file(written, name="new.toml")
    assert new.standard_errors == got
    assert new.twin.cell_error_mv is None  # nothing was predicted
    ended = [replace(f, simulated_V=np.full_like(f.measured_V, np.nan)) for f in found.fitted]
    assert not by_calibration(replace(found, fitted=tuple(ended)), tests)
    one, other = found.fitted
    far = replace(one, held_out_V=one.simulated_V + 5e-3)
    short = replace(other, held_out_V=np.full_like(other.measured_V, np.nan))
    for tests_, mV in (((far, short), 5.0), ((one, short), None), (ended, None)):
        told = replace(found, fitted=tuple(tests_))
        text = pack_text(told, own, new, cell="cell.bpx.json")
        stated_mV = parse_pack_file(text, name="new.toml").twin.cell_error_mv
        assert stated_mV == (mV if mV is None else pytest.approx(mV, abs=0.3))  # beyond noise


ENERGIES = ActivationEnergies(negative_rate_J_mol=12e3, positive_rate_J_mol=12e3)
"""Of a cell whose reactions slow down more in the cold than its twin says, by a deviation each."""
COLD = ColdPack(start_offset_K=-15.0, ambient_offset_K=-15.0)


def cold_by_K(of_make: Mapping[str, Mapping[str, float]]) -> tuple[float, float]:
    """What a cold pack of ENERGIES is found to be off at its start, and the error of that."""
    h = next(h for h in HYPOTHESES if h.id == "cold_pack")
    flight = flown((COLD, ENERGIES), noise_V=1e-3)
    own = replace(flight, pack=replace(flight.pack, standard_errors=of_make))
    seen, noise = as_seen(own, ERROR_V)
    one = seen, own_whitener(seen, noise)
    got = fitted_to(Data((one,), (one,)), [h])
    errors = got.problem.stds(got.q, uncertainty(got, 1.0))
    return got.problem.values(got.q)[h.id]["start_offset_K"], errors[h.id]["start_offset_K"]


def test_a_temperature_is_known_no_better_than_what_it_does() -> None:
    """Its error has to hold the truth where activation energies are off, and said to be unknown."""
    exact_K, narrow_K = cold_by_K({})
    found_K, wide_K = cold_by_K(by_tests([(of(FAST), cell_pack())], ERROR_V))
    assert found_K == pytest.approx(exact_K, abs=0.01)  # only its error is another
    assert abs(found_K - COLD.start_offset_K) > 3.0 * narrow_K
    assert abs(found_K - COLD.start_offset_K) < 2.0 * wide_K


def test_tests_in_the_cold_tell_of_temperature() -> None:
    warm, cold = (replace(cell_pack(), initial_K=kelvin) for kelvin in (298.15, 273.15))
    at_25, at_0 = ((replace(of(FAST), ambient_K=p.initial_K), p) for p in (warm, cold))
    one, two = (by_tests(tests, ERROR_V) for tests in ([at_25], [at_25, at_0]))
    rates = [both["activation_energies"]["positive_rate_J_mol"] for both in (one, two)]
    assert rates[0] > 0.9 * ACTIVATION_STD_J_mol > 1.2 * rates[1]
    assert cold_by_K(two)[1] < 0.7 * cold_by_K(one)[1]
