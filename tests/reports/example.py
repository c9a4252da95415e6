"""A small flight made by hand, complete enough to fill every section of a page."""

from dataclasses import replace
from datetime import UTC, datetime
from functools import cache

import numpy as np

from flightlogs.errors import LogWarning
from flightlogs.log import FlightLog, Interval, Vehicle
from flightlogs.recording import ClockFit, Recording
from reports.flight import Fitting, FlightReport, Gaps, PackUse, Provenance
from segment.profile import Fidelity, PeriodicProfile, TooLittle
from segment.segment import Basis, LoadStatistics, Motion, Segment
from twin.builtin import load_cell
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.flight import FlightFit
from twin.damage import (
    Error,
    Lifetime,
    Lives,
    Manoeuvre,
    Others,
    Piece,
    Projection,
    Protocol,
    Span,
    Study,
    Waveform,
    assess,
    attribute,
)
from twin.damage.loss import Ledger
from twin.effects import Mechanics, SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.replay import Replay
from twin.solution import Inside, LithiumAudit, Solution, Status

T = np.arange(0.0, 60.0, 0.2)
SPANS = (
    (Motion.GROUND, 0.0, 10.0, 1.0),
    (Motion.TAKEOFF, 10.0, 14.0, 24.0),
    (Motion.HOVER, 14.0, 30.0, 18.0),
    (Motion.VERTICAL, 30.0, 38.0, 22.0),
    (Motion.HORIZONTAL, 38.0, 52.0, 20.0),
    (Motion.LANDING, 52.0, 56.0, 15.0),
)
CURRENT = np.select(
    [(start <= T) & (stop > T) for _, start, stop, _ in SPANS], [a for *_, a in SPANS], default=1.0
) + 0.5 * np.sin(7 * T)
EVIL = '<script>alert("1")</script>.ulg'  # a file may be called anything


def log(name: str = "flight.ulg") -> FlightLog:
    return FlightLog(
        name=name,
        format="ulog",
        firmware="PX4 1.14.0",
        hardware="FMU_V6X",
        vehicle=Vehicle.MULTIROTOR,
        vehicle_label="SYS_AUTOSTART 4001",
        simulated=False,
        start_utc=datetime(2025, 6, 1, 9, 30, tzinfo=UTC),
        duration_s=60.0,
        batteries=(),
        dropouts_s=0.25,
        recovered_fraction=0.998,
    )


def recording(**changes: object) -> Recording:
    velocity = np.zeros((T.size, 3))
    velocity[(T >= 30) & (T < 38), 2] = -1.5
    velocity[(T >= 38) & (T < 52), 0] = 4.0
    setpoint = velocity.copy()
    setpoint[T < 10] = np.nan
    fields = {
        "name": "flight.ulg",
        "battery": "battery_status[0], id 1",
        "other_batteries": ("battery_status[1], id 2",),
        "time_s": T,
        "current_A": CURRENT,
        "current_source": "sensor",
        "voltage_V": 16.4 - 0.03 * CURRENT,
        "temperature_K": None,
        "cell_voltage_V": None,
        "velocity_m_s": velocity,
        "velocity_setpoint_m_s": setpoint,
        "setpoint_source": "trajectory_setpoint.velocity",
        "in_air": (T >= 10) & (T < 56),
        "flight": Interval(10.0, 56.0),
        "other_flights": (Interval(70.0, 81.0),),
        "series": 4,
        "series_inferred": True,
        "capacity_C": 2.2 * 3600,
        "coulomb_check": 1.002,
        "resistance_ohm": 0.03,
        "alignment": ClockFit(
            method="battery_current",
            offset_s=3.217,
            drift_ppm=-41.0,
            correlation=0.97,
            uncertainty_s=0.012,
            drift_uncertainty_ppm=6.0,
            gain=1.04,
            bias_A=-0.3,
        ),
        "warnings": (LogWarning("cells_inferred", "4 cells inferred from 16.4 V.", "battery"),),
    }
    return Recording(**(fields | changes))  # type: ignore[arg-type]


