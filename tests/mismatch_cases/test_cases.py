"""The generator of the mismatch engine's own cases, on a few seconds of flight."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

pybamm = pytest.importorskip("pybamm", reason="PyBaMM makes the truth of these cases")

from proof.simulated.cell_truth import CellTruth  # noqa: E402
from proof.simulated.dfn import SIDES, values_of  # noqa: E402
from proof.simulated.effects import ALL, FOREIGN, LIBRARY, PAIRS  # noqa: E402
from proof.simulated.faults import FAULTS, Traces  # noqa: E402
from proof.simulated.flights import TrueFlight  # noqa: E402
from proof.simulated.flown import fly  # noqa: E402
from proof.simulated.instruments import NOISE_V  # noqa: E402
from proof.simulated.pack_truth import PackTruth  # noqa: E402
from proof.simulated.solves import OutOfReachError, Solves  # noqa: E402
from proof.simulated.strength import found  # noqa: E402
from tests.mismatch_cases.case import Case, load_question  # noqa: E402
from tests.mismatch_cases.catalogue import LIPO, PLANS, STRENGTHS, Spec, specs  # noqa: E402
from tests.mismatch_cases.make import kept_flight, make_case  # noqa: E402

CONTRACT = {
    "self_heating", "cold_pack", "electrolyte_transport", "solid_diffusion_negative",
    "solid_diffusion_positive", "reaction_kinetics", "ocv_hysteresis", "plating_stripping",
    "lithium_inventory_loss", "active_material_loss_negative", "active_material_loss_positive",
    "film_resistance", "series_resistance", "weak_cell", "initial_soc", "leakage", "current_gain",
    "current_offset", "sensor_lag", "clock_shift", "voltage_gain",
}  # fmt: skip


@pytest.fixture(scope="module")
def solves(tmp_path_factory: pytest.TempPathFactory) -> Solves:
    """Nothing is solved twice."""
    return Solves(folder=tmp_path_factory.mktemp("solves"))


@pytest.fixture(scope="module")
def hop() -> TrueFlight:
    """Eight seconds around a take-off: a truth costs half a second."""
    whole = kept_flight("hop", 1, full_C=LIPO[0].full_C, drawn=(0.7, 0.7))
    span = slice(0, 80)
    return replace(
        whole,
        time_s=whole.time_s[span],
        current_A=whole.current_A[span],
        motion=whole.motion[span],
    )


def spec_of(*truth: str, strength: str = "3x", variant: str = "plain") -> Spec:
    return Spec(
        name="some", split="tune", truth=truth, strength=strength, plan="hop", told=LIPO[0],
        variant=variant,
    )  # fmt: skip


def test_twin_and_truth_agree_where_nothing_was_put_in(hop: TrueFlight, solves: Solves) -> None:
    case = make_case(spec_of(strength="none"), [hop, hop], solves)
    assert max(case.missed_V) < 1e-3
    first, second = case.recordings
    for recording, concealed in zip(case.recordings, case.concealed, strict=True):
        noise_V = recording.voltage_V - concealed.clean_V
        noise_A = recording.current_A - concealed.current_A
        assert np.std(noise_V) == pytest.approx(NOISE_V, rel=0.25)  # 80 samples
        assert np.std(noise_A) == pytest.approx(0.08, rel=0.25)
    assert np.all(first.voltage_V != second.voltage_V)  # noise of its own


def test_a_case_has_the_strength_it_says_and_comes_back_from_its_file(
    hop: TrueFlight, solves: Solves, tmp_path: Path
) -> None:
    case = make_case(spec_of("series_resistance"), [hop, hop], solves)
    assert case.missed_V[0] == pytest.approx(STRENGTHS["3x"], rel=0.12)
    rms_A = np.sqrt(np.mean(hop.current_A**2))
    assert case.sizes[0] * rms_A == pytest.approx(case.missed_V[0], abs=1e-3)  # Ohm's law
    path = tmp_path / "case.npz"
    case.save(path)
    back = Case.load(path)
    for name in Case.__slots__:
        if name not in ("recordings", "concealed"):
            assert getattr(back, name) == getattr(case, name), name
    for part in ("recordings", "concealed"):
        for mine, theirs in zip(getattr(case, part), getattr(back, part), strict=True):
            for f in fields(mine):
                np.testing.assert_array_equal(getattr(mine, f.name), getattr(theirs, f.name))
    question = load_question(path)
    np.testing.assert_array_equal(question.held_out.voltage_V, case.recordings[-1].voltage_V)
    assert len(question.recordings) == len(case.recordings) - 1
    assert "series" not in repr(question.told).replace("series=4", "")  # no truth in it


def test_every_effect_of_the_contract_is_there_and_every_one_in_each_split() -> None:
    assert set(LIBRARY) == CONTRACT
    assert len(FOREIGN) >= 5
    assert {e for pair in PAIRS for e in pair} <= CONTRACT
    for split, plans in PLANS.items():
        cases = specs(split)
        assert len({spec.name for spec in cases}) == len(cases)
        wanted = {(e, plan, s) for e in CONTRACT for plan in plans for s in STRENGTHS}
        there = {(*s.truth, s.plan, s.strength) for s in cases if len(s.truth) == 1}
        assert wanted <= there
        assert {e for spec in cases for e in spec.truth} == set(ALL)
        assert sum(spec.name.startswith("control") for spec in cases) >= 20
        assert sum(len(spec.truth) == 2 for spec in cases) >= 15


def test_splits_share_no_flight_and_no_noise() -> None:
    tune, report = (
        ({(s.plan, f) for s in specs(split) for f in s.flights()}, {s.seed for s in specs(split)})
        for split in ("tune", "report")
    )
    assert not tune[0] & report[0]
    assert not tune[1] & report[1]


def test_no_case_is_held_out_on_a_flight_it_shows() -> None:
    for split in PLANS:
        for spec in specs(split):
            assert len(set(spec.flights())) == len(spec.flights()) >= 2


@pytest.mark.parametrize("id_", sorted(CONTRACT - {"self_heating"} | set(FOREIGN)))
def test_every_effect_but_heat_changes_what_it_may(id_: str) -> None:
    """Without a solve: an effect changes the cells, the pack or the record, and nothing else."""
    plain = PackTruth.of(LIPO[0])
    for flavour in range(4):
        pack = ALL[id_].make(plain, ALL[id_].guess, flavour)
        assert pack != plain
        assert pack.cells.heat_transfer_W_m2_K is None


def test_a_cell_with_heat_warms_and_gives_more(hop: TrueFlight, solves: Solves) -> None:
    plain = PackTruth.of(LIPO[0])
    cold = fly(plain, hop, solves)
    warm = fly(ALL["self_heating"].make(plain, 0.01, 0), hop, solves)
    assert np.ptp(cold.temperature_K) == 0.0
    assert warm.temperature_K[-1] > warm.temperature_K[0]
    assert np.all(warm.recorded.voltage_V - cold.recorded.voltage_V > -1e-3)


def at_start(truth: CellTruth) -> tuple[float, float]:
    """Rest voltage, and lithium in both electrodes [mol/m2], of the parameters PyBaMM is given."""
    values, potentials, lithium = values_of(truth), [], 0.0
    for side in SIDES:
        concentration = values[f"Initial concentration in {side.lower()} electrode [mol.m-3]"]
        most = values[f"Maximum concentration in {side.lower()} electrode [mol.m-3]"]
        share = values[f"{side} electrode active material volume fraction"]
        lithium += concentration * share * values[f"{side} electrode thickness [m]"]
        ocp_V = values[f"{side} electrode OCP [V]"]
        potentials.append(float(ocp_V(pybamm.Scalar(concentration / most)).evaluate()))
    return potentials[1] - potentials[0], lithium


def test_aged_cells_are_full_at_the_voltage_of_the_file() -> None:
    fresh = replace(PackTruth.of(LIPO[0]).cells, soc=1.0)
    full_V, lithium = at_start(fresh)
    for changed in (
        replace(fresh, lithium_left=0.9),
        replace(fresh, material_left=(0.9, 1.0)),
        replace(fresh, material_left=(1.0, 0.9)),
    ):
        assert at_start(changed)[0] == pytest.approx(full_V, abs=1e-6)
    assert at_start(replace(fresh, lithium_left=0.9))[1] == pytest.approx(0.9 * lithium)


def test_a_lag_is_the_answer_of_a_first_order_sensor_to_a_ramp() -> None:
    t = np.arange(0.0, 10.0, 0.1)
    ramp = Traces(time_s=t, current_A=2 * t, voltage_V=t, drawn=t, seed=0)
    got = FAULTS["sensor_lag"](ramp, 0.5).current_A
    np.testing.assert_allclose(got, 2 * t - 1.0 * (1 - np.exp(-t / 0.5)), atol=1e-12)


def test_a_late_clock_delays_the_current_alone() -> None:
    t = np.arange(0.0, 10.0, 0.1)
    traces = Traces(time_s=t, current_A=np.sin(t), voltage_V=t, drawn=t, seed=0)
    late = FAULTS["clock_shift"](traces, 0.3)
    np.testing.assert_allclose(late.current_A[3:], np.sin(t[:-3]), atol=1e-12)
    np.testing.assert_array_equal(late.voltage_V, t)


def test_sizes_are_found_where_they_exist_and_only_there() -> None:
    def f(x: float) -> float:
        return 3.0 * x**1.5 if x < 5.0 else float("inf")

    size = found(f, 0.3, 4.0, (1e-3, 100.0))
    assert size is not None
    assert f(size) == pytest.approx(0.3, rel=0.11)
    assert found(f, 0.3, 60.0, (1e-3, 100.0)) is not None  # from where it cannot be tried
    assert found(f, 1e3, 1.0, (1e-3, 4.0)) is None


def test_what_a_cell_cannot_be_is_out_of_reach(hop: TrueFlight, solves: Solves) -> None:
    empty = ALL["initial_soc"].make(PackTruth.of(LIPO[0]), 0.97, 0)
    with pytest.raises(OutOfReachError, match="lipo_2200"):
        fly(empty, hop, solves)


def test_what_is_kept_of_a_cell_is_none_of_one_whose_file_was_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def answer(*_: object) -> tuple[np.ndarray, np.ndarray]:
        asked.append(1)
        return np.zeros(3), np.zeros(3)

    monkeypatch.setattr("proof.simulated.solves._solve", answer)
    question = CellTruth(cell="lipo_2200", soc=1.0, start_K=298.15, ambient_K=298.15), *np.eye(2, 3)
    for text, times in (("as it is", 1), ("as it is", 1), ("changed", 2)):
        monkeypatch.setattr("proof.simulated.solves.builtin_text", lambda _, text=text: text)
        Solves(folder=tmp_path).answer(*question)
        assert len(asked) == times


def test_variants_spoil_the_recording_and_not_the_truth(hop: TrueFlight, solves: Solves) -> None:
    plain, slow, coarse = (
        make_case(spec_of(strength="none", variant=v), [hop], solves).recordings[0]
        for v in ("plain", "1hz", "quantised")
    )
    assert np.diff(plain.time_s) == pytest.approx(0.1)
    assert np.diff(slow.time_s) == pytest.approx(1.0)
    steps = np.unique(np.round(np.diff(np.unique(coarse.voltage_V)), 6))
    assert steps.min() >= 0.010
