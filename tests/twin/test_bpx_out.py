"""A cell as BPX is the cell that was written."""

import warnings
from dataclasses import replace
from pathlib import Path

import casadi as ca
import pytest

from twin.bpx_file import read_bpx
from twin.bpx_function import Constant, Expression, Table
from twin.bpx_out import scaled, write_bpx
from twin.builtin import builtin_names, load_cell


@pytest.mark.parametrize("name", builtin_names())
def test_what_is_written_is_read_again(name: str) -> None:
    cell = load_cell(name)
    again = read_bpx(write_bpx(cell, description="a test"), name="again")
    assert again.heat_capacity_J_K == pytest.approx(cell.heat_capacity_J_K, rel=1e-14)
    assert again.nominal_capacity_C == pytest.approx(cell.nominal_capacity_C, rel=1e-14)
    rounded = ("heat_capacity_J_K", "nominal_capacity_C")
    assert replace(again, **{n: getattr(cell, n) for n in rounded}) == cell


@pytest.mark.parametrize(
    "function", [Constant(2.0), Expression("1 + x"), Table((0.0, 1.0), (1.0, 2.0))]
)
def test_a_scaled_function_is_the_factor_times_the_function(function: object) -> None:
    x = ca.SX.sym("x")
    for at in (0.0, 1.0):
        plain, twice = (
            float(ca.Function("f", [x], [f(x)])(at)) for f in (function, scaled(function, 3.0))
        )  # type: ignore[operator,arg-type]
        assert twice == pytest.approx(3.0 * plain)


def test_a_function_of_another_kind_is_refused() -> None:
    cell = load_cell("lipo_2200")
    odd = replace(cell, negative=replace(cell.negative, ocp_V=ca.exp))
    with pytest.raises(TypeError, match="no function that BPX can write"):
        write_bpx(odd, description="")


def test_the_file_loads_elsewhere(tmp_path: Path) -> None:
    file = tmp_path / "cell.bpx.json"
    file.write_text(write_bpx(load_cell("lg_m50"), description="a test"), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pybamm = pytest.importorskip("pybamm")
        values = pybamm.ParameterValues.create_from_bpx(str(file))
    assert values["Nominal cell capacity [A.h]"] == pytest.approx(5.0)
