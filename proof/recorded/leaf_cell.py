"""One cell of a Nissan Leaf (2013), LiMn2O4 with a nickel oxide against graphite, 33 Ah.

Recordings: batterysim/equiv-circ-model, MIT: a charge and pulses at 25 degC with rests of an hour,
discharges at 1C, 2C and 3C (of 30.6 A) that are repeated five times, and thermocouples beside them.
"""

import csv
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt

from proof.recorded.measured import TICK_S, RealTest, on_one_clock, recording
from twin.bpx_function import Table
from twin.builtin import load_cell
from twin.cell import Cell
from twin.constants import ZERO_CELSIUS_K
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

FOLDER = "battery/leaf/"
PULSES = {10: "10c", 25: "25c-2", 40: "40c-1"}
DISCHARGES = "cell-discharge-bitrode-{}c.csv"
COLUMNS = {"time_s": 1, "step_s": 7, "current_A": 8, "voltage_V": 9}
LATE_S = 0.2  # after the current changed: a first row no later stands for the change
THERMOCOUPLES_S = 3.0  # between their rows, which begin with the cycler's; three are on the cell
ON_CELL = 3
QUIET_A = 0.05
RESTED_S = 3000.0  # an hour less a margin
SLOW_A = (9.0, 11.0)  # of the discharges between the pulses
FLOWS_A = 20.0  # more is a discharge at 1C or faster
MOST_V, LEAST_V = 4.2, 3.0
ROWS = 60  # of the table of a potential
FALL_V = 1e-5  # at least, from row to row
GRAPHITE = (0.06, 0.85)
"""Stoichiometries of the graphite when the cell is empty and full: 3 V is too much to empty it."""


def _whole(folder: Path, file: str) -> RealTest:
    """A whole file, with the changes of the current where they were.

    A row is written at the end of its interval: the first of a step says by its clock how long ago
    the current changed, at rest 60 s. There it gets a row of its own, without a voltage; so does
    the first step of a file that begins within a discharge.
    """
    with recording(folder, FOLDER + file).open(encoding="latin-1", newline="") as stream:
        rows = [row for row in csv.reader(stream) if row and row[0].strip() == "No"]
    table = np.array([[float(row[k]) for k in COLUMNS.values()] for row in rows])
    time_s, step_s, charge_A, voltage_V = table.T
    begins = np.flatnonzero((np.diff(step_s, prepend=np.inf) < 0) & (step_s > LATE_S))
    changed_s = np.where(begins > 0, time_s[begins - 1] + TICK_S, time_s[0] - step_s[0])
    test = RealTest(
        name=file,
        time_s=np.insert(time_s, begins, changed_s),
        current_A=-np.insert(charge_A, begins, charge_A[begins]),
        voltage_V=np.insert(voltage_V, begins, np.nan),
        mount="chamber",
    )
    return on_one_clock(test)


def pulses(folder: Path, degrees: int = 25) -> RealTest:
    """From full and rested: pulses of 30 s at 30 A and 10 s back, 3 Ah at 10 A, a rest, and again.

    Temperature: that of the chamber; the cell warms by less than a degree between the rests.
    """
    whole = _whole(folder, f"cell-low-current-hppc-{PULSES[degrees]}.csv")
    full = int(np.argmax(whole.current_A > FLOWS_A))
    test = replace(whole.part(slice(full - 2, None)), name=f"pulses {degrees} degC")
    return replace(test, temperature_K=np.full(test.time_s.size, degrees + ZERO_CELSIUS_K))


def discharge(folder: Path, times: int, which: int = 0) -> RealTest:
    """A discharge from full at so many C, with the mean of the thermocouples on the cell.

    At 2C and 3C the cell was charged on another channel before the first; there it is the first
    thing. It begins with the current: the cell had not come to rest in the ten minutes before.

    Args:
        folder: of the recordings.
        times: 1, 2 or 3, of 30.6 A.
        which: of the equal discharges of the file, from 0; at 3C only 0 has thermocouples.
    """
    whole = _whole(folder, DISCHARGES.format(times))
    warm = np.genfromtxt(recording(folder, f"{FOLDER}cell-discharge-temperature-{times}c.lvm"))
    flows = (whole.current_A > FLOWS_A).astype(int)
    edges = np.flatnonzero(np.diff(flows, prepend=0, append=0)).reshape(-1, 2)
    first, stop = edges[which].tolist()
    begin_s = whole.time_s[first]
    test = whole.part(slice(first, stop))
    at_s = THERMOCOUPLES_S * np.arange(len(warm))
    on_cell = warm[:, :ON_CELL].mean(axis=1)
    temperature_K = np.interp(test.time_s + begin_s, at_s, on_cell) + ZERO_CELSIUS_K
    name = f"{times}C, {which + 1}" if which else f"{times}C"
    return replace(test, name=name, temperature_K=temperature_K)


