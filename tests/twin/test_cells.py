import json
import re
import warnings
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import twin
from twin.at_rest import open_circuit_V
from twin.bpx_file import CellError
from twin.builtin import builtin_names, builtin_text, load_cell
from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.effects.self_heating import SelfHeating
from twin.electrode import ends_V
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Status

FOLDER = Path(twin.__file__).parent / "cells"
README = (FOLDER / "README.md").read_text(encoding="utf-8")
LIPO_AH = 2.2


def at(function, x: float) -> float:
    return float(ca.evalf(function(ca.SX(x))))


def fields(name: str) -> dict[str, object]:
    """`part: field` -> value, of everything the file says."""
    doc = json.loads(builtin_text(name))
    parts = doc["Parameterisation"] | {"State": {}}
    for section in doc["State"].values():
        parts["State"] |= section
    return {f"{part}: {k}": v for part, section in parts.items() for k, v in section.items()}


def documented(name: str) -> dict[str, tuple[str, str]]:
    """`part: field` -> (value, source), of the README's table."""
    section = README.split(f"## {name}:")[1].split("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+: [^|]+) \| ([^|]+) \| ([^|]+) \|$", section, re.MULTILINE)
    return {field.strip(): (value.strip(), source.strip()) for field, value, source in rows}


@pytest.mark.parametrize("name", builtin_names())
def test_every_number_of_a_built_in_cell_has_its_source_or_reason(name: str) -> None:
    told = documented(name)
    assert set(told) == set(fields(name))
    for field, value in fields(name).items():
        stated, source = told[field]
        assert len(source) > 3
        if isinstance(value, str):
            assert stated == "function"
        else:
            assert float(stated) == pytest.approx(value, rel=1e-12, abs=0), field


def test_a_cell_that_is_not_there_names_the_nearest() -> None:
    with pytest.raises(CellError, match="nearest is 'lg_m50'"):
        load_cell("LGM50")
    with pytest.raises(CellError, match="nearest is 'lipo_2200'"):
        load_cell("lipo2200")
    with pytest.raises(CellError, match="cannot be read"):
        load_cell("missing/cell.bpx.json")


def test_a_built_in_cell_is_the_same_by_name_and_by_path() -> None:
    for name in builtin_names():
        assert load_cell(name) == load_cell(FOLDER / f"{name}.bpx.json")


@pytest.mark.parametrize(("name", "low", "high"), [("lg_m50", 2.5, 4.2), ("lipo_2200", 3.0, 4.2)])
def test_the_window_ends_at_the_stated_voltages(name: str, low: float, high: float) -> None:
    cell = load_cell(name)
    assert open_circuit_V(cell, 0.0) == pytest.approx(low, abs=1e-5)
    assert open_circuit_V(cell, 1.0) == pytest.approx(high, abs=1e-5)
    voltages = [open_circuit_V(cell, s) for s in np.linspace(0, 1, 200)]
    assert (np.diff(voltages) > 0).all()


@pytest.mark.parametrize("name", builtin_names())
def test_both_electrodes_hold_the_same_charge_and_more_than_the_nominal(name: str) -> None:
    cell = load_cell(name)
    charge_C = [
        FARADAY_C_mol * cell.area_m2 * e.thickness_m * e.specific_area_m2_m3 * e.particle_radius_m
        / 3 * e.max_concentration_mol_m3 * (e.stoichiometry_max - e.stoichiometry_min)
        for e in (cell.negative, cell.positive)
    ]  # fmt: skip
    assert charge_C[0] == pytest.approx(charge_C[1], rel=1e-5)
    assert 1.0 < charge_C[0] / cell.nominal_capacity_C < 1.05


