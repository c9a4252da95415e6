"""Numbers as they are printed: rounded once, here, and never again."""

import math

from twin.constants import ZERO_CELSIUS_K

MISSING = "–"


def fixed(value: float | None, decimals: int) -> str:
    """`value` with so many decimals; a dash if there is none; no minus sign before a zero."""
    if value is None or not math.isfinite(value):
        return MISSING
    rounded = round(value, decimals)
    return f"{rounded if rounded else 0.0:.{decimals}f}"


def significant(value: float | None, digits: int = 3) -> str:
    """`value` to so many digits, without an exponent where a person would write none."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    value = float(f"{value:.{digits - 1}e}")  # 9.99 to two digits is 10, not 10.0
    magnitude = math.floor(math.log10(abs(value)))
    if not -4 <= magnitude < 7:
        return f"{value:.{digits - 1}e}"
    return fixed(round(value, digits - 1 - magnitude), max(0, digits - 1 - magnitude))


def to_error(value: float, std: float, digits: int = 3) -> str:
    """`value` to so many digits, to more where its standard error is known to two beyond them.

    0 where it is nothing beside that error.
    """
    if not (value and math.isfinite(value) and 0.0 < std < math.inf):
        return significant(value, digits)
    told = math.floor(math.log10(abs(value))) - math.floor(math.log10(std)) + 2
    return significant(value, max(digits, told)) if told > 0 else "0"


def minutes(seconds: float) -> str:
    """A duration as `m:ss`."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d}"


def ampere_hours(charge_C: float | None, decimals: int = 3) -> str:
    """A charge in Ah."""
    return fixed(None if charge_C is None else charge_C / 3600, decimals)


def celsius(temperature_K: float | None) -> str:
    """A temperature in degrees Celsius."""
    return fixed(None if temperature_K is None else temperature_K - ZERO_CELSIUS_K, 1)
