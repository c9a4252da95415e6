"""One cell of a series that is not like the others: only the pack's voltage is given.

The list was written before any of it was judged; the twin of the Leaf has other tests since the
first run, in which it was missed.

Leaf: 6 pairs of aged cells in series, 1C from rest down to where the first pair is empty. The twin
is that of a single cell of the make (`heat_bases`); its error at 1C, six times over, is that of the
pack. It is as warm at first as the modules' thermocouples say and cools as they show: temperature
is not what is asked for. By the voltages of the pairs two are weak: at the start they rest 40 and
30 mV below the others, at the end the weakest is at 3.00 V and the second at 3.21 V where the
others are at 3.45 V (the single cell, after as much charge, is within 20 mV of those up to 24 Ah).
`weak_cell` has to be named. The others age too: a loss of lithium or of material may be beside it.

Part of the Leaf: three of its pairs in series, one of them weak, as that effect has it; V is the
sum of what was measured on each, under the one current. The twin is that of the other pairs: the
single cell's, fitted to A2; its error on A6 tells by how much pairs differ. What it misses of A2 is
alike in all and adds up, the rest is each pair's own and adds up in squares. The control has the
two good pairs that are left, and nothing to be named. These were written down after the whole
module had been missed, and before any of them was judged; then with a twin of fewer numbers
(windows, capacity, resistance, diffusivities) that missed A2 by 10 mV, and with three times its
error on A6 as that of the series: both weak pairs were `unknown`, as they are now.

Phantom: 4 cells in hover for 93 s. Their voltages differ from their mean by 7 mV and less on
average, one sample of a difference scatters by 6 to 12 mV, since the cells are not read at one
time: nothing that a pack's terminals could show, a control. The twin is fitted to the first 40 s.
"""

import csv
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from proof.question import Question, Recording
from proof.recorded.base import Base
from proof.recorded.calibrated import calibrated, to_digits
from proof.recorded.cooling import cooled
from proof.recorded.heat_bases import CELLS
from proof.recorded.instruments import by_cycler, by_thermocouple
from proof.recorded.leaf_module import DISAGREE, PARALLEL, SERIES, Cells, module
from proof.recorded.measured import NotHere, RealTest, recording
from proof.recorded.trials_ageing import LOSSES, missed
from proof.trial import NoTrial, Trial
from proof.truth import NO_NAME, Channel, Truth
from twin.at_rest import soc_at_rest
from twin.builtin import load_cell
from twin.calibrate.flight import NotFitted, fit_flight
from twin.calibrate.flight_problem import Flown, Known
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating, SeriesResistance
from twin.load import Between, Load
from twin.pack import Pack

BoolArray = npt.NDArray[np.bool_]

EVERY = 6  # samples of the module that are taken
PHANTOM = "battery/dji_phantom/DJIFlightRecord_2015-12-29_center_battery_1Hz.csv"
PHANTOM_ROWS = 36  # of the flight, that the twin is fitted to
LEAF_OF = "Nissan Leaf, aged modules 6s2p (batterysim, MIT)"
FITTED, UNSEEN, OTHERS = "A2", "A6", ("A3", "A5")  # of the pairs that are not weak
Make = Callable[[Path, Path], tuple[Question, Truth]]


def weak_trials(folder: Path, cache: Path) -> tuple[Trial, ...]:
    """Leaf, Phantom and parts of the Leaf."""
    listed: tuple[tuple[str, str, Make], ...] = (
        ("trial-n01", LEAF_OF, _leaf),
        ("trial-n02", "DJI Phantom, 4S in hover (mikeemoo)", _phantom),
        ("trial-n03", LEAF_OF, partial(_part_of_leaf, ("A1",))),
        ("trial-n04", LEAF_OF, partial(_part_of_leaf, ("A4",))),
        ("trial-n05", LEAF_OF, partial(_part_of_leaf, ())),
    )
    return tuple(
        Trial(name=name, source=source, make=partial(_here, make, folder, cache))
        for name, source, make in listed
    )


