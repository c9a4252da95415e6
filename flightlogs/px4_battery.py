"""Batteries of a PX4 log: `battery_status`, `battery_info`, the BAT parameters.

    field                           ours               unit   not measured
    voltage_v                       voltage_V          V      0
    current_a                       current_A          A      -1
    discharged_mah                  charge_C           mAh    -1
    temperature                     temperature_K      degC   NaN; 0 throughout
    voltage_cell_v[4, 10 or 14]     cell_voltage_V     V      0
    cell_count, BATn_N_CELLS        series                    0
    capacity, BATn_CAPACITY         capacity_C         mAh    0, -1, 65535
    serial_number (until 1.16)      serial                    0, 65535

The filtered and average currents are no measurements and are not used.
Source: PX4-Autopilot, msg/battery_status.msg, msg/versioned/BatteryStatus.msg.
"""

from collections.abc import Mapping

import numpy as np

from flightlogs.errors import LogWarning
from flightlogs.log import BatteryLog, FloatArray
from flightlogs.measured import CELSIUS_K, MAH_C, RawBattery, battery_log
from flightlogs.px4_topics import Px4Topics, Samples

LEAST_CELL_V = 0.5  # no cell in flight is lower: the input is not wired
MOST_CELLS = 14  # length of voltage_cell_v since 1.13
UNKNOWN_UINT16 = 65535.0
MULTICELL = 2
SERIAL_LENGTH = 32  # of battery_info.serial_number


def batteries(
    topics: Px4Topics, parameters: Mapping[str, float]
) -> tuple[tuple[BatteryLog, ...], tuple[LogWarning, ...]]:
    """All batteries in the order of their instances, and what is doubtful about them."""
    found = [
        battery_log(_raw(samples, topics, parameters), i)
        for i, samples in enumerate(topics.instances("battery_status"))
    ]
    warnings = tuple(w for _, said in found for w in said)
    return tuple(b for b, _ in found), warnings


def _raw(samples: Samples, topics: Px4Topics, parameters: Mapping[str, float]) -> RawBattery:
    nan = np.full(samples.time_s.shape, np.nan)
    number = int(_constant(samples, "id") or samples.instance + 1)
    series = _series(samples, number, parameters)
    charge_mah = samples.get("discharged_mah", -1.0)
    celsius = samples.get("temperature")
    connected = samples.get("connected")
    voltage_V, current_A = samples.get("voltage_v", 0.0), samples.get("current_a", -1.0)
    if connected is not None and not connected.any():
        voltage_V, current_A = None, None  # what an unwired input shows is no measurement
    label = f"battery_status[{samples.instance}], id {number}"
    return RawBattery(
        label=label if connected is None or connected.any() else f"{label}, not connected",
        source=f"battery_status[{samples.instance}].current_a",
        time_s=samples.time_s,
        current_A=nan if current_A is None else current_A,
        voltage_V=nan if voltage_V is None else voltage_V,
        charge_C=None if charge_mah is None else charge_mah * MAH_C,
        temperature_K=None if celsius is None else celsius + CELSIUS_K,
        cell_voltage_V=_cells(samples, series),
        series=series,
        capacity_C=_capacity_C(samples, number, parameters),
        serial=_serial(samples, number, topics),
    )


def _constant(samples: Samples, field: str) -> float | None:
    """Last value of a field that describes the pack; None if absent, 0 or unknown."""
    values = samples.get(field)
    if values is None or not np.isfinite(values[-1]) or values[-1] in (0.0, UNKNOWN_UINT16):
        return None
    return float(values[-1])


def _series(samples: Samples, number: int, parameters: Mapping[str, float]) -> int | None:
    """From the topic, else the pack's parameter, else that of firmware with one battery only."""
    names = [f"BAT{number}_N_CELLS"]
    if names[0] not in parameters:
        names.append("BAT_N_CELLS")
    said = [_constant(samples, "cell_count"), *(parameters.get(n) for n in names)]
    return next((int(n) for n in said if n is not None and n > 0), None)


def _capacity_C(samples: Samples, number: int, parameters: Mapping[str, float]) -> float | None:
    name = f"BAT{number}_CAPACITY"
    old = "BAT_CAPACITY" if name not in parameters else name
    said = [parameters.get(name), parameters.get(old), _constant(samples, "capacity")]
    return next((c * MAH_C for c in said if c is not None and c > 0), None)


def _cells(samples: Samples, series: int | None) -> FloatArray | None:
    """(n, cells) where as many cells are measured as the pack has."""
    columns = []
    for i in range(MOST_CELLS):
        values = samples.get(f"voltage_cell_v[{i}]", 0.0)
        if values is None or not np.nanmax(values, initial=0.0) > LEAST_CELL_V:
            break
        columns.append(values)
    enough = len(columns) == series if series else len(columns) >= MULTICELL
    return np.column_stack(columns) if columns and enough else None


def _serial(samples: Samples, number: int, topics: Px4Topics) -> str:
    """Of `battery_info` with its id (its instance where it has none), else of its own topic."""
    for info in topics.logged("battery_info"):
        ids = info.get("id")
        own = np.full(info.time_s.size, info.instance == samples.instance) if ids is None else (
            ids == number
        )  # fmt: skip
        text = _text(info, int(np.flatnonzero(own)[-1])) if own.any() else ""
        if text:
            return text
    told = _constant(samples, "serial_number")
    return "" if told is None else str(int(told))


def _text(info: Samples, row: int) -> str:
    """`serial_number` in a row, as far as it is printable."""
    fields = (info.get(f"serial_number[{i}]") for i in range(SERIAL_LENGTH))
    codes = (int(c[row]) for c in fields if c is not None)
    return bytes(c for c in codes if 32 < c < 127).decode("ascii")
