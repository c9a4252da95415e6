import copy
import json
import math
import pickle
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from twin.at_rest import open_circuit_V
from twin.bpx_file import CellError, CellWarning, read_bpx
from twin.bpx_function import Constant, Expression, ExpressionError, Table
from twin.builtin import builtin_text, load_cell
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

SHARED = Path(__file__).parents[2] / ".." / "shared" / "battery"
TEXT = builtin_text("lg_m50")


def document() -> dict:
    return json.loads(TEXT)


def read(doc: dict):
    return read_bpx(json.dumps(doc), name="test.json")


def at(function, x: float) -> float:
    return float(ca.evalf(function(ca.SX(x))))


def slope(function, x: float) -> float:
    s = ca.SX.sym("s")
    return float(ca.Function("f", [s], [ca.jacobian(function(s), s)])(x))


# Functions ------------------------------------------------------------------------------------


number = st.floats(0.1, 5.0).map(lambda v: f"{v:.4g}")
expression = st.recursive(
    st.one_of(number, st.just("x")),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(
            lambda p: f"({' '.join(p)})"
        ),
        inner.map(lambda a: f"tanh({a})"),
        inner.map(lambda a: f"exp(-({a}) ** 2)"),
        inner.map(lambda a: f"-{a}"),
    ),
    max_leaves=8,
)


@settings(max_examples=60, deadline=None)
@given(text=expression, x=st.floats(0.01, 2.0))
def test_an_expression_means_what_python_means_by_it(text: str, x: float) -> None:
    names = {"exp": math.exp, "tanh": math.tanh, "cosh": math.cosh}
    try:
        expected, beside = (
            eval(text, {"__builtins__": {}}, names | {"x": v}) for v in (x, x * (1 + 1e-14))
        )
    except ZeroDivisionError:
        return
    steady = beside == pytest.approx(expected, rel=1e-10, abs=1e-13)  # no digits cancel
    if steady and abs(expected) < 1e12:
        assert at(Expression(text), x) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    "text",
    ["exit(1)", "__import__('os')", "x.real", "y + 1", "exp(x, 2)", "x if x else 1", "[x]", "x +",
     "lambda x: x", "True", "'x'", ""],
)  # fmt: skip
def test_what_is_no_expression_is_refused_and_never_run(text: str) -> None:
    with pytest.raises(ExpressionError):
        Expression(text)


def test_functions_are_values_that_cross_to_another_process() -> None:
    for function in (Constant(2.0), Expression("x ** 2"), Table((0.0, 1.0), (1.0, 3.0))):
        assert pickle.loads(pickle.dumps(function)) == function
        assert len({function, copy.copy(function)}) == 1
    cell = load_cell("lg_m50")
    assert pickle.loads(pickle.dumps(cell)) == cell
    assert hash(cell) == hash(load_cell("lg_m50"))


@pytest.mark.parametrize("constant", [Constant(4.0), Expression("4.0")])
def test_a_constant_has_the_shape_of_its_argument_and_does_not_depend_on_it(constant) -> None:
    x = ca.SX.sym("x", 3)
    value = constant(x)
    assert value.shape == (3, 1)
    assert not ca.depends_on(value, x)


rows = st.lists(
    st.tuples(st.floats(0.0, 1.0), st.floats(-5.0, 5.0)), min_size=2, max_size=12,
    unique_by=lambda r: round(r[0], 3),
)  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(rows=rows)
@example(rows=[(0.0, 0.0), (1.0, 0.0), (0.5, 5e-324)])
def test_a_table_is_exact_in_its_rows_and_stays_between_neighbours(rows) -> None:
    table = Table(*zip(*rows, strict=True))
    for x, y in rows:
        assert at(table, x) == pytest.approx(y, abs=1e-9)
    for (x0, x1), (y0, y1) in zip(
        zip(table.x, table.x[1:], strict=False),
        zip(table.y, table.y[1:], strict=False),
        strict=True,
    ):
        for share in (0.1, 0.37, 0.8):
            assert min(y0, y1) - 1e-9 <= at(table, x0 + share * (x1 - x0)) <= max(y0, y1) + 1e-9


