"""Numbers as they are printed."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reports.quantity import (
    MISSING,
    ampere_hours,
    celsius,
    fixed,
    minutes,
    significant,
    to_error,
)


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [(1.25, 1, "1.2"), (-0.001, 2, "0.00"), (math.nan, 1, MISSING), (None, 1, MISSING)],
)
def test_fixed_has_no_minus_before_zero_and_no_nan(
    value: float | None, decimals: int, text: str
) -> None:
    assert fixed(value, decimals) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (21.44, "21.4"),
        (1234.5, "1230"),
        (9.9996, "10.0"),
        (0.01234, "0.0123"),
        (-2e-15, "-2.00e-15"),
    ],
)
def test_significant_keeps_three_digits(value: float, text: str) -> None:
    assert significant(value) == text


@given(st.one_of(st.floats(-1e300, 1e300), st.sampled_from([math.nan, math.inf, -math.inf])))
@settings(max_examples=200)
def test_significant_never_strays_by_more_than_it_says(value: float) -> None:
    text = significant(value)
    if not math.isfinite(value):
        assert text == MISSING
    else:
        assert float(text) == pytest.approx(value, rel=0.005001, abs=0)


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (1.0021, 0.00016, "1.00210"),
        (0.4635, 0.0059, "0.4635"),
        (19.0, 30.0, "19.0"),
        (4.2e-21, 6.6e-5, "0"),
        (-1.14, 0.0, "-1.14"),
        (0.0, 0.1, "0"),
        (12.0, math.nan, "12.0"),
    ],
)
def test_a_value_is_told_as_far_as_its_error_is(value: float, std: float, text: str) -> None:
    assert to_error(value, std) == text


def test_units_are_converted_once() -> None:
    assert (minutes(301.4), ampere_hours(7920.0, 1), celsius(298.15)) == ("5:01", "2.2", "25.0")