def segments() -> tuple[Segment, ...]:
    return tuple(
        Segment(
            motion=motion,
            start_s=start,
            stop_s=stop,
            basis=Basis.SETPOINT if motion is not Motion.GROUND else Basis.NONE,
            load=LoadStatistics(
                charge_C=mean * (stop - start),
                energy_J=mean * (stop - start) * 15.8,
                mean_A=mean,
                rms_A=mean * 1.001,
                p99_A=mean + 0.5,
                ripple_A=0.35,
            ),
        )
        for motion, start, stop, mean in SPANS
    )


def profile() -> PeriodicProfile:
    t = np.arange(0.0, 10.0, 0.2)
    return PeriodicProfile(
        motion=Motion.HOVER,
        period_s=10.0,
        time_s=t,
        current_A=18.0 + 0.5 * np.sin(2 * np.pi * t / 2),
        source_s=16.0,
        segments=1,
        fidelity=Fidelity(
            mean_A=0.01,
            rms_A=-0.02,
            percentile_A=(0.05, 0.0, -0.04),
            ripple_spectrum=0.08,
            ramp_rate=0.04,
            seam_A=0.1,
        ),
    )


def solution(status: Status = Status.DONE, samples: int = T.size) -> Solution:
    t, i = T[:samples], CURRENT[:samples]
    drawn = np.cumsum(i) * 0.2 / (2.2 * 3600)
    mol = np.array([0.1, 0.09])
    return Solution(
        time_s=t,
        current_A=i,
        voltage_V=16.4 - 0.031 * i - 0.5 * drawn,
        temperature_K=298.15 + 0.05 * t,
        soc=0.95 - drawn,
        heat_W=0.03 * i**2,
        audit=LithiumAudit(
            negative_mol=mol,
            lost_mol={},
            positive_mol=mol[::-1],
            electrolyte_mol=np.array([0.01, 0.01]),
            relative_error=-2e-15,
            charge_error_C=3e-13,
        ),
        status=status,
        stopped_s=float(T[samples - 1]) if status is Status.DONE else max(samples * 0.2 - 0.1, 0.0),
        steps=samples,
        retried_steps=0,
        charge_C=float(np.sum(i) * 0.2),
        energy_J=float(np.sum(i) * 0.2 * 16.0),
        end_state=np.zeros(1),
        cell_voltage_V=np.zeros((4, samples)),
        cell_temperature_K=np.zeros((4, samples)),
        inside=Inside(
            anode_V=np.full(samples, 0.2),
            negative_stress_Pa=np.zeros((2, samples)),
            positive_stress_Pa=np.zeros((2, samples)),
        ),
    )


def pack() -> PackUse:
    return PackUse(
        name="",
        cell="LiPo 2.2 Ah",
        cell_source="twin/cells",
        calibrated=False,
        series=4,
        series_inferred=True,
        parallel=1,
        capacity_C=2.2 * 3600,
        rated_C=2.2 * 3600,
        capacity_known=True,
        cooling_known=False,
        soc_by_rest=True,
        temperature_known=False,
        serial="77",
        initial_soc=0.95,
        soc_std=0.002,
        initial_K=298.15,
        ambient_K=298.15,
        heat_transfer_W_m2_K=12.0,
        heat_transfer_std_W_m2_K=None,
        standard_errors={},
        cell_error_V=0.0,
        effects=(SelfHeating(),),
        mechanics=Mechanics(),
        origins={"capacity_C": "parameter in the log", "initial_soc": "from the voltage at rest"},
    )


def estimate(name: str, value: float, std: float, **changes: object) -> Estimate:
    fields = {
        "name": name,
        "unit": "",
        "value": value,
        "std": std,
        "lower": value - 1.6449 * std,
        "upper": value + 1.6449 * std,
        "prior": 1.0,
        "left_of_prior": 0.1,
        "verdict": Verdict.IDENTIFIED,
    }
    return Estimate(**(fields | changes))  # type: ignore[arg-type]


