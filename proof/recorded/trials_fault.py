"""A known fault of the current sensor in real recordings: gain, offset, clock; and none.

The list, one line a trial: where a flight or a cycle draws enough charge to tell, a gain or an
offset; where the current is lively, a clock. Sizes make the twin miss the recording by three times
what it misses it by without the fault; they and the faults were chosen by that alone. The list was
written before its trials were judged, but for two: k01 and k05 had been tried before it was. The
size of k09 was changed from 1.5 to 2.5 s, by its strength, before it was judged; when it had been,
its clock was put into the samples instead of their means, which that had smoothed. k12 to k15 are
blind: two flights of octocopters that no trial had used, written down before they were run, run
once; for a moment the voltage of one falls by 4 V where the recorded current does not rise, which
it is missed by most. Left out are a lag or a clock in log171, log_0036 (rough samples), both
octocopters (70 s and 52 s) and the NMC pouch (2 mOhm under a current that changes slowly): up to
1 s (2 s) of lag changes by how much those are missed by less than that. Not used further: flights
whose current is wrong already, one that only hovers (sample02), one whose current disagrees with
its motor controllers (ekf_failure). k16 to k23 are all of these recordings without a fault, written
down before any was run.
"""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from analyze.pipeline import Source, read_flight
from analyze.replaying import in_flight, measured_V
from analyze.start import pack_of
from proof.question import Question
from proof.recorded import about_energy, panasonic
from proof.recorded.base import ROOM_K
from proof.recorded.blocks import Fitted, Part, Run, fitted
from proof.recorded.heat_bases import CELLS
from proof.recorded.measured import FloatArray, NotHere, RealTest, recording
from proof.recorded.thinned import binned
from proof.simulated.effects import LIBRARY
from proof.simulated.faults import FAULTS, Traces
from proof.trial import NoTrial, Trial
from proof.truth import NO_NAME, Number, Truth
from twin.at_rest import soc_at_rest
from twin.calibrate.flight_problem import Known
from twin.effects import ClockShift
from twin.pack import Pack

LABORATORY = Known(soc=True, capacity=True, temperature=True, scale=True, charge=True)
PERIOD_S = 2.0  # of the means that are taken of a drive cycle, for speed
FLIGHT_ROUNDS, CYCLE_ROUNDS = 3, 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """What was done to a current; `size` as `proof.simulated.faults` takes it, 0: nothing."""

    source: str
    effect: str = ""
    size: float = 0.0


LOGS = {
    "underpowered": "1002victor__ardupilot/underpowered.log",
    "log171": "dronekit__dronekit-la-testdata/log171.bin",
    "log_0036": "BeastAyyG__ardupilot-log-diagnosis/log_0036_mechanical_failure.bin",
    "log_0039": "BeastAyyG__ardupilot-log-diagnosis/log_0039_mechanical_failure.bin",
    "px4log": "dronecrew__px4tools/01_07_59.px4log",
    "log_123": "FSYR-H__PX4_Ulog_Tools/log_123_2024-3-1-14-47-02.ulg",
}
LIST = (
    Fault(source="underpowered", effect="current_gain", size=0.08),
    Fault(source="underpowered", effect="current_offset", size=1.5),
    Fault(source="log171", effect="current_gain", size=-0.25),
    Fault(source="log_0036", effect="current_gain", size=-0.5),
    Fault(source="log_0039", effect="clock_shift", size=0.5),
    Fault(source="log_0039", effect="clock_shift", size=-0.5),
    Fault(source="log_0039", effect="current_offset", size=6.0),
    Fault(source="panasonic", effect="current_gain", size=0.08),
    Fault(source="panasonic", effect="clock_shift", size=2.5),
    Fault(source="nmc", effect="current_gain", size=0.08),
    Fault(source="nmc", effect="current_offset", size=0.5),
    Fault(source="px4log", effect="current_gain", size=-0.45),
    Fault(source="px4log", effect="current_offset", size=12.0),
    Fault(source="log_123", effect="current_gain", size=-0.25),
    Fault(source="log_123", effect="current_offset", size=10.0),
    *(Fault(source=name) for name in (*LOGS, "panasonic", "nmc")),
)

SAID = {
    "underpowered": "3S LiPo, a whole discharge at 1 Hz (ArduPilot, GPL-3)",
    "log171": "4S LiPo at 10 Hz (dronekit, CC BY-SA 3.0)",
    "log_0036": "4S LiPo at 10 Hz, until it fell (BeastAyyG)",
    "log_0039": "3S LiPo at 10 Hz, until a motor failed (BeastAyyG)",
    "px4log": "6S LiPo of a coaxial octocopter at 80 Hz (dronecrew, BSD-3)",
    "log_123": "6S LiPo of an octocopter at 5 Hz (FSYR-H, Apache-2.0)",
    "panasonic": "Panasonic NCR18650PF, US06 at 25 degC (Kollmeyer)",
    "nmc": "NMC111 pouch, drive cycle, published BPX (About:Energy)",
}


def fault_trials(folder: Path, cache: Path) -> tuple[Trial, ...]:
    """All of LIST."""
    return tuple(
        Trial(
            name=f"trial-k{k:02d}",
            source=SAID[fault.source],
            make=partial(_made, fault, folder, cache),
        )
        for k, fault in enumerate(LIST, start=1)
    )


