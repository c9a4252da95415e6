"""Bounds of what may be calibrated."""

from dataclasses import replace

import casadi as ca
import pytest

from twin.builtin import load_cell
from twin.calibrate.parameters import (
    MIXTURE_FACTOR,
    MIXTURE_mol_m3,
    MIXTURES_J_mol,
    MIXTURES_m2_s,
    Parameter,
    cell_table,
)
from twin.effects import SelfHeating
from twin.pack import Pack


def salt_diffusivity(pack: Pack) -> tuple[Parameter, float]:
    """Its factor, and the cell's own [m2/s] at the concentration of the measurements."""
    (found,) = (p for p in cell_table(pack) if p.name == "electrolyte.diffusivity_factor")
    own = pack.cell.electrolyte.diffusivity_m2_s(ca.SX(MIXTURE_mol_m3))
    return found, float(ca.evalf(own))


@pytest.mark.parametrize("name", ["lg_m50", "lipo_2200"])
def test_salt_diffuses_as_in_mixtures_that_were_measured(name: str) -> None:
    factor, own_m2_s = salt_diffusivity(Pack(cell=load_cell(name)))
    least, most = MIXTURES_m2_s
    assert own_m2_s * factor.lower == pytest.approx(least / MIXTURE_FACTOR, rel=1e-3)
    assert own_m2_s * factor.upper == pytest.approx(most * MIXTURE_FACTOR, rel=1e-3)
    assert factor.lower < 1 < factor.upper


@pytest.mark.parametrize("own_m2_s", [1e-11, 2e-9])
def test_a_cell_with_another_electrolyte_may_keep_it(own_m2_s: float) -> None:
    cell = load_cell("lg_m50")
    salt = replace(cell.electrolyte, diffusivity_m2_s=lambda c: own_m2_s + 0 * c)
    factor, _ = salt_diffusivity(Pack(cell=replace(cell, electrolyte=salt)))
    assert factor.lower <= 1 / MIXTURE_FACTOR
    assert factor.upper >= MIXTURE_FACTOR


def test_a_pack_that_is_said_to_lose_no_heat_may_lose_little() -> None:
    insulated = Pack(cell=load_cell("lg_m50"), effects=(SelfHeating(heat_transfer_W_m2_K=0.0),))
    *_, transfer = cell_table(insulated, warming=True)
    assert transfer.name == "heat_transfer_W_m2_K"
    assert 0.0 < transfer.mean < 0.1
    assert transfer.bounds[0] < 0.0 < transfer.bounds[1]


def test_salt_warms_as_mixtures_that_were_measured() -> None:
    table = {p.name: p for p in cell_table(Pack(cell=load_cell("lg_m50")), warm_and_cold=True)}
    for number, (least, most) in MIXTURES_J_mol.items():
        salt = table[number]
        assert least <= salt.mean <= most
        assert salt.lower == pytest.approx(least / MIXTURE_FACTOR)
        assert salt.upper == pytest.approx(most * MIXTURE_FACTOR)
    assert table["positive.rate_activation_J_mol"].lower == 0.0


def test_a_salt_that_warms_otherwise_is_within_its_own_bounds() -> None:
    cell = load_cell("lg_m50")
    salt = replace(cell.electrolyte, conductivity_activation_J_mol=40e3)
    table = cell_table(Pack(cell=replace(cell, electrolyte=salt)), warm_and_cold=True)
    (found,) = (p for p in table if p.name == "electrolyte.conductivity_activation_J_mol")
    assert found.lower < 40e3 < found.upper
