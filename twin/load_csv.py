"""A load from a CSV file: time and current, and the voltage and what else was measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np
import numpy.typing as npt

from twin.columns import (
    KELVIN,
    FloatArray,
    Lines,
    TableError,
    cells_of_a_pack,
    column,
    not_there,
    places_of,
    table_lines,
    untaken_temperature,
)
from twin.load import Between, Load
from twin.sign import discharge_sign

FEW = 0.25  # a clock too coarse for its lines has more times that are there twice
BRIEF = 1e-3  # of an interval: how long before a step the line is that has the time of it
STEPS = "Lines with the time of the line after them, but another current, count as just before it:"
MOST_S = 50 * 86400.0  # longer is a clock that was set, or in another unit
NO_VOLTAGE = "Lines with a voltage of 0 V, which a sensor that dropped out writes, taken for none:"
NO_TEMPERATURE = "Lines with a temperature that no pack can have, taken for none:"
TURNED = "In this file discharge current is negative, as its voltage shows: it was turned round."


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadTable:
    """The columns of a file, SI, discharge positive.

    NaN is where a cell is empty, None where there is no such column.

    Attributes:
        time_s: (n,) increasing.
        current_A: (n,)
        voltage_V: (n,) at the terminals.
        temperature_K: (n,) of the pack.
        cell_voltage_V: (n, cells)
        remarks: what was left out or turned round, in words.
    """

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray | None
    temperature_K: FloatArray | None = None
    cell_voltage_V: FloatArray | None = None
    remarks: tuple[str, ...] = ()

    def load(self, *, between: Between, ambient_K: float) -> Load:
        """As the twin takes it; LoadError if it cannot."""
        return Load(
            time_s=self.time_s, current_A=self.current_A, between=between, ambient_K=ambient_K
        )


def read_load_csv(stream: TextIO, *, name: str) -> LoadTable:
    """Columns by what their header says of quantity and unit: "Current / A", "I[A]", "Time (s)".

    Discharge current is positive; where the voltage says that it is negative, it is turned round.
    Lines without time or current are left out, and a voltage of exactly 0 is none. Of lines with
    one time the last counts, and where the current steps there, as cyclers write it, the first,
    just before. Cells of which each has a column ("Cell 1 / V") make the pack's
    voltage where no other column has it.

    Raises:
        TableError: it is empty or no CSV, a column is missing or there twice, no line has a time
            and a current, a cell is no number, a clock goes back or is months long; with the line
            where there is one.
    """
    header, lines = table_lines(stream, name=name)
    of_cells = cells_of_a_pack(header, name)
    if not lines and not any(title.strip() for title in header):
        raise TableError(f"{name}: the file is empty; expected a recording of time and current")
    places = places_of(header, of_cells)
    if lacking := [ours for ours in ("time_s", "current_A") if ours not in places]:
        raise TableError(f"{name}: {not_there(lacking, header)}")
    read = [q for q in places if q != "ambient_K"]  # that of the air nobody asks for
    columns = {q: column(lines, places[q], q, name) for q in read}
    needed = {"a time": columns["time_s"], "a current": columns["current_A"]}
    kept, left_out = kept_lines(lines, needed, name)
    columns = {q: values[kept] for q, values in columns.items()}
    cells_V, dead = living(
        [column(lines, p, f"cell {k}", name)[kept] for k, p in enumerate(of_cells, start=1)]
    )
    voltage_V = columns.get("voltage_V")
    if voltage_V is not None and (cells_V is None or np.isfinite(voltage_V).any()):
        dead = dead | (voltage_V == 0.0)
        voltage_V = np.where(voltage_V == 0.0, np.nan, voltage_V)
    elif cells_V is not None:
        voltage_V = cells_V.sum(axis=1)
    temperature_K, strange = possible_K(columns.get("temperature_K"))
    (time_s, steps), current_A = rising(columns["time_s"]), columns["current_A"]
    turned = voltage_V is not None and discharge_sign(time_s, current_A, voltage_V) < 0
    title = untaken_temperature(header, places)
    unread = f"{title!r} is a temperature in no unit that is known (degC or K): it was not read."
    return LoadTable(
        time_s=time_s,
        current_A=-current_A if turned else current_A,
        voltage_V=voltage_V,
        temperature_K=temperature_K,
        cell_voltage_V=cells_V,
        remarks=(
            *left_out,
            *((f"{STEPS} {steps}.",) if steps else ()),
            *((TURNED,) if turned else ()),
            *((f"{NO_VOLTAGE} {np.count_nonzero(dead)}.",) if np.any(dead) else ()),
            *((f"{NO_TEMPERATURE} {strange}.",) if strange else ()),
            *_without_voltage(voltage_V),
            *((unread,) if title else ()),
        ),
    )


def kept_lines(
    lines: Lines, needed: Mapping[str, FloatArray], name: str
) -> tuple[npt.NDArray[np.intp], tuple[str, ...]]:
    """Which of all lines have what is `needed`, and what is to be said of the others.

    The first of it is the time: of lines with one the last counts, and the first if what else is
    needed steps there: two lines have that time, and few times are of two. TableError if there is
    no such line, or the clock is no clock.
    """
    time_s, *others = needed.values()
    whole = np.flatnonzero(np.all(np.isfinite([*needed.values()]), axis=0))
    if not whole.size:
        raise TableError(f"{name}: no line has {' and '.join(needed)}")
    _check_clock(time_s[whole], [lines[k][0] for k in whole.tolist()], name)
    rises = np.diff(time_s[whole]) > 0
    first, last = np.append(True, rises), np.append(rises, True)
    before = first & ~last & np.append(last[1:], True)
    if np.count_nonzero(before) < FEW * np.count_nonzero(last):
        steps = [np.append(np.diff(own[whole]) != 0, False) for own in others]
        last |= before & np.any(steps or [np.zeros_like(last)], axis=0)
    kept = whole[last]
    return kept, (
        *_left_out(len(lines) - whole.size, "have no time, or no current that can flow,"),
        *_left_out(whole.size - kept.size, "have the time of the line after them"),
    )


def rising(time_s: FloatArray) -> tuple[FloatArray, int]:
    """(n,) of two times that are one the first a little before; and how many are so.

    BRIEF of the interval before it, at the start of that after both.
    """
    same = np.append(np.diff(time_s) == 0, False)
    before_s = np.diff(time_s, prepend=time_s[0] - np.max(np.diff(time_s[:3]), initial=0.0))
    return time_s - BRIEF * before_s * same, int(same.sum())


def possible_K(kelvin: FloatArray | None) -> tuple[FloatArray | None, int]:
    """NaN for temperatures that no pack can have, as loggers write for none; how many were."""
    if kelvin is None:
        return None, 0
    strange = (kelvin < KELVIN[0]) | (kelvin > KELVIN[1])
    return np.where(strange, np.nan, kelvin), int(strange.sum())


def living(cells: Sequence[FloatArray]) -> tuple[FloatArray | None, npt.NDArray[np.bool_]]:
    """(n, cells) without those that are 0 V or blank throughout; (n,) where another is 0 V."""
    there = [own for own in cells if np.any(np.isfinite(own) & (own != 0.0))]
    if not there:
        return None, np.zeros(1, dtype=bool)
    cells_V = np.column_stack(there)
    return np.where(cells_V == 0.0, np.nan, cells_V), np.any(cells_V == 0.0, axis=1)


def _without_voltage(voltage_V: FloatArray | None) -> tuple[str, ...]:
    count = 0 if voltage_V is None else int(np.isnan(voltage_V).sum())
    if voltage_V is None or not count:
        return ()
    if count == voltage_V.size:
        return ("No line has a voltage, which would say if positive current discharges: so taken.",)
    return (f"Lines without a voltage, where nothing is compared with it: {count}.",)


def _left_out(count: int, why: str) -> tuple[str, ...]:
    return (f"Lines that {why} are left out: {count}.",) if count else ()


def _check_clock(time_s: FloatArray, numbers: Sequence[int], name: str) -> None:
    if (back := np.flatnonzero(np.diff(time_s) < 0)).size:
        at = int(back[0])
        all_of_it = "; it runs backwards throughout" if back.size == time_s.size - 1 else ""
        raise TableError(
            f"{name}, line {numbers[at + 1]}: the clock goes back, from {time_s[at]:g} s to "
            f"{time_s[at + 1]:g} s ({back.size} such lines{all_of_it}): give one recording with "
            "its lines in order"
        )
    if (whole_s := float(np.ptp(time_s))) > MOST_S:
        at = int(np.argmax(np.diff(time_s)))
        raise TableError(
            f"{name}: {whole_s / 86400:.0f} days long, expected {MOST_S / 86400:.0f} or less; the "
            f"longest pause, {time_s[at + 1] - time_s[at]:.3g} s, is before line "
            f"{numbers[at + 1]}: was its clock set there, or is its time not in the unit that its "
            "header says?"
        )
