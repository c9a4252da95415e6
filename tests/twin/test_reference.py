import numpy as np
import pytest

from tests.reference.loads import LOADS, names
from tests.reference.stored import Reference, cell_file, simulate_reference
from twin.at_rest import open_circuit_V
from twin.builtin import load_cell


@pytest.mark.parametrize("name", names())
def test_a_stored_load_is_the_one_its_formula_makes(name: str) -> None:
    reference = Reference.read(name)
    made = LOADS[reference.cell, reference.kind]
    np.testing.assert_allclose(reference.load.time_s, made.time_s, rtol=1e-12)
    np.testing.assert_allclose(reference.load.current_A, made.current_A, rtol=1e-12)
    assert reference.load.hold == made.hold


@pytest.mark.parametrize("name", names())
def test_a_stored_solution_is_converged_and_within_the_cut_offs(name: str) -> None:
    reference, cell = Reference.read(name), load_cell(cell_file(name.split("-")[0]))
    assert reference.own_error_rms_mV < 0.3
    assert cell.lower_cut_off_V < reference.voltage_V.min()
    assert reference.voltage_V.max() < cell.upper_cut_off_V + 1e-6
    if reference.load.current_A[0] == 0:
        assert reference.voltage_V[0] == pytest.approx(open_circuit_V(cell, 1.0), abs=1e-6)
    if not reference.heated:
        assert np.ptp(reference.temperature_K) == 0


@pytest.mark.parametrize("name", names())
def test_the_twin_agrees_with_pybamm_on_converged_meshes(name: str) -> None:
    reference = Reference.read(name)
    solution = simulate_reference(reference).require()
    error_mV = 1e3 * (solution.voltage_V - reference.voltage_V)
    assert np.sqrt(np.mean(error_mV**2)) <= 1.0
    assert np.abs(error_mV).max() <= 5.0
    assert np.abs(solution.temperature_K - reference.temperature_K).max() < 0.1
