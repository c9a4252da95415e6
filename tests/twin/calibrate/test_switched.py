"""Rows that have the voltage of one current and the other current beside it."""

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack
from twin.calibrate.reference import ReferenceTest, reference_test
from twin.calibrate.resample import sampled
from twin.calibrate.switched import mixed_rows
from twin.calibrate.table import MeasuredTable

FloatArray = npt.NDArray[np.float64]

ON, OFF = 20, 60  # rows at which 3 A begin and end
TIME_S = np.arange(100.0)
CURRENT_A = np.where((TIME_S >= ON) & (TIME_S < OFF), 3.0, 0.0)


def voltage() -> FloatArray:
    """30 mOhm at once, and as much again within seconds; a little noise."""
    slow_A = np.zeros(100)
    for k in range(1, 100):
        slow_A[k] = slow_A[k - 1] + (CURRENT_A[k - 1] - slow_A[k - 1]) * (1 - np.exp(-1 / 8))
    noise_V = 2e-4 * np.random.default_rng(0).standard_normal(100)
    return np.asarray(4.0 - 0.03 * CURRENT_A - 0.03 * slow_A - 1e-4 * TIME_S + noise_V)


def test_of(voltage_V: FloatArray) -> ReferenceTest:
    return ReferenceTest(name="t", time_s=TIME_S, current_A=CURRENT_A, voltage_V=voltage_V)


test_of.__test__ = False  # type: ignore[attr-defined]


def late(row: int) -> FloatArray:
    """The row's current is new, its voltage is not yet."""
    out = voltage()
    out[row] = out[row - 1]
    return out


def early(row: int) -> FloatArray:
    """The voltage of the row before is new, its current is not yet."""
    out = voltage()
    out[row - 1] = out[row]
    return out


@pytest.mark.parametrize(
    ("voltage_V", "rows"),
    [
        (voltage(), []),
        (late(ON), [ON]),
        (late(OFF), [OFF]),
        (early(ON), [ON - 1]),
        (early(OFF), [OFF - 1]),
    ],
)
def test_what_changes_a_row_beside_the_current_is_found(
    voltage_V: FloatArray, rows: list[int]
) -> None:
    assert mixed_rows(CURRENT_A, voltage_V).tolist() == rows


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_a_few_rows_are_none(n: int) -> None:
    assert mixed_rows(CURRENT_A[:n], voltage()[:n]).size == 0


def test_a_drive_cycle_has_none() -> None:
    current_A = np.random.default_rng(1).uniform(-2.0, 6.0, 2000)
    slow_A = np.convolve(current_A, np.exp(-np.arange(60) / 8) / 8)[:2000]
    assert mixed_rows(current_A, 3.8 - 0.03 * current_A - 0.03 * slow_A).size == 0


def test_such_a_row_is_not_compared_and_its_current_stays() -> None:
    whole, broken = (sampled(test_of(v), 3 * 3600.0) for v in (voltage(), late(OFF)))
    assert np.array_equal(broken.load.current_A, whole.load.current_A)
    time_s = [s.load.time_s[s.at] for s in (whole, broken)]
    assert np.setdiff1d(*time_s).tolist() == [OFF]
    apart_V = whole.voltage_V[np.isin(time_s[0], time_s[1])] - broken.voltage_V
    assert np.abs(apart_V).max() < 1e-3  # in no mean of its neighbours either


def test_the_rest_before_is_told_without_it() -> None:
    near = [voltage()[18:], early(ON)[18:]]
    tests = [
        ReferenceTest(name="t", time_s=TIME_S[:82], current_A=CURRENT_A[18:], voltage_V=v)
        for v in near
    ]
    starts_V = [sampled(t, 3 * 3600.0).start_V for t in tests]
    assert starts_V[1] == pytest.approx(starts_V[0], abs=1e-3)


def test_it_is_said_how_many_there_are() -> None:
    said = []
    for voltage_V in (voltage(), late(OFF)):
        table = MeasuredTable(
            name="t", time_s=TIME_S, current_A=CURRENT_A, voltage_V=voltage_V, temperature_K=None
        )
        said.append(reference_test(table, cell_pack()).remarks)
    assert not any("left out" in remark for remark in said[0])
    assert said[1][1].endswith("1 (the first at 60 s)")