def open_circuit(test: RealTest) -> tuple[FloatArray, FloatArray]:
    """(charge drawn [C], voltage [V]) of a cell at rest, along its pulse test.

    At the rests it is the last voltage; along the slow discharge between two of them the voltage,
    raised by what it lacks at both ends, straight in between. The last discharge, which no rest
    follows, is raised by what it lacks where it began.
    """
    slow = (test.current_A > SLOW_A[0]) & (test.current_A < SLOW_A[1])
    slow &= np.isfinite(test.voltage_V)
    edges = np.flatnonzero(np.diff(slow.astype(int), prepend=0, append=0)).reshape(-1, 2)
    spans = [(a, b - 1) for a, b in edges.tolist() if test.time_s[b - 1] - test.time_s[a] > 300.0]
    rests = _rests(test)
    drawn, volts = [0.0], [float(test.voltage_V[0])]
    lacks = 0.0
    for a, b in spans:
        before = max((r for r in rests if r <= a), default=0)
        after = min((r for r in rests if r > b), default=None)
        if after is not None:
            lacks = float(test.voltage_V[after] - test.voltage_V[b])
        start = float(test.voltage_V[before] - test.voltage_V[a]) if not drawn[1:] else lacks
        share = (test.drawn_C[a : b + 1] - test.drawn_C[a]) / np.ptp(test.drawn_C[a : b + 1])
        raised = test.voltage_V[a : b + 1] + start + (lacks - start) * share
        kept = np.linspace(len(raised) // 4, len(raised) - 1, 7).astype(int)  # the pulse fades
        drawn += test.drawn_C[a : b + 1][kept].tolist()
        volts += raised[kept].tolist()
    order = np.argsort(drawn)
    return np.array(drawn)[order], np.minimum.accumulate(np.array(volts)[order])


def _rests(test: RealTest) -> list[int]:
    """Last sample of each rest of an hour."""
    quiet = np.abs(test.current_A) < QUIET_A
    edges = np.flatnonzero(np.diff(quiet.astype(int), prepend=0, append=0)).reshape(-1, 2)
    return [b - 1 for a, b in edges.tolist() if test.time_s[b - 1] - test.time_s[a] > RESTED_S]


def start_cell(test: RealTest) -> Pack:
    """A LG M50 with the capacity of this cell and a positive electrode of its own potential.

    That is the open-circuit voltage of the cell plus the potential of the graphite at the same
    charge, over GRAPHITE; the calibration moves the windows. Beyond what was drawn, straight; full
    is MOST_V, to which all discharges were charged: before the pulses the cell rested below it.
    """
    drawn_C, rest_V = open_circuit(test)
    above_C = (MOST_V - rest_V[0]) * (drawn_C[1] - drawn_C[0]) / (rest_V[0] - rest_V[1])
    drawn_C, rest_V = np.append(0.0, drawn_C + above_C), np.append(MOST_V, rest_V)
    cell = load_cell("lg_m50")
    whole_C = float(drawn_C[-1])
    soc = np.linspace(1.0, 0.0, ROWS)
    volts = np.interp((1.0 - soc) * whole_C, drawn_C, rest_V)
    return Pack(cell=_with_potential(cell, soc, volts), capacity_C=whole_C)


def _with_potential(cell: Cell, soc: FloatArray, rest_V: FloatArray) -> Cell:
    """The cell that rests at `rest_V` (n,) at these states of charge (n,), falling."""
    n = replace(cell.negative, stoichiometry_min=GRAPHITE[0], stoichiometry_max=GRAPHITE[1])
    p = cell.positive
    x = n.stoichiometry_min + soc * (n.stoichiometry_max - n.stoichiometry_min)
    y = p.stoichiometry_max - soc * (p.stoichiometry_max - p.stoichiometry_min)
    graphite_V = np.array([float(ca.evalf(n.ocp_V(ca.SX(v)))) for v in x.tolist()])
    falling_V = np.minimum.accumulate(rest_V + graphite_V) - FALL_V * np.arange(y.size)
    own = Table(x=tuple(y.tolist()), y=tuple(falling_V.tolist()))
    return replace(
        cell,
        name="Nissan Leaf cell, to start from",
        negative=n,
        positive=replace(p, ocp_V=own),
        lower_cut_off_V=LEAST_V,
        upper_cut_off_V=MOST_V,
    )
