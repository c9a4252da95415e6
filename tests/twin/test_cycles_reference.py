"""Ageing over whole cycles against the stored, converged solutions of PyBaMM (tests/reference).

Both ways through a load, by samples and by adaptive steps. `benchmarks/cycles.py` prints the table.
"""

import numpy as np
import pytest

from tests.reference.ageing import ReferenceAgeing
from tests.reference.cycling import LOST, How, answer, theirs

BOTH = "negative", "stress_diffusion"
CASES = [
    *(
        (load, effects, how)
        for load in ("cycle", "ten", "flown")
        for effects in BOTH
        for how in How
    ),
    ("fifty", "negative", How.SAMPLED),
]


@pytest.mark.parametrize(("load", "effects", "how"), CASES)
def test_what_cycles_take_agrees_with_pybamm_within_a_percent(
    load: str, effects: str, how: How
) -> None:
    reference = ReferenceAgeing.read(f"ageing-{load}-{effects}-isothermal")
    ours = answer(reference, how)
    for name, amount in theirs(reference).items():
        assert ours.amounts[name] == pytest.approx(amount, rel=0.01), name
    error_mV = 1e3 * (ours.voltage_V - reference.outputs.voltage_V)[1:]  # the first: README there
    assert np.sqrt(np.mean(error_mV**2)) <= 1.0
    assert abs(ours.audit.relative_error) < 1e-12


@pytest.mark.parametrize("how", How)
def test_salt_is_neither_made_nor_used_up_by_a_cycle(how: How) -> None:
    """What side reactions take of it the particles give: the audit's sum alone would not tell."""
    audit = answer(ReferenceAgeing.read("ageing-cycle-negative-isothermal"), how).audit
    before, after = audit.electrolyte_mol
    assert after == pytest.approx(before, rel=1e-11)


def test_what_pybamm_calls_lost_to_side_reactions_leaves_out_what_dead_material_holds() -> None:
    """Its particles and salt lose more than that; with the trapped lithium its books are closed."""
    reference = ReferenceAgeing.read("ageing-fifty-negative-isothermal")
    out = reference.outputs
    lithium = out.particles_mol + out.electrolyte_mol
    named = out.sei_mol + out.crack_sei_mol + out.plated_mol + out.dead_mol
    missing = 1 - (lithium + named) / lithium[0]
    assert missing[-1] > 1.5e-4  # 45 of 783 umol lost, of 0.289 mol
    assert np.all(np.diff(missing[1:]) > -1e-9)
    with_trapped = (lithium + out.lost_mol()) / lithium[0] - 1
    assert np.abs(with_trapped).max() < 1e-9  # its integrator's tolerance
    ours = answer(ReferenceAgeing.read("ageing-cycle-negative-isothermal"), How.PROTOCOL)
    assert set(LOST.values()) == set(ours.audit.lost_mol)
    assert abs(ours.audit.relative_error) < 1e-12