@pytest.mark.parametrize("name", builtin_names())
def test_pybamm_reads_the_same_cell_from_the_same_file(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pybamm = pytest.importorskip("pybamm")
        values = pybamm.ParameterValues.create_from_bpx(
            str(FOLDER / f"{name}.bpx.json"), target_soc=1.0
        )
    cell, T = load_cell(name), 310.0
    same = partial(pytest.approx, rel=1e-7, abs=0)  # the default forgives 1e-12, a diffusivity

    def growth(E: float) -> float:
        return np.exp(E / GAS_J_mol_K * (1 / cell.reference_K - 1 / T))

    def theirs(key: str, *arguments: float) -> float:
        value = values[key]
        if callable(value):
            value = value(*(pybamm.Scalar(a) for a in arguments))
        return float(np.ravel(values.evaluate(value))[0])

    for side, e in (("Negative", cell.negative), ("Positive", cell.positive)):
        x, c_max = 0.4, e.max_concentration_mol_m3
        assert theirs(f"{side} electrode OCP [V]", x) == same(at(e.ocp_V, x))
        assert theirs(f"{side} electrode OCP entropic change [V.K-1]", x) == same(
            at(e.entropic_V_K, x)
        )
        D = at(e.diffusivity_m2_s, x) * growth(e.diffusivity_activation_J_mol)
        assert theirs(f"{side} particle diffusivity [m2.s-1]", x, T) == same(D)
        i0 = (
            FARADAY_C_mol * e.rate_constant_mol_m2_s * growth(e.rate_activation_J_mol)
            * np.sqrt(1.3 * x * (1 - x))
        )  # fmt: skip
        key = f"{side} electrode exchange-current density [A.m-2]"
        assert theirs(key, 1300.0, x * c_max, c_max, T) == same(i0)
        share = e.specific_area_m2_m3 * e.particle_radius_m / 3
        assert theirs(f"{side} electrode active material volume fraction") == same(share)
    salt = cell.electrolyte
    for key, function, energy in (
        ("conductivity [S.m-1]", salt.conductivity_S_m, salt.conductivity_activation_J_mol),
        ("diffusivity [m2.s-1]", salt.diffusivity_m2_s, salt.diffusivity_activation_J_mol),
    ):
        ours = at(function, 1300.0) * growth(energy)
        assert theirs(f"Electrolyte {key}", 1300.0, T) == same(ours)
    full = theirs("Initial concentration in negative electrode [mol.m-3]")
    negative = cell.negative
    assert full == same(negative.stoichiometry_max * negative.max_concentration_mol_m3)


# What the LiPo can do -------------------------------------------------------------------------


def lipo(current_A: list[float], time_s: list[float], *, soc: float = 1.0, heated: bool = True):
    pack = Pack(
        cell=load_cell("lipo_2200"),
        initial_soc=soc,
        effects=(SelfHeating(heat_transfer_W_m2_K=12.0),) if heated else (),
    )
    load = Load(time_s=np.array(time_s), current_A=np.array(current_A), between=Between.HOLD)
    return simulate(pack, load)


def test_the_lipo_delivers_ten_c_until_it_is_empty() -> None:
    seconds = np.arange(0.0, 400.0)
    solution = lipo([10 * LIPO_AH] * seconds.size, list(seconds))
    assert solution.status is Status.LOWER_CUT_OFF
    assert 10 * LIPO_AH * solution.stopped_s / 3600 > 0.97 * LIPO_AH
    assert 35 < solution.temperature_K.max() - 273.15 < 60  # the limit of LiPo packs


@pytest.mark.parametrize("soc", [0.3, 0.5, 0.9])
def test_the_lipo_carries_35_c_for_three_seconds(soc: float) -> None:
    seconds = list(np.arange(0.0, 3.05, 0.1))
    solution = lipo([35 * LIPO_AH] * len(seconds), seconds, soc=soc).require()
    assert solution.voltage_V.min() > 3.2


def test_the_lipo_has_about_five_milliohm() -> None:
    seconds = list(np.arange(0.0, 1.05, 0.1))
    solution = lipo([10 * LIPO_AH] * len(seconds), seconds, soc=0.5, heated=False).require()
    rest_V = open_circuit_V(load_cell("lipo_2200"), 0.5)
    resistance = (rest_V - solution.voltage_V[-1]) / (10 * LIPO_AH)
    assert 3e-3 < resistance < 6e-3


def test_an_electrode_that_runs_out_turns_steep_as_in_pybamm() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pybamm = pytest.importorskip("pybamm")
        theirs = pybamm.parameters.lithium_ion_parameters.U_asymptotes
        for x in (-0.01, 0.0, 2e-4, 1e-3, 0.5, 0.999, 1.0):
            expected = float(theirs(pybamm.Scalar(x)).evaluate())
            assert at(ends_V, x) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert at(ends_V, 0.0) == pytest.approx(1.0, rel=1e-3)
    assert 0 <= at(ends_V, 0.006) < 1e-15