def test_a_table_goes_on_straight_beyond_its_ends() -> None:
    table = Table((0.0, 0.4, 1.0), (1.0, 0.5, 0.2))
    for inside, outside in ((0.0, -0.3), (1.0, 1.4)):
        step = 1e-9 if inside == 0.0 else -1e-9
        grade = slope(table, inside + step)
        assert at(table, outside) == pytest.approx(at(table, inside) + grade * (outside - inside))


def test_the_slope_of_a_table_jumps_less_than_that_of_straight_lines() -> None:
    x = np.linspace(0, 1, 6)
    table = Table(tuple(x), tuple(np.exp(-3 * x)))
    fine = np.linspace(0.01, 0.99, 600)
    slopes = [slope(table, v) for v in fine]
    straight = np.diff(np.exp(-3 * x)) / np.diff(x)
    assert np.abs(np.diff(slopes)).max() < np.abs(np.diff(straight)).max() / 4


def test_a_table_serves_a_vector_of_any_shape() -> None:
    table = Table((0.0, 1.0, 2.0), (0.0, 1.0, 4.0))
    x = ca.SX(np.array([[0.0, 1.0], [2.0, 1.0]]))
    np.testing.assert_allclose(ca.DM(ca.evalf(table(x))), [[0, 1], [4, 1]], atol=1e-12)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ((0.0,), (1.0,)),
        ((0.0, 0.0), (1.0, 2.0)),
        ((0.0, 1.0), (1.0,)),
        ((0.0, math.nan), (1.0, 2.0)),
    ],
)
def test_a_table_that_is_none_is_refused(x, y) -> None:
    with pytest.raises(ExpressionError):
        Table(x, y)


# Files ----------------------------------------------------------------------------------------


def test_area_is_that_of_all_pairs_and_heat_capacity_that_of_the_cell() -> None:
    doc = document()
    doc["Parameterisation"]["Cell"][
        "Number of electrode pairs connected in parallel to make a cell"
    ] = 7
    cell = read(doc)
    assert cell.area_m2 == pytest.approx(7 * 0.1027)
    assert cell.heat_capacity_J_K == pytest.approx(2705.5 * 653.3 * 2.42e-5)
    assert cell.nominal_capacity_C == 5 * 3600


def test_what_the_standard_leaves_out_is_zero() -> None:
    doc = document()
    for part in doc["Parameterisation"].values():
        for key in [k for k in part if "activation" in k or "Entropic" in k]:
            del part[key]
    cell = read(doc)
    assert cell.electrolyte.conductivity_activation_J_mol == 0
    assert cell.negative.rate_activation_J_mol == cell.positive.diffusivity_activation_J_mol == 0
    assert at(cell.positive.entropic_V_K, 0.5) == 0


def test_a_potential_may_be_a_table() -> None:
    doc = document()
    x = np.linspace(0, 1, 201)
    exact = Expression(doc["Parameterisation"]["Positive electrode"]["OCP [V]"])
    y = [at(exact, float(v)) for v in x]
    doc["Parameterisation"]["Positive electrode"]["OCP [V]"] = {"x": x.tolist(), "y": y}
    cell = read(doc)
    for soc in (0.1, 0.5, 0.9):
        expected = open_circuit_V(load_cell("lg_m50"), soc)
        assert open_circuit_V(cell, soc) == pytest.approx(expected, abs=1e-4)


def test_both_branches_of_a_hysteresis_are_read() -> None:
    doc = document()
    electrode = doc["Parameterisation"]["Negative electrode"]
    electrode |= {
        "OCP (lithiation) [V]": "0.1 - 0.05 * x",
        "OCP (delithiation) [V]": {"x": [0, 1], "y": [0.2, 0.1]},
        "OCP hysteresis decay constant": 3.0,
    }
    cell = read(doc)
    assert cell.positive_hysteresis is None
    assert cell.negative_hysteresis is not None
    assert cell.negative_hysteresis.decay == 3.0
    assert at(cell.negative_hysteresis.lithiation_V, 0.5) == pytest.approx(0.075)
    assert at(cell.negative_hysteresis.delithiation_V, 0.5) == pytest.approx(0.15)
    electrode["OCP hysteresis decay constant"] = -3.0
    with pytest.raises(CellError, match="negative electrode: OCP hysteresis decay constant = -3"):
        read(doc)
    electrode |= {"OCP hysteresis decay constant": 3.0, "OCP (lithiation) [V]": "(x - 0.5) ** 0.5"}
    with pytest.raises(CellError, match=r"negative electrode: OCP \(lithiation\) is nan"):
        read(doc)
    del electrode["OCP hysteresis decay constant"]
    with pytest.raises(CellError, match="negative electrode: hysteresis needs"):
        read(doc)


