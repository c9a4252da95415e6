"""What a pack did, as the log writers take it."""

from dataclasses import dataclass

import numpy.typing as npt


@dataclass(frozen=True, slots=True, kw_only=True)
class PackTrace:
    """One battery over time.

    Attributes:
        time_s: (n,) since boot.
        voltage_V: (n,) at the terminals.
        current_A: (n,) discharge positive.
        charge_C: (n,) drawn so far.
        temperature_K: (n,), or None where the pack has no thermometer.
        cell_voltage_V: (n, cells), or None.
    """

    time_s: npt.ArrayLike
    voltage_V: npt.ArrayLike
    current_A: npt.ArrayLike
    charge_C: npt.ArrayLike
    temperature_K: npt.ArrayLike | None = None
    cell_voltage_V: npt.ArrayLike | None = None