def _here(make: Make, folder: Path, cache: Path) -> tuple[Question, Truth]:
    try:
        return make(folder, cache)
    except NotHere as e:
        raise NoTrial(str(e)) from e


def _leaf(folder: Path, cache: Path) -> tuple[Question, Truth]:
    cells = module(folder).every(EVERY)
    base = _leaf_cell(cells, folder, cache)
    shown = np.ones(cells.time_s.size, dtype=bool)
    floor_V = SERIES * base.error_V
    pack = _of_cells(in_module(base.pack, cells), base.series_resistance_ohm, cells)
    return _asked(_known(pack), cells, floor_V, pack.initial_K, shown), _truth(
        pack,
        cells,
        floor_V,
        kind="weak cell",
        said="two of six pairs of cells are weak, one more than the other",
        verdicts=("named",),
        effects=(("weak_cell",),),
        also=LOSSES,
    )


def _leaf_cell(cells: Cells, folder: Path, cache: Path) -> Base:
    """The single cell of the make, for the current of the modules."""
    asked_A = float(np.sqrt(np.mean(cells.current_A**2))) / PARALLEL
    return CELLS["leaf"].base(folder, cache, (), asked_A=asked_A)


def _part_of_leaf(weak: tuple[str, ...], folder: Path, cache: Path) -> tuple[Question, Truth]:
    """OTHERS in series with what is weak, by the twin of FITTED."""
    whole = module(folder).every(EVERY)
    single = _leaf_cell(whole, folder, cache)
    start = in_module(single.pack, whole)
    fitted, unseen = (_pair(whole, name) for name in (FITTED, UNSEEN))
    own = replace(fitted, temperature_K=None)  # how it warms is known by now
    test = own.reference(ambient_K=start.initial_K, between=Between.LINEAR)
    found = calibrated(start, [test], cache)
    pair, alike_V = found.pack, found.rms_V[0]
    there = replace(pair, initial_soc=soc_at_rest(pair.cell, float(unseen.voltage_V[0])))
    cells = whole.of((*OTHERS, *weak))
    series = cells.cell_voltage_V.shape[1]
    own_V2 = max(missed(there, unseen) ** 2 - alike_V**2, 0.0)
    floor_V = float(np.hypot(series * alike_V, np.sqrt(series * own_V2)))
    own_ohm = sum(e.resistance_ohm for e in pair.effects if isinstance(e, SeriesResistance))
    pack = _of_cells(pair, own_ohm, cells)
    shown = np.ones(cells.time_s.size, dtype=bool)
    return _asked(_known(pack), cells, floor_V, pack.initial_K, shown), _truth(
        pack,
        cells,
        floor_V,
        kind="weak cell" if weak else "real control",
        said="one of three pairs of cells is weak" if weak else "nothing: two pairs that are alike",
        verdicts=("named",) if weak else NO_NAME,
        effects=(("weak_cell",),) if weak else (),
        also=LOSSES if weak else (),
    )


def in_module(single: Pack, cells: Cells) -> Pack:
    """As warm as the modules were, with the cooling that their thermocouples show."""
    pack = cooled(single, [_pair(cells, FITTED)])
    heating = [
        replace(e, heat_transfer_W_m2_K=to_digits(e.heat_transfer_W_m2_K))
        for e in pack.effects
        if isinstance(e, SelfHeating)
    ]
    others = (e for e in pack.effects if not isinstance(e, SelfHeating))
    return replace(pack, effects=(*others, *heating))


def _known(pack: Pack) -> Pack:
    """The same of a laboratory, which is no question here."""
    return by_thermocouple(by_cycler(pack, voltage=DISAGREE))