def legacy(doc: dict) -> dict:
    """The same cell as a file of version 0.4 has it."""
    doc["Header"]["BPX"] = 0.4
    state = doc.pop("State")
    cell, electrolyte = (doc["Parameterisation"][k] for k in ("Cell", "Electrolyte"))
    cell["Ambient temperature [K]"] = cell["Initial temperature [K]"] = 298.15
    electrolyte["Initial concentration [mol.m-3]"] = state["Initial conditions"][
        "Initial electrolyte concentration [mol.m-3]"
    ]
    return doc


def test_a_file_of_version_0_is_the_same_cell_and_says_so() -> None:
    doc = legacy(document())
    doc["Parameterisation"]["Electrolyte"]["Initial concentration [mol.m-3]"] = 1200
    with pytest.warns(CellWarning, match="legacy"):
        cell = read(doc)
    assert cell.electrolyte.initial_concentration_mol_m3 == 1200
    assert cell.negative == load_cell("lg_m50").negative


def test_what_had_to_be_assumed_is_said() -> None:
    doc = document()
    del doc["State"], doc["Parameterisation"]["Cell"]["Reference temperature [K]"]
    with pytest.warns(CellWarning) as said:
        cell = read(doc)
    text = " ".join(str(w.message) for w in said)
    assert "1000.0 mol/m3 assumed" in text
    assert "298.15 assumed" in text
    assert cell.reference_K == 298.15


def test_what_is_not_used_is_said() -> None:
    doc = document()
    doc["Parameterisation"]["User-defined"] = {"Negative particle radius spread [m]": 1e-6}
    with pytest.warns(CellWarning, match="not used: Negative particle radius spread"):
        read(doc)


@pytest.mark.parametrize("upper_V", [2.0, 2.5])
def test_cut_offs_the_wrong_way_round_are_refused(upper_V: float) -> None:
    doc = document()
    doc["Parameterisation"]["Cell"]["Upper voltage cut-off [V]"] = upper_V
    with pytest.raises(CellError, match=r"lower 2\.5 V, upper .* lower < upper expected"):
        read(doc)


def test_a_file_that_begins_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / "cell.bpx.json").write_text(TEXT, encoding="utf-8-sig")
    assert load_cell(tmp_path / "cell.bpx.json").upper_cut_off_V == 4.2


def test_a_window_beyond_the_cut_offs_is_said() -> None:
    doc = document()
    doc["Parameterisation"]["Cell"]["Upper voltage cut-off [V]"] = 4.1
    with pytest.warns(CellWarning, match=r"4\.2000 V at the 100 % end"):
        read(doc)


THERMAL = (
    "Volume [m3]", "External surface area [m2]", "Density [kg.m-3]",
    "Specific heat capacity [J.K-1.kg-1]",
)  # fmt: skip


@pytest.mark.parametrize("field", THERMAL)
def test_missing_thermal_data_are_named(field: str) -> None:
    doc = document()
    del doc["Parameterisation"]["Cell"][field]
    with pytest.raises(CellError) as error:
        read(doc)
    assert field in str(error.value)


def blended(doc: dict) -> None:
    electrode = doc["Parameterisation"]["Negative electrode"]
    shared = ("Thickness [m]", "Porosity", "Transport efficiency", "Conductivity [S.m-1]")
    particle = {k: electrode.pop(k) for k in list(electrode) if k not in shared}
    electrode["Particle"] = {"graphite": particle, "silicon": dict(particle)}


def spm(doc: dict) -> None:
    doc["Header"]["Model"] = "SPM"
    parts = doc["Parameterisation"]
    for side in ("Negative electrode", "Positive electrode"):
        for key in ("Porosity", "Transport efficiency", "Conductivity [S.m-1]"):
            del parts[side][key]
    del parts["Electrolyte"], parts["Separator"]


