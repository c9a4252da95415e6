"""How cold the autopilot's barometer was: the nearest to the air that most logs have.

A board warms by its own losses and, on some, by a heater; it is hardly ever colder than the air.
"""

import numpy as np

from flightlogs.log import FloatArray
from flightlogs.measured import CELSIUS_K, COLDEST_K, HOTTEST_K


def coldest_K(celsius: FloatArray | None) -> float | None:
    """Of (n,) temperatures of a barometer; None without any that one can have.

    Exactly 0 stands for no answer.
    """
    if celsius is None:
        return None
    kelvin = celsius[np.isfinite(celsius) & (celsius != 0.0)] + CELSIUS_K
    kelvin = kelvin[(kelvin > COLDEST_K) & (kelvin < HOTTEST_K)]
    return float(kelvin.min()) if kelvin.size else None
