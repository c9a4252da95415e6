"""Batteries in MAVLink telemetry: BATTERY_STATUS by sender and id, else SYS_STATUS.

    field                unit     not measured
    current_battery      cA       -1; the rails of its 16 bits, 327.67 A, are counted
    voltages[10]         mV       65535; 0
    voltages_ext[4]      mV       0
    voltage_battery      mV       65535; 0
    current_consumed     mAh      -1
    temperature          cdegC    32767

Without cells the pack's total stands in `voltages[0]`, split at 65534 mV over those that follow.
Older PX4 divided the total evenly: equal cells at all times give the count, not a measurement.

Source: MAVLink common.xml, BATTERY_STATUS and SYS_STATUS.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from flightlogs import ardupilot
from flightlogs.log import FloatArray
from flightlogs.measured import CELSIUS_K, MAH_C, RawBattery
from flightlogs.table import Table
from flightlogs.tlog_packets import COMPONENT

CENTI, MILLI = 0.01, 1e-3
INT16_MAX, UINT16_MAX = 32767, 65535
CELL_MAX_MV = 5000  # no lithium cell is above: a larger first value is the pack's total
AUTOPILOT_COMPONENT = 1
INFO = ("BATTERY_INFO", "SMART_BATTERY_INFO")

Timed = Mapping[str, tuple[Table, FloatArray]]


def raw_batteries(timed: Timed, parameters: Mapping[str, float]) -> tuple[RawBattery, ...]:
    """Every battery in order of appearance; SYS_STATUS only where BATTERY_STATUS has no current."""
    single = _from_status(timed, parameters)
    several = _from_batteries(timed, parameters)
    if single is None or any(_has_current(b) for b in several):
        return several
    return (single,) if _has_current(single) or not several else several


def _has_current(battery: RawBattery) -> bool:
    return bool(np.any(battery.current_A > 0))


def _unless(values: FloatArray, sentinel: npt.NDArray[np.bool_]) -> FloatArray:
    return np.where(sentinel, np.nan, values)


def _current_A(centi: FloatArray) -> FloatArray:
    return _unless(centi * CENTI, (centi == -1) | _at_rail(centi))


def _at_rail(centi: FloatArray) -> npt.NDArray[np.bool_]:
    return np.abs(centi) >= INT16_MAX


def _from_status(timed: Timed, parameters: Mapping[str, float]) -> RawBattery | None:
    if "SYS_STATUS" not in timed:
        return None
    table, time_s = timed["SYS_STATUS"]
    own = table.numbers[COMPONENT] == AUTOPILOT_COMPONENT
    table, time_s = (table.select(own), time_s[own]) if own.any() else (table, time_s)
    mV = table.numbers["voltage_battery"]
    return RawBattery(
        label="SYS_STATUS",
        source="SYS_STATUS.current_battery",
        time_s=time_s,
        current_A=_current_A(table.numbers["current_battery"]),
        saturated=int(_at_rail(table.numbers["current_battery"]).sum()),
        voltage_V=_unless(mV * MILLI, (mV == UINT16_MAX) | (mV == 0)),
        series=_series(parameters, 0),
        capacity_C=_capacity_C(parameters, 0),
        serial=ardupilot.serial(parameters, 0),
    )


def _from_batteries(timed: Timed, parameters: Mapping[str, float]) -> tuple[RawBattery, ...]:
    if "BATTERY_STATUS" not in timed:
        return ()
    table, time_s = timed["BATTERY_STATUS"]
    senders = np.column_stack([table.numbers[COMPONENT], table.numbers["id"]]).astype(int)
    found = []
    for component, number in dict.fromkeys(map(tuple, senders.tolist())):
        rows = (senders == (component, number)).all(axis=1)
        sender = "" if component == AUTOPILOT_COMPONENT else f" of component {component}"
        label = f"BATTERY_STATUS[{number}]{sender}"
        serial = _serial(timed, number) or ardupilot.serial(parameters, number)
        found.append(_battery(label, table.select(rows), time_s[rows], serial, parameters))
    return tuple(found)


def _battery(
    label: str, table: Table, time_s: FloatArray, serial: str, parameters: Mapping[str, float]
) -> RawBattery:
    number = int(table.numbers["id"][0])
    voltage_V, cells_V, series = pack_voltage(
        table.numbers["voltages"], table.numbers["voltages_ext"]
    )
    consumed, centi = table.numbers["current_consumed"], table.numbers["temperature"]
    return RawBattery(
        label=label,
        source=f"{label}.current_battery",
        time_s=time_s,
        current_A=_current_A(table.numbers["current_battery"]),
        saturated=int(_at_rail(table.numbers["current_battery"]).sum()),
        voltage_V=voltage_V,
        charge_C=_unless(consumed * MAH_C, consumed == -1),
        temperature_K=_unless(centi * CENTI + CELSIUS_K, centi == INT16_MAX),
        cell_voltage_V=cells_V,
        series=series or _series(parameters, number),
        capacity_C=_capacity_C(parameters, number),
        serial=serial,
    )


def pack_voltage(
    voltages_mV: FloatArray, extra_mV: FloatArray
) -> tuple[FloatArray, FloatArray | None, int | None]:
    """Pack voltage and cells.

    Args:
        voltages_mV: (n, 10) as sent.
        extra_mV: (n, 4) as sent: cells 11 to 14.

    Returns:
        (n,) pack voltage [V]; (n, cells) [V] if they were measured one by one, else None; the
        number of cells if the message tells, else None.
    """
    main = _unless(voltages_mV, (voltages_mV >= UINT16_MAX) | (voltages_mV == 0))
    all_mV = np.hstack([main, _unless(extra_mV, extra_mV == 0)])
    known = np.isfinite(all_mV)
    total_V = np.where(known.any(axis=1), np.nansum(all_mV, axis=1) * MILLI, np.nan)
    used = known.any(axis=0)
    if used.sum() < 2 or np.any(all_mV[known] > CELL_MAX_MV):
        return total_V, None, None
    cells_V = all_mV[:, used] * MILLI
    whole = known[:, used].all(axis=1)
    total_V = np.where(whole, total_V, np.nan)  # a missing cell would make the pack look flat
    even = np.all(np.ptp(cells_V[whole], axis=1) <= MILLI) if whole.any() else True
    return total_V, None if even else cells_V, int(used.sum())


def _serial(timed: Timed, number: int) -> str:
    for name in INFO:
        if name in timed:
            table = timed[name][0]
            rows = np.flatnonzero(table.numbers["id"] == number)
            texts = [table.texts["serial_number"][i].strip() for i in rows]
            if found := next((t for t in texts if t), ""):
                return found
    return ""


def _series(parameters: Mapping[str, float], number: int) -> int | None:
    for name in (f"BAT{number + 1}_N_CELLS", "BAT_N_CELLS"):
        if parameters.get(name, 0) > 0:
            return int(parameters[name])
    return None


def _capacity_C(parameters: Mapping[str, float], number: int) -> float | None:
    for name in (f"BAT{number + 1}_CAPACITY", "BAT_CAPACITY"):
        if parameters.get(name, 0) > 0:
            return parameters[name] * MAH_C
    return ardupilot.capacity_C(parameters, number)
