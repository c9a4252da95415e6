"""What a battery channel really measured: sentinels and dead sensors become NaN or None."""

from dataclasses import dataclass, field

import numpy as np

from flightlogs import quality
from flightlogs.errors import LogWarning
from flightlogs.log import BatteryLog, FloatArray
from flightlogs.stamps import increasing

CELSIUS_K = 273.15
MAH_C = 3.6
DEAD_VOLTAGE_V = 1.0  # no pack that flies is below: the sensor is not wired
IMPOSSIBLE_A, IMPOSSIBLE_V = 2000.0, 1000.0  # beyond any multirotor: the bytes were damaged
COLDEST_K, HOTTEST_K = 213.15, 393.15
"""-60 degC: the electrolyte is frozen; 120 degC: separators melt. No cell flies beyond either."""
NEAR_ZERO_K = 3.0  # a pack that passes through 0 degC is measured beside it, too
LEAST_FLYING_A = 1.0  # less carries no multirotor, reversed or not: a zero that is off
STILL_VOLTAGE = 0.03  # share of its median within which an unloaded or unwired voltage stays


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawBattery:
    """One battery in SI, its unmeasured samples NaN, nothing judged yet.

    Attributes:
        label: how the log calls it.
        source: topic and field of the current.
        time_s: (n,) in file order, NaN where the stamp was stray.
        current_A: (n,) discharge positive.
        voltage_V: (n,).
        charge_C: (n,) the log's own counter, or None.
        temperature_K: (n,), or None.
        cell_voltage_V: (n, cells), or None.
        series: cells in series if the log says so.
        capacity_C: from the parameters.
        serial: serial number or "".
        saturated: samples of the current at the end of what the format carries, which are NaN.
    """

    label: str
    source: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    charge_C: FloatArray | None = None
    temperature_K: FloatArray | None = None
    cell_voltage_V: FloatArray | None = None
    series: int | None = None
    capacity_C: float | None = None
    serial: str = ""
    saturated: int = 0


@dataclass(slots=True)
class _Judge:
    label: str
    warnings: list[LogWarning] = field(default_factory=list)

    def warn(self, code: str, message: str) -> None:
        self.warnings.append(LogWarning(code, message, self.label))

    def possible(self, values: FloatArray, limit: float, unit: str) -> FloatArray:
        """NaN for what no sensor can have said."""
        absurd = np.abs(values) > limit
        if absurd.any():
            message = f"{int(absurd.sum())} samples beyond {limit:g} {unit} were left out"
            self.warn("impossible_values", message)
        return np.where(absurd | ~np.isfinite(values), np.nan, values)

    def current(
        self, time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray
    ) -> FloatArray | None:
        current_A = self.possible(current_A, IMPOSSIBLE_A, "A")
        if reversed_current(time_s, current_A, voltage_V):
            message = (
                f"the log counts discharge negative (down to {np.nanmin(current_A):.1f} A, and the "
                "voltage falls with it): sign turned. Correct the current sensor, or its scale"
            )
            self.warn("current_sign_turned", message)
            current_A = -current_A
        known = current_A[np.isfinite(current_A)]
        if known.size and known.max() > 0:
            return current_A
        said = (
            f"{known.min():g} to {known.max():g} A throughout" if known.size else "always unknown"
        )
        self.warn("current_not_measured", f"the current is {said}: taken as not measured")
        return None

    def voltage(self, voltage_V: FloatArray, *, loaded: bool) -> FloatArray | None:
        voltage_V = self.possible(voltage_V, IMPOSSIBLE_V, "V")
        voltage_V = np.where(voltage_V > 0, voltage_V, np.nan)
        known = voltage_V[np.isfinite(voltage_V)]
        if not known.size or known.max() < DEAD_VOLTAGE_V:
            top = f"never above {known.max():g} V" if known.size else "always zero or unknown"
            self.warn("voltage_not_measured", f"the voltage is {top}: taken as not measured")
            return None
        low, middle, high = np.percentile(known, [1, 50, 99])
        if not loaded and high - low < STILL_VOLTAGE * middle:
            said = f"{low:.2f} to {high:.2f} V without a current to explain it"
            self.warn("voltage_doubtful", f"the voltage hardly moves ({said}): sensor pins wrong?")
        return voltage_V

    def temperature(self, temperature_K: FloatArray | None) -> FloatArray | None:
        """NaN where nothing can have measured it; None where nothing ever did.

        Exactly 0 degC stands for "no answer yet" where no other value comes near it.
        """
        if temperature_K is None:
            return None
        beyond = (temperature_K < COLDEST_K) | (temperature_K > HOTTEST_K)
        if beyond.any():
            low, high = COLDEST_K - CELSIUS_K, HOTTEST_K - CELSIUS_K
            message = f"{int(beyond.sum())} temperatures outside {low:g} to {high:g} degC"
            self.warn("impossible_values", f"{message} were left out")
        temperature_K = np.where(beyond, np.nan, temperature_K)
        zero = temperature_K == CELSIUS_K
        others = temperature_K[np.isfinite(temperature_K) & ~zero]
        if not others.size:
            return None
        if not zero.any() or np.min(np.abs(others - CELSIUS_K)) < NEAR_ZERO_K:
            return temperature_K
        message = f"{int(zero.sum())} samples of exactly 0 degC were left out: no other is near it"
        self.warn("temperature_not_measured", message)
        return np.where(zero, np.nan, temperature_K)

    def charge(self, charge_C: FloatArray | None) -> FloatArray | None:
        """None for a counter that never moves."""
        if charge_C is None:
            return None
        known = charge_C[np.isfinite(charge_C)]
        return charge_C if known.size and np.ptp(known) > 0 else None