def _of_cells(single: Pack, ohm: float, cells: Cells) -> Pack:
    """Pairs of a cell with so much in series, from rest as they were."""
    series = cells.cell_voltage_V.shape[1]
    heating = (e for e in single.effects if isinstance(e, SelfHeating))
    return replace(
        single,
        series=series,
        parallel=PARALLEL,
        initial_soc=soc_at_rest(single.cell, float(cells.voltage_V[0]) / series),
        soc_by_rest=True,
        effects=(
            SeriesResistance(resistance_ohm=ohm * series / PARALLEL),
            *heating,
        ),
    )


def _pair(cells: Cells, name: str) -> RealTest:
    """One of its cells, by itself."""
    return RealTest(
        name=f"pair {name} of the modules",
        time_s=cells.time_s,
        current_A=cells.current_A / PARALLEL,
        voltage_V=cells.of((name,)).voltage_V,
        temperature_K=cells.temperature_K,
    )


def _phantom(folder: Path, cache: Path) -> tuple[Question, Truth]:  # noqa: ARG001
    with recording(folder, PHANTOM).open(newline="") as stream:
        table = np.array(
            [[float(v) for v in row[:8]] for row in list(csv.reader(stream))[1:] if row]
        )
    cells = Cells(
        time_s=table[:, 0] - table[0, 0], current_A=-table[:, 1], cell_voltage_V=table[:, 3:7]
    )
    early = np.arange(cells.time_s.size) < PHANTOM_ROWS
    start_K = float(table[0, 7]) + ZERO_CELSIUS_K
    before = Pack(
        cell=load_cell("lipo_2200"),
        series=4,
        capacity_C=4.349 * 3600,
        initial_soc=0.85,
        initial_K=start_K,
        effects=(SelfHeating(),),
    )
    load = Load(time_s=cells.time_s, current_A=cells.current_A, ambient_K=start_K)
    seen_V = np.where(early, cells.voltage_V, np.nan)
    flown = Flown(load=load, voltage_V=seen_V, in_air=np.ones(early.size, dtype=bool))
    known = Known(soc=True, capacity=True, temperature=True, scale=True, charge=True)
    found = fit_flight(before, flown, known)
    if isinstance(found, NotFitted):
        raise NoTrial(f"the flight's first {PHANTOM_ROWS} s fit no twin: {found.reason}")
    floor_V = found.held_out_after_V
    return _asked(found.pack, cells, floor_V, found.ambient_K, ~early), _truth(
        found.pack,
        cells,
        floor_V,
        kind="real control",
        said="nothing: four cells that differ by 6 mV and less",
        verdicts=NO_NAME,
        effects=(),
    )


def _asked(
    pack: Pack, cells: Cells, floor_V: float, ambient_K: float, shown: BoolArray
) -> Question:
    """One recording, every second block of which is held out."""
    own = Recording(
        name="recording-1",
        time_s=cells.time_s,
        current_A=cells.current_A,
        voltage_V=np.where(shown, cells.voltage_V, np.nan),
    )
    return Question(pack=pack, ambient_K=ambient_K, fitted=(own,), held_out=(), floor_V=floor_V)


def _truth(pack: Pack, cells: Cells, floor_V: float, **more: Any) -> Truth:
    channel = Channel(
        recording="recording-1", time_s=cells.time_s, cell_voltage_V=cells.cell_voltage_V
    )
    whole = RealTest(
        name="pack", time_s=cells.time_s, current_A=cells.current_A, voltage_V=cells.voltage_V
    )
    spread_V = np.ptp(cells.cell_voltage_V, axis=1)
    usual_V = np.median(cells.cell_voltage_V, axis=1)
    lacks_V = cells.voltage_V - cells.cell_voltage_V.shape[1] * usual_V
    return Truth(
        strength=float(np.sqrt(np.mean(lacks_V**2))) / floor_V,
        floor_V=floor_V,
        channels=(channel,),
        details={
            "largest spread of the cells, V": float(spread_V.max()),
            "mean spread, V": float(spread_V.mean()),
            "missed by the twin as given, V rms": missed(pack, whole),
        },
        **more,
    )