def flight_fit() -> FlightFit:
    return FlightFit(
        pack=Pack(cell=load_cell("lipo_2200"), series=4, capacity_C=2.05 * 3600),
        ambient_K=291.0,
        estimates=(
            estimate("initial_soc", 0.964, 0.004, prior=0.95),
            estimate("capacity_C", 2.05 * 3600, 0.06 * 3600, prior=2.2 * 3600, unit="C"),
            estimate("series_resistance_ohm", 0.0, 0.002, verdict=Verdict.AT_BOUND, unit="Ohm"),
            estimate("initial_K", 291.0, 3.0, prior=298.15, unit="K", verdict=Verdict.PARTLY),
            estimate("heat_transfer_W_m2_K", 12.0, 6.0, prior=12.0, verdict=Verdict.PRIOR),
            estimate("solid_diffusion", 0.8, 0.2),
        ),
        pulse=estimate("pulse_ohm", 0.0412, 0.0007, prior=0.033, unit="Ohm"),
        held_out_before_V=0.071,
        held_out_after_V=0.009,
        independent_samples=210.0,
    )


def fitted_pack() -> PackUse:
    return replace(pack(), fitting=Fitting(outcome=flight_fit(), before_V=0.0721))


def lifetime(reached: float, ended: str = "") -> Lifetime:
    told = Projection(
        flights=np.zeros(1), capacity_C=np.ones(1), reached=reached, error=9.0, ended=ended
    )
    return Lifetime(projection=told, error=Error(std=0.3, freedom=6.0))


@cache
def study(*, thorough: bool) -> Study:
    """Of hover, cycled once, and of the flight as flown; the lives are made up."""
    pack = Pack(cell=load_cell("lipo_2200"), series=4)
    wave = Waveform(current_A=18 + 4 * np.sin(np.arange(20)), sample_s=0.5)
    pieces = tuple(
        Piece(current_A=m + 4 * np.sin(np.arange(20.0)), sample_s=0.5) for m in (17.9, 18.1)
    )
    hover = Manoeuvre(name="hover", waveform=wave, pieces=pieces, speed_m_s=0.5)
    found = assess(pack, [hover], Protocol(cycles=1), counterfactuals=thorough)
    flown = attribute(
        found.pack,
        Load(time_s=T, current_A=CURRENT),
        [Span(name=m.value, start_s=a, stop_s=b) for m, a, b, _ in SPANS],
        formed=found.baselines.reference.end_state,
        waveforms={"hover": wave},
    )
    lives = Lives(
        share=0.8,
        soon=lifetime(812.0),
        daily=lifetime(405.0),
        most_A=24.0,
        gentle=lifetime(float("nan"), "in the flight the voltage reached the lower cut-off"),
        motions={"hover": lifetime(900.0)},
        by_shares=870.0,
        packs=2,
    )
    return Study(
        assessment=found,
        attribution=flown,
        lives=lives if thorough else None,
        others=Others(packs=(pack, pack), of_cell=True, of_life=False) if thorough else None,
        cyclable_C=Ledger(found.pack).cyclable_C,
    )


def report(
    *, name: str = "flight.ulg", played: Solution | None = None, **changes: object
) -> FlightReport:
    used = recording()
    load = Load(time_s=T, current_A=CURRENT)
    fields = {
        "log": log(name),
        "recording": used,
        "segments": segments(),
        "profiles": {
            Motion.HOVER: profile(),
            Motion.VERTICAL: TooLittle(
                motion=Motion.VERTICAL,
                source_s=8.0,
                reason="8.0 s of vertical motion, 10 s are needed.",
            ),
        },
        "alignment_refusal": "",
        "gaps": Gaps(count=1, total_s=2.5, longest_s=2.5, charge_C=41.0),
        "pack": fitted_pack(),
        "replay": Replay(
            load=load,
            recorded_V=used.voltage_V,
            judged=used.in_air,
            solution=played or solution(),
        ),
        "provenance": Provenance(
            sha256="ab" * 32,
            sensor_name="flight.sensor.csv",
            sensor_sha256="cd" * 32,
            pack_sha256="",
            inputs_sha256="ef" * 32,
            version="0.1.0",
            solver="P2D: 300 steps",
            seconds=1.25,
        ),
    }
    return FlightReport(**(fields | changes))  # type: ignore[arg-type]
