"""What is known of the instruments of a laboratory: those who record at a cycler know it.

A sensor on a vehicle is set up by its pilot and may be off by half; a cycler is calibrated. Makers
state 0.1 % of full scale for current and voltage (Neware BTS4000, data sheet), 0.05 % and less for
the better ones; a full scale is no more than five times what is read, and the range of a channel no
more than ten times the current that empties a cell in an hour. Both are read at one time, within
20 ms (the same data sheet). Of their noise no more is known than of any sensor's.
"""

from dataclasses import replace

from twin.effects.likely import SENSOR
from twin.pack import Pack

OF_SCALE = 1e-3
READ_OF_SCALE = 5.0
RANGE_C = 10.0  # C-rate
TOGETHER_S = 0.02
THERMOCOUPLE_K = 1.0
"""Of one of class 1 at room temperature, 0.5 K (type T) to 1.5 K (type K): IEC 60584-1:2013."""


def by_cycler(pack: Pack, *, voltage: float = OF_SCALE) -> Pack:
    """The same where a calibrated cycler recorded it: a pack file's `standard_errors` say so.

    `voltage`: share of it by which what recorded it may be off, where that is another instrument.
    """
    known = {
        "current_gain": {"gain": OF_SCALE * READ_OF_SCALE},
        "voltage_gain": {"gain": voltage},
        "current_offset": {"offset_A": OF_SCALE * RANGE_C * pack.rated_C / 3600},
        "sensor_lag": {"lag_s": TOGETHER_S, SENSOR.name: SENSOR.prior_std},
        "clock_shift": {"shift_s": TOGETHER_S, SENSOR.name: SENSOR.prior_std},
    }
    return replace(pack, standard_errors={**pack.standard_errors, **known})


def by_thermocouple(pack: Pack) -> Pack:
    """The same where it was measured how warm it was at first, after a rest in the air around."""
    offsets = dict.fromkeys(("start_offset_K", "ambient_offset_K"), THERMOCOUPLE_K)
    return replace(pack, standard_errors={**pack.standard_errors, "cold_pack": offsets})
