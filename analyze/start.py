"""The pack that is simulated in place of the recorded one, and how each number is known."""

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
import numpy.typing as npt

from flightlogs.log import FloatArray
from flightlogs.quality import resistance
from flightlogs.recording import Recording
from reports.flight import PackUse
from twin.at_rest import OVERFULL, open_circuit_V, soc_at_rest
from twin.cell import Cell
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating
from twin.load_csv import LoadTable
from twin.mismatch import START_SOC, UNTOLD
from twin.mismatch.white import step_V
from twin.pack import Pack, PackError
from twin.pack_file import PackFile, effects_of, mechanics_of

ROOM_K = 298.15
# Of the median current in the air: motors off or idling. Taking the slope's share back leaves a
# few millivolts of slow overpotential, a per cent of charge.
REST_SHARE = 0.25
REST_S = 10.0  # from the first voltage on: later the avionics have drawn charge
REST_SAMPLES = 3
BEYOND_V = 0.02  # a cell: what the voltage dividers of autopilots are off by anyway
QUIET_RATE = 0.005  # C: what a cycler's channel reads at rest
IDLE_RATE = 0.25  # C: what avionics draw before take-off
# Of the quantile of all currents that is STRONG: weaker ones may be the noise of a sensor at rest.
WEAK, STRONG = 0.05, 0.95
SURE = 3.0  # standard errors of a mean
LAST_S = 2.0  # of a rest, whose mean voltage is taken
REST_V = 1e-3  # of a cell: what a voltage at rest is off by beside noise, standard deviation
AROUND = (1.0, 2.0, 3.0)
"""Deviations of that voltage, at which the charge is looked at: a flat curve may become steep just
beside what was read."""
MAD = 1.4826  # standard deviation over the median of sizes, of what is normal
NOISE_SAMPLES = 60  # from the start on, whose changes tell the noise of the voltage
SLOWER = 2.0
"""Times what the slope takes back where a current flows at rest: what slower losses may hide. Of 25
recordings by another simulator (NMC, LG M50 in the cold, a LiPo) the charge at the start was off by
0.5 of the standard deviation that follows, rms, and 1.0 at most; LFP, which is flat, by 0.07: of
that it counts as not told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """A value, where it comes from in words, and whether it is more than an assumption.

    `std` is its standard deviation, where that is asked for.
    """

    value: float
    origin: str
    known: bool = True
    std: float = 0.0


def pack_use(
    recording: Recording | None, file: PackFile | None, cell: Cell, *, builtin: bool,
    table: LoadTable | None = None,
) -> PackUse:  # fmt: skip
    """Every number of the pack: from the pack file, else from the log, else a stated default.

    But a measured temperature and the serial number of a log come before those of the file.
    One of `recording` and `file` may be None; in place of a recording a `table` tells how the pack
    started, where it has temperature and voltage.
    """
    parallel = file.pack.parallel if file else 1
    series, series_origin = _series(recording, file)
    capacity = _capacity(recording, file, cell, parallel)
    measured = recording or table
    start = _temperature(measured, file)
    ambient = _ambient(file, start)
    rest = rest_voltage(recording) if recording else _first_rest(table, capacity.value)
    stated_soc = file.start.soc if file else None
    soc = _soc(rest, stated_soc, cell, series)
    transfer = _heat_transfer(file)
    return PackUse(
        name=file.pack.name if file else "",
        cell=cell.name,
        cell_source=cell.source,
        calibrated=not builtin,
        series=series,
        series_inferred=file is None and recording is not None and recording.series_inferred,
        parallel=parallel,
        capacity_C=capacity.value,
        rated_C=capacity.value if capacity.known else None,
        capacity_known=capacity.known,
        soc_by_rest=stated_soc is None and rest is not None,
        temperature_known=start.known,
        cooling_known=transfer.known,
        serial=(recording.serial if recording else "") or (file.pack.serial if file else ""),
        initial_soc=soc.value,
        soc_std=soc.std if soc.known else UNTOLD,
        initial_K=start.value,
        ambient_K=ambient.value,
        heat_transfer_W_m2_K=transfer.value,
        heat_transfer_std_W_m2_K=file.environment.heat_transfer_std_W_m2_K if file else None,
        standard_errors=file.standard_errors if file else {},
        cell_error_V=1e-3 * ((file.twin.cell_error_mv if file else None) or 0.0),
        effects=effects_of(file),
        mechanics=mechanics_of(file),
        origins={
            "series": series_origin,
            "capacity_C": capacity.origin,
            "initial_soc": soc.origin,
            "initial_K": start.origin,
            "ambient_K": ambient.origin,
            "heat_transfer_W_m2_K": transfer.origin,
        },
    )


def pack_of(use: PackUse, cell: Cell) -> Pack:
    """The same, as the twin takes it; PackError if no cell can start so."""
    pack = Pack(
        cell=cell,
        series=use.series,
        parallel=use.parallel,
        capacity_C=use.capacity_C,
        initial_soc=use.initial_soc,
        soc_by_rest=use.soc_by_rest,
        initial_K=use.initial_K,
        heat_transfer_W_m2_K=use.heat_transfer_W_m2_K if use.cooling_known else None,
        heat_transfer_std_W_m2_K=use.heat_transfer_std_W_m2_K,
        standard_errors=use.standard_errors,
        cell_error_V=use.cell_error_V,
        effects=use.effects,
        mechanics=use.mechanics,
    )
    soc = pack.numbers()["initial_soc"]
    if not 0.0 <= round(soc, 9) <= OVERFULL:
        raise PackError(
            f"the pack starts at {use.shown_soc:.3f} ({use.origins['initial_soc']}), with the "
            f"offset of initial_soc at {soc:.3f}: expected 0 to {OVERFULL:g}"
        )
    return pack


def _series(recording: Recording | None, file: PackFile | None) -> tuple[int, str]:
    if file:
        return file.pack.series, "pack file"
    assert recording is not None  # one of them must say what the pack is
    if recording.series_inferred:
        return recording.series, "cells in series inferred from the voltage"
    return recording.series, "cells in series from the log"


def _capacity(
    recording: Recording | None, file: PackFile | None, cell: Cell, parallel: int
) -> Known:
    if file and file.pack.capacity_ah is not None:
        return Known(value=3600 * file.pack.capacity_ah, origin="pack file")
    if recording and recording.capacity_C is not None:
        doubted = any(w.code == "capacity_doubtful" for w in recording.warnings)
        origin = "parameter in the log" + (", which may be ArduPilot's default" if doubted else "")
        return Known(value=recording.capacity_C, origin=origin, known=not doubted)
    origin = f"not known: that of the cell {cell.name} was taken"
    return Known(value=cell.nominal_capacity_C * parallel, origin=origin, known=False)


def _temperature(measured: Recording | LoadTable | None, file: PackFile | None) -> Known:
    """Of what was measured the median of the first REST_S: a sensor has noise."""
    temperature_K = None if measured is None else measured.temperature_K
    if measured is not None and temperature_K is not None and np.isfinite(temperature_K).any():
        known = np.isfinite(temperature_K)
        early = known & (measured.time_s <= measured.time_s[known][0] + REST_S)
        value = _median(temperature_K[early])
        return Known(value=value, origin="first measured temperature of the pack")
    if file and file.start.temperature_c is not None:
        return Known(value=file.start.temperature_c + ZERO_CELSIUS_K, origin="pack file")
    if file and file.environment.ambient_c is not None:
        ambient_K = file.environment.ambient_c + ZERO_CELSIUS_K
        origin = "not measured: that of the air in the pack file"
        return Known(value=ambient_K, origin=origin, known=False)
    return Known(value=ROOM_K, origin="not measured: 25 °C assumed", known=False)


def _ambient(file: PackFile | None, start: Known) -> Known:
    if file and file.environment.ambient_c is not None:
        return Known(value=file.environment.ambient_c + ZERO_CELSIUS_K, origin="pack file")
    return Known(value=start.value, origin="not known: that of the pack at the start")


def _heat_transfer(file: PackFile | None) -> Known:
    if file and file.environment.heat_transfer_W_m2_K is not None:
        return Known(value=file.environment.heat_transfer_W_m2_K, origin="pack file")
    default = SelfHeating.parameters[0].value
    return Known(value=default, origin="not known: the default of the effect", known=False)


def _soc(rest: Known | None, stated: float | None, cell: Cell, series: int) -> Known:
    if stated is not None:
        return Known(value=stated, origin="pack file", std=START_SOC)
    if rest is None:
        return Known(value=1.0, origin="not known: a full pack assumed", known=False)
    one = rest.value / series
    soc = soc_at_rest(cell, one, OVERFULL)
    beyond = abs(open_circuit_V(cell, min(soc, 1.0)) - one)
    note = f"; the cell cannot have that, {beyond:.3f} V off" if beyond > BEYOND_V else ""
    origin, off_V = f"{rest.origin}, {one:.3f} V a cell{note}", hypot(REST_V, rest.std / series)
    ends = [
        abs(soc_at_rest(cell, one + side * far * off_V, OVERFULL) - soc) / far
        for side in (-1.0, 1.0)
        for far in AROUND
    ]
    return Known(value=soc, origin=origin, known=rest.known, std=max(START_SOC, *ends))


def rest_voltage(recording: Recording) -> Known | None:
    """The pack's voltage without load at the start of the recording, as well as it is known [V].

    Samples of the first REST_S with a voltage, brought to zero current with the slope of voltage on
    current; those at rest if there are any. None without a voltage, or without rest and slope.
    """
    measured = np.isfinite(recording.voltage_V)  # a sensor may have been on before the autopilot
    if not measured.any():
        return None
    early = measured & (recording.time_s <= recording.time_s[measured][0] + REST_S)
    slope = recording.resistance_ohm
    unloaded = recording.voltage_V + (slope or 0.0) * recording.current_A
    flying = recording.current_A[recording.in_air]
    idle_A = REST_SHARE * _median(flying) if flying.size else 0.0
    idle = early & ~recording.in_air & (np.abs(recording.current_A) <= idle_A)
    if np.count_nonzero(idle) >= REST_SAMPLES:
        return Known(
            value=_median(unloaded[idle]),
            origin="from the voltage at rest before take-off",
            std=hypot(
                SLOWER * (_median(unloaded[idle]) - _median(recording.voltage_V[idle])),
                _off_by_noise_V(recording.voltage_V, int(idle.sum())),
            ),
        )
    if np.count_nonzero(early) >= REST_SAMPLES and slope is not None:
        return _under_load(unloaded[early])
    return None


def _first_rest(table: LoadTable | None, capacity_C: float) -> Known | None:
    """The voltage at the end of the rest a table begins with; None if it begins with none [V]."""
    if table is None or table.voltage_V is None:
        return None
    rated_A = capacity_C / 3600
    before = _resting(table.current_A, QUIET_RATE * rated_A)
    known = np.flatnonzero(np.isfinite(table.voltage_V[:before]))
    if not known.size:
        columns = table.time_s, table.current_A, table.voltage_V
        return _idling(*columns, IDLE_RATE * rated_A) or _loaded(*columns)
    last = known[table.time_s[known] >= table.time_s[known[-1]] - LAST_S]
    value, off_V = (
        float(np.mean(table.voltage_V[last])),
        _off_by_noise_V(table.voltage_V, last.size),
    )
    return Known(value=value, origin="from the voltage at rest at the start", std=off_V)


def _idling(
    time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray, most_A: float
) -> Known | None:
    """As `rest_voltage` of a log [V]: before take-off avionics draw little. Columns are (n,).

    Of the first REST_S, no more than `most_A` (median), brought to zero current. None where a load
    is drawn at once, or the voltage does not follow the current.
    """
    size_A = np.abs(current_A)
    idle = np.isfinite(voltage_V)
    idle[_before(size_A > REST_SHARE * float(np.quantile(size_A, STRONG))) :] = False
    idle &= time_s <= time_s[int(np.argmax(idle))] + REST_S
    slope = resistance(time_s, current_A, voltage_V)
    if np.count_nonzero(idle) < REST_SAMPLES or slope is None:
        return None
    if abs(_median(current_A[idle])) > most_A:
        return None
    value = _median(voltage_V[idle] + slope.ohm * current_A[idle])
    return Known(
        value=value,
        origin="from the voltage at the start, where hardly a current flows",
        std=hypot(
            SLOWER * slope.ohm * _median(current_A[idle]),
            _off_by_noise_V(voltage_V, int(idle.sum())),
        ),
    )


def _loaded(time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray) -> Known | None:
    """As `rest_voltage` of a log without a rest [V]. Columns are (n,)."""
    early = np.isfinite(voltage_V)
    early &= time_s <= time_s[int(np.argmax(early))] + REST_S
    slope = resistance(time_s, current_A, voltage_V)
    if np.count_nonzero(early) < REST_SAMPLES or slope is None:
        return None
    return _under_load(voltage_V[early] + slope.ohm * current_A[early])


def _off_by_noise_V(voltage_V: FloatArray, samples: int) -> float:
    """What the mean of so many samples of a voltage is off by, standard deviation.

    Noise by the third differences at its start, which neither a drift nor a step of the current
    moves, and a half of the step in which it was recorded at most.
    """
    known_V = voltage_V[np.isfinite(voltage_V)]
    changes_V = np.diff(known_V[:NOISE_SAMPLES], 3)
    noise_V = MAD * _median(np.abs(changes_V)) / sqrt(20.0) if changes_V.size else 0.0
    return hypot(noise_V / sqrt(samples), step_V(known_V) / sqrt(12.0))


def _under_load(unloaded_V: FloatArray) -> Known:
    return Known(
        value=_median(unloaded_V),
        origin="no rest in it: from the voltage under load, brought to zero current with the slope "
        "of voltage on current, which puts it too low rather than too high",
        known=False,
    )


def _resting(current_A: FloatArray, quiet_A: float) -> int:
    """Samples (n,) before a load begins: all smaller than `quiet_A`, or weak and none on average.

    So noise of the sensor is no load.
    """
    size_A = np.abs(current_A)
    weak_A = WEAK * float(np.quantile(size_A, STRONG))
    counts = [_before(size_A > most_A) for most_A in (quiet_A, max(quiet_A, weak_A))]
    if counts[1] == counts[0]:
        return counts[0]
    longer_A = current_A[: counts[1]]
    error_A = SURE * float(np.std(longer_A)) / np.sqrt(longer_A.size)
    none = abs(float(np.mean(longer_A))) < quiet_A + error_A
    return counts[1] if none else counts[0]


def _before(loaded: npt.NDArray[np.bool_]) -> int:
    return int(np.argmax(loaded)) if loaded.any() else loaded.size


def _median(values: FloatArray) -> float:
    return float(np.median(values))
