"""Unlike cells: read from their columns, told apart, and written so that the twin has them."""

import io
from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import NOISE_V, cell_pack, load_of
from twin.calibrate.cells_problem import (
    CAPACITY,
    OFFSET,
    RESISTANCE,
    CellsProblem,
    cells_measured,
)
from twin.calibrate.out import toml_text
from twin.calibrate.reference import ReferenceTest, reference_test
from twin.calibrate.run import Progress, fit, problem_of
from twin.calibrate.table import CalibrationError, read_test
from twin.calibrate.unlike import part
from twin.columns import TableError
from twin.effects import WeakCell
from twin.load import Load
from twin.pack import Pack
from twin.pack_file import effects_of, parse_pack_file
from twin.simulate import simulate

SERIES = 3
CAPACITY_AH = 2.2
TRUTH = (
    WeakCell(cell=1, capacity_factor=1.0),
    WeakCell(cell=2, capacity_factor=0.95, soc_offset=-0.02, resistance_ohm=2e-3),
    WeakCell(cell=3, capacity_factor=1.03, soc_offset=0.01),
)


def measured(weak: tuple[WeakCell, ...]) -> ReferenceTest:
    """2C of a pack of such cells, down to where their mean is empty."""
    cell = cell_pack().cell
    time_s, current_A = load_of(((0.0, 60.0, 10.0), (2.0, 1800.0, 10.0)), CAPACITY_AH)
    test = ReferenceTest(name="2C", time_s=time_s, current_A=current_A, voltage_V=time_s)
    wide = replace(cell, lower_cut_off_V=2.5, upper_cut_off_V=4.4)
    load = Load(time_s=test.time_s, current_A=test.current_A, between=test.between)
    answer = simulate(Pack(cell=wide, series=SERIES, effects=weak), load)
    mean_V = answer.voltage_V / SERIES
    stop = int(np.argmax(mean_V < cell.lower_cut_off_V)) or mean_V.size
    noise_V = NOISE_V * np.random.default_rng(7).standard_normal((SERIES, stop))
    cells_V = answer.cell_voltage_V[:, :stop] + noise_V
    return replace(
        test, time_s=test.time_s[:stop], current_A=test.current_A[:stop], cells_V=cells_V,
        voltage_V=cells_V.mean(axis=0),
    )  # fmt: skip


def fitted(test: ReferenceTest) -> Progress:
    """The mean cell, which is known but for its capacity and resistance."""
    pack = replace(cell_pack(), series=SERIES)
    *_, best = fit(problem_of(pack, [test], only=("capacity_C", "series_resistance_ohm")))
    return best


def test_hidden_differences_are_found_within_their_errors_and_each_cell_to_the_noise() -> None:
    test = measured(TRUTH)
    got = part(fitted(test), [test], parallel=1, soc=1.0)
    assert got is not None
    found = {d.quantity: d for d in got.unlike.differences}
    assert all(d.beyond_noise for d in found.values())
    for quantity in (OFFSET, RESISTANCE):
        truth = np.array([getattr(w, quantity) for w in TRUTH])
        off = (found[quantity].value - (truth - truth.mean())) / found[quantity].std
        assert np.abs(off).max() < 3.5
    weak = got.unlike.weak
    ratio = np.array([w.capacity_factor for w in weak]) / weak[0].capacity_factor
    assert ratio == pytest.approx([1.0, 0.95, 1.03], abs=4e-3)
    assert found[CAPACITY].std.max() < 2e-3
    assert got.unlike.before_V.max() > 5 * NOISE_V
    assert got.unlike.after_V.max() < 1.1 * NOISE_V


def test_cells_that_are_alike_are_said_to_be_so() -> None:
    test = measured(())
    best = fitted(test)
    got = part(best, [test], parallel=1, soc=1.0)
    assert got is not None
    assert got.unlike.weak == ()
    assert got.best is best
    assert not any(d.beyond_noise for d in got.unlike.differences)
    assert part(best, [replace(test, cells_V=None)], parallel=1, soc=1.0) is None


def test_slopes_of_the_cells_are_the_limit_of_differences() -> None:
    test = measured(TRUTH)
    best = fitted(test)
    own = CellsProblem(
        best.problem,
        best.q,
        tuple(cells_measured(best.problem, [test])),
        (CAPACITY, OFFSET, RESISTANCE),
    )
    q = np.linspace(-0.3, 0.2, len(own.parameters))
    residuals, slopes = own.linearised(q)
    assert own.cost(q) == pytest.approx(0.5 * residuals @ residuals, rel=1e-9)
    for k in (1, SERIES, 2 * SERIES + 1):  # one of each quantity
        step = np.zeros(q.size)
        step[k] = 1e-3
        high, low = (own.linearised(q + s)[0] for s in (step, -step))
        near = (high - low) / 2e-3
        assert slopes[:, k] == pytest.approx(near, abs=2e-3 * np.abs(near).max())


def test_cells_that_differ_are_stored_in_the_pack_file() -> None:
    content = {
        "pack": {"name": 'a "\x7f" of \t ours', "cell": "lipo_2200", "series": SERIES},
        "twin": {"physics": ["weak_cell"]},
        "effects": {"weak_cell": [
            {"cell": w.cell, "capacity_factor": w.capacity_factor, "soc_offset": w.soc_offset,
             "resistance_ohm": -w.resistance_ohm}
            for w in TRUTH
        ]},
    }  # fmt: skip
    file = parse_pack_file(toml_text(content), name="pack.toml")
    assert file.pack.name == 'a "\x7f" of \t ours'
    read = effects_of(file)
    assert read == tuple(replace(w, resistance_ohm=-w.resistance_ohm) for w in TRUTH)
    overfull = Pack(cell=cell_pack().cell, series=SERIES, effects=read)  # cell 3 above full
    assert [kind.initial_soc for kind in overfull.cells()] == pytest.approx([1.0, 0.98, 1.01])


TWO = "Time / s,Current / A,{}\n0,0,8.2,4.0,4.2\n1,1,8.0,3.9,4.1\n2,1,8.0,,4.1\n"


def test_columns_of_cells_are_no_voltage_of_the_pack() -> None:
    table = read_test(
        io.StringIO(TWO.format("Pack voltage / V,Cell Voltage 2 / V,Cell 1 (V)")), name="x"
    )
    assert table.voltage_V.tolist() == [8.2, 8.0]
    assert table.cells_V is not None
    assert table.cells_V.tolist() == [[4.2, 4.1], [4.0, 3.9]]
    with pytest.raises(CalibrationError, match=r"voltages of 2 cells, but 3 in series"):
        reference_test(table, Pack(cell=cell_pack().cell, series=3))


def test_without_a_voltage_of_the_pack_it_is_the_sum_of_its_cells() -> None:
    table = read_test(io.StringIO(TWO.format("Capacity / Ah,cell0_V,cell1_V")), name="x")
    assert table.voltage_V.tolist() == [8.2, 8.0]
    one = "Time / s,Current / A,Cell 1 voltage / V\n0,0,4\n1,1,3.9\n"
    single = read_test(io.StringIO(one), name="x")
    assert single.cells_V is None
    assert single.voltage_V.tolist() == [4.0, 3.9]


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("Voltage / V,Cell 1 / V,cell1 [V]", r"x: two columns have the voltage of cell 1"),
        ("Voltage / V,Cell 1 / V,Cell 4 / V", r"x: voltages of the cells \[1, 4\]"),
    ],
)
def test_columns_that_cannot_be_those_of_cells_are_refused(header: str, said: str) -> None:
    with pytest.raises(TableError, match=said):
        read_test(io.StringIO(TWO.format(header)), name="x")