def put(part: str, field: str, value: object):
    def change(doc: dict) -> None:
        doc["Parameterisation"][part][field] = value

    return change


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (blended, "a blend of graphite, silicon"),
        (spm, "SPM"),
        (put("Cell", "Volume [l]", 1), r"Volume \[l\]"),
        (put("Separator", "Thickness [m]", "thin"), "Separator / Thickness"),
        (put("Separator", "Thickness [m]", -1e-6), "thickness_m = -1e-06"),
        (put("Negative electrode", "Maximum stoichiometry", 0.0), "minimum < maximum"),
        (put("Positive electrode", "Porosity", 0.5), "exceed the volume"),
        (put("Positive electrode", "OCP [V]", "exit(3)"), "Positive electrode|positive electrode"),
        (put("Electrolyte", "Conductivity [S.m-1]", "open(1)"), "electrolyte: Conductivity"),
        (put("Electrolyte", "Conductivity [S.m-1]", "1 +"), "Conductivity"),
        (put("Electrolyte", "Conductivity [S.m-1]", "x - 2000"), "Conductivity is -1000.0 at 1000"),
        (put("Positive electrode", "OCP [V]", "4 + 1 / 0"), "positive electrode: OCP is inf"),
        (put("Positive electrode", "Diffusivity [m2.s-1]", 0), "Diffusivity is 0.0"),
        (put("Negative electrode", "OCP [V]", {"x": [0, 0], "y": [1, 2]}), "twice"),
        (put("Negative electrode", "OCP [V]", None), "OCP"),
        (lambda doc: doc["Parameterisation"].pop("Separator"), "Separator"),
        (lambda doc: doc.pop("Parameterisation"), "Parameterisation"),
        (lambda doc: doc.__setitem__("Parameterisation", [1]), "Parameterisation"),
        (lambda doc: doc["Header"].pop("BPX"), "BPX"),
        (lambda doc: doc.__setitem__("Header", 3), "Header"),
        (lambda doc: doc.pop("Header"), "Header"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_used_says_where_and_why(damage, says: str) -> None:
    doc = document()
    damage(doc)
    with pytest.raises(CellError, match=says) as error:
        read(doc)
    assert str(error.value).startswith("test.json")


def test_a_file_cut_anywhere_is_a_cell_error() -> None:
    for end in range(0, len(TEXT) - 2, 101):
        with pytest.raises(CellError):
            read_bpx(TEXT[:end], name="cut.json")


def test_reading_leaves_no_files_behind(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    load_cell("lg_m50")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("file", "volts"),
    [
        ("about_energy_nmc/nmc_pouch_cell_BPX.json", (2.7, 4.2)),
        ("about_energy_lfp/lfp_18650_cell_BPX.json", (2.0, 3.65)),
    ],
)
def test_published_files_of_other_laboratories_are_read(file: str, volts) -> None:
    if not (SHARED / file).exists():
        pytest.skip(f"{file} is not here")
    with pytest.warns(CellWarning) as said:
        cell = load_cell(SHARED / file)
    assert "legacy" in str(said[0].message)
    assert open_circuit_V(cell, 0.0) == pytest.approx(volts[0], abs=0.005)
    assert open_circuit_V(cell, 1.0) == pytest.approx(volts[1], abs=0.005)


def with_tables(n: int) -> str:
    """The LG M50 with both potentials as tables of n rows."""
    doc = document()
    x = np.linspace(0.01, 0.99, n)
    for side in ("Negative electrode", "Positive electrode"):
        electrode = doc["Parameterisation"][side]
        exact = Expression(electrode["OCP [V]"])
        electrode["OCP [V]"] = {"x": x.tolist(), "y": [at(exact, float(v)) for v in x]}
    return json.dumps(doc)


def test_a_cell_of_tables_runs_like_the_one_of_expressions() -> None:
    load = Load(time_s=np.arange(0.0, 300.0), current_A=np.full(300, 10.0))
    exact, tabled = (
        simulate(Pack(cell=cell), load).require().voltage_V
        for cell in (load_cell("lg_m50"), read_bpx(with_tables(250), name="tables.json"))
    )
    assert np.abs(tabled - exact).max() < 1e-3  # what straight lines between 250 rows miss
