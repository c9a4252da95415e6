"""The stored ageing references load, are consistent, and are small."""

import numpy as np
import pytest

from tests.reference.ageing import AGEING_LOADS, HERE, OUTPUTS, ReferenceAgeing, ageing_names

NAMES = ageing_names()


@pytest.mark.parametrize("name", NAMES)
def test_a_stored_case_is_the_load_its_formula_makes(name: str) -> None:
    reference = ReferenceAgeing.read(name)
    charge, load = AGEING_LOADS[reference.kind]
    assert reference.charge == charge
    np.testing.assert_allclose(reference.load.time_s, load.time_s, rtol=1e-12)
    np.testing.assert_allclose(reference.load.current_A, load.current_A, rtol=1e-12)
    for key in OUTPUTS:
        values = getattr(reference.outputs, key)
        assert values.shape == load.time_s.shape
        assert np.isfinite(values).all()


@pytest.mark.parametrize("name", NAMES)
def test_no_lithium_is_lost_without_trace(name: str) -> None:
    outputs = ReferenceAgeing.read(name).outputs
    cyclable = outputs.particles_mol + outputs.electrolyte_mol
    gap = outputs.lost_mol() + cyclable - cyclable[0]
    assert np.abs(gap).max() < 5e-12 + 1e-7 * outputs.lost_mol().max()  # the integrator's


@pytest.mark.parametrize("name", NAMES)
def test_a_stored_case_is_converged_and_within_the_cut_offs(name: str) -> None:
    reference = ReferenceAgeing.read(name)
    outputs, own = reference.outputs, reference.own_error
    assert own["voltage_V"] < 1e-3
    assert own["temperature_K"] < 0.01
    assert outputs.voltage_V.min() > 2.5
    assert outputs.voltage_V.max() < 4.2 + 1e-6
    for key in OUTPUTS[2:8]:  # the lithium lost
        largest = np.abs(getattr(outputs, key)).max()
        assert own[key] <= 1e-3 * largest + 1e-15


def test_all_files_together_stay_under_a_megabyte() -> None:
    assert sum(file.stat().st_size for file in HERE.glob("ageing-*.npz")) < 1_000_000
