"""Numbers that are not finite, for JSON: it has no word for them."""

from math import isfinite
from typing import Any


def finite(value: Any) -> Any:
    """The same with None for each number in it that is not finite; dicts and lists are entered."""
    if isinstance(value, dict):
        return {key: finite(own) for key, own in value.items()}
    if isinstance(value, list):
        return [finite(own) for own in value]
    return None if isinstance(value, float) and not isfinite(value) else value