def _made(fault: Fault, folder: Path, cache: Path) -> tuple[Question, Truth]:
    try:
        run = run_of(fault.source, folder, cache)
    except NotHere as e:
        raise NoTrial(str(e)) from e
    base = fitted(run)
    wrong_A = faulty(run, fault)
    question = Question(
        pack=base.pack,
        ambient_K=base.ambient_K,
        fitted=(run.recording(Part.FITTED, "first", wrong_A),),
        held_out=(run.recording(Part.HELD_OUT, "second", wrong_A),),
        floor_V=base.floor_V(),
    )
    return question, _truth(fault, base, wrong_A)


def _truth(fault: Fault, base: Fitted, wrong_A: FloatArray) -> Truth:
    with_V, without_V = (
        base.error_V(Part.FITTED, amperes) for amperes in (wrong_A, base.run.current_A)
    )
    floor_V = base.floor_V()
    truth = Truth(
        kind="real control",
        said="nothing: the current as it was recorded",
        verdicts=NO_NAME,
        effects=(),
        strength=without_V / floor_V,
        floor_V=floor_V,
        noise_V=base.noise_V(Part.HELD_OUT),
        details={
            "missed with the fault, V rms": with_V,
            "missed without it, V rms": without_V,
            "missed where it was not fitted, V rms": base.error_V(Part.FLOOR, base.run.current_A),
        },
    )
    if not fault.effect:
        return truth
    change_V = base.residual_V(Part.FITTED, wrong_A) - base.residual_V(
        Part.FITTED, base.run.current_A
    )
    name, value, unit = number(fault, base.pack)
    return replace(
        truth,
        kind="fault",
        said=f"the current was recorded with {fault.effect} {fault.size:+g}: {name} {value:.4g}",
        verdicts=("named",),
        effects=((fault.effect,),),
        strength=float(np.sqrt(np.nanmean(change_V**2))) / floor_V,
        numbers=(Number(effect=fault.effect, name=name, value=value, unit=unit),),
    )


def number(fault: Fault, pack: Pack) -> tuple[str, float, str]:
    """Name, value and unit of what the twin has to do to the recorded current to undo it.

    A clock that the pack has already (`blocks.fitted`) is replaced by the one that is found.
    """
    known = LIBRARY[fault.effect].number
    assert known is not None
    name, value, unit = known(fault.size, 0)
    if fault.effect == "clock_shift":
        value += sum(e.shift_s for e in pack.effects if isinstance(e, ClockShift))
    return name, value, unit


def faulty(run: Run, fault: Fault) -> FloatArray:
    """(n,) the current of a run as a faulty sensor would have recorded it, and then its means."""
    if not fault.effect:
        return run.current_A
    own = run.samples or run
    whole = Traces(
        time_s=own.time_s,
        current_A=own.current_A,
        voltage_V=own.voltage_V,
        drawn=np.zeros(own.time_s.size),
        seed=0,
    )
    wrong_A = FAULTS[fault.effect](whole, fault.size).current_A
    if run.samples is None:
        return wrong_A
    return binned(replace(run.samples, current_A=wrong_A), PERIOD_S).current_A


def run_of(source: str, folder: Path, cache: Path) -> Run:
    """A flight by its log, or a drive cycle; NotHere."""
    if source in LOGS:
        return flown(recording(folder, f"flights/{LOGS[source]}"))
    return driven_nmc(folder) if source == "nmc" else driven_panasonic(folder, cache)


def flown(log: Path) -> Run:
    """A flight as `analyze` reads it; a built-in cell stands for the pack's before the fit."""
    flight = read_flight(Source(log=log, sensor=None, pack=None, battery=None))
    r, use = flight.recording, flight.use
    known = Known(
        soc=use.soc_known,
        capacity=use.capacity_known,
        temperature=use.temperature_known,
        scale=True,
        charge=True,
    )
    return Run(
        pack=pack_of(use, flight.cell),
        known=known,
        time_s=r.time_s - r.time_s[0],
        current_A=r.current_A,
        voltage_V=measured_V(r),
        counted=in_flight(r),
        rounds=FLIGHT_ROUNDS,
    )


def driven_panasonic(folder: Path, cache: Path) -> Run:
    """US06 at 25 degC; the twin of `heat_bases`, then fitted to its own blocks."""
    test = panasonic.cycle(folder, "US06 25 degC")
    base = CELLS["panasonic"].base(folder, cache, (test.name,))
    pack = replace(base.heated(), initial_soc=base.full_soc, initial_K=test.start_K(ROOM_K))
    return _driven(pack, test)


def driven_nmc(folder: Path) -> Run:
    """The drive cycle; the set that was published for the cell, fitted to its own blocks."""
    cycle = about_energy.read(folder, "nmc", "drive cycle", about_energy.HELD_OUT["drive cycle"])
    pack = about_energy.nmc(folder).baseline
    return _driven(
        replace(pack, initial_soc=soc_at_rest(pack.cell, float(cycle.voltage_V[0]))), cycle
    )


def _driven(pack: Pack, cycle: RealTest) -> Run:
    thin = binned(cycle, PERIOD_S)
    return Run(
        pack=pack,
        known=LABORATORY,
        time_s=thin.time_s,
        current_A=thin.current_A,
        voltage_V=thin.voltage_V,
        counted=np.ones(thin.time_s.size, dtype=bool),
        rounds=CYCLE_ROUNDS,
        samples=cycle,
    )