def reversed_current(time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray) -> bool:
    """Whether (n,) currents are mostly negative and the voltage (n,) falls the more they are.

    A pack that is charged has negative currents too, but its voltage rises with them; a sensor
    whose zero is off reads less where more is drawn only if it is reversed as well.
    """
    known = current_A[np.isfinite(current_A)]
    if not known.size:
        return False
    low, high = np.percentile(known, [5, 95])
    if -low <= max(float(high), LEAST_FLYING_A):
        return False
    volts = np.where(voltage_V > DEAD_VOLTAGE_V, voltage_V, np.nan)
    return quality.resistance(time_s, -current_A, volts) is not None


def battery_log(raw: RawBattery, instance: int) -> tuple[BatteryLog, tuple[LogWarning, ...]]:
    """The battery, its unmeasured channels None and its times increasing, and the warnings."""
    judge = _Judge(raw.label)
    if raw.saturated:
        judge.warn(
            "current_saturated",
            f"{raw.saturated} samples stand at the most that this log can carry: they were left "
            "out, and the current is straight between their neighbours; more may have flowed "
            "there, and neither charge nor damage counts it",
        )
    kept = increasing(raw.time_s)
    if dropped := int(kept.size - kept.sum()):
        judge.warn(
            "samples_out_of_order", f"{dropped} samples left out: their time did not advance"
        )

    def rows(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[kept]

    current_A = judge.current(raw.time_s[kept], raw.current_A[kept], raw.voltage_V[kept])
    battery = BatteryLog(
        instance=instance,
        label=raw.label,
        time_s=raw.time_s[kept],
        current_A=current_A,
        voltage_V=judge.voltage(raw.voltage_V[kept], loaded=current_A is not None),
        temperature_K=judge.temperature(rows(raw.temperature_K)),
        cell_voltage_V=rows(raw.cell_voltage_V),
        charge_C=judge.charge(rows(raw.charge_C)),
        series=raw.series,
        capacity_C=raw.capacity_C,
        serial=raw.serial,
        current_source=raw.source,
    )
    return battery, tuple(judge.warnings)
