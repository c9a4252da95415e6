"""A measured life: ageing fitted to its first half, the second predicted. 20 min on two cores.

    python -m benchmarks.ageing_real

Sony VTC6 over 268 missions of an electric aircraft (the eVTOL set of Carnegie Mellon, samples
every 30 s), charged to 4.0 V, capacity measured every 50 missions from 4.2 V at C/5. The cell is
that of a built-in set of the same kind, fitted to its first capacity test and its first mission,
its resistance to cooling to the temperature of that mission. Then its ageing is fitted to the
check-ups up to mission 150, and the later ones are predicted. Beside it: the ageing constants as
they come with the built-in cell, no further loss, and a square root of time through the same
check-ups.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from twin.ageing import Regime
from twin.builtin import load_cell
from twin.calibrate.ageing import fit_life, told_of_life
from twin.calibrate.check_ups import CheckUps
from twin.calibrate.degradation import course
from twin.calibrate.out import calibrated_cell
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import conclude, fit, problem_of
from twin.effects import SelfHeating, SeriesResistance, chosen
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]

FILE = Path(__file__).parents[2] / "shared" / "battery" / "evtol_vtc6" / "VAH07_resampled.csv"
CAPACITY_C, FULL_V = 3.0 * 3600, 4.0
TEST, MISSION = slice(262, 900), slice(1062, 1112)  # rows of the first of each, with rests
CHECK_A, MISSION_A = (0.55, 0.65), 4.0  # medians of the current while either is drawn
FREE = (
    "negative.stoichiometry_max", "positive.stoichiometry_max", "negative.stoichiometry_min",
    "capacity_C", "negative.diffusivity_m2_s", "positive.diffusivity_m2_s",
    "negative.exchange_current_A_m2", "positive.exchange_current_A_m2", "series_resistance_ohm",
)  # fmt: skip
"""Of the cell; samples every 30 s tell no more."""
CONTACTS_OHM = 0.025  # to begin with: the voltage steps by 0.5 V at 15 A, half of it at once
FITTED = 4  # check-ups
PHYSICS = ("self_heating", "sei", "sei_on_cracks", "plating", "cracking", "active_material_loss")


def discharges(time_s: FloatArray, current_A: FloatArray) -> list[tuple[float, float]]:
    """(median current, charge [C]) of each stretch of discharge, in order."""
    drawn = np.concatenate([[0], (current_A > 0.2).astype(int), [0]])
    first, stop = np.flatnonzero(np.diff(drawn) == 1), np.flatnonzero(np.diff(drawn) == -1)
    return [
        (float(np.median(current_A[a:b])), float(np.trapezoid(current_A[a:b], time_s[a:b])))
        for a, b in zip(first, stop, strict=True)
    ]


def check_ups(time_s: FloatArray, current_A: FloatArray) -> CheckUps:
    """Charge of each capacity test, which has pauses, and missions before it."""
    cycles: list[int] = []
    capacity_C: list[float] = []
    missions = 0
    for median_A, charge_C in discharges(time_s, current_A):
        if median_A > MISSION_A:
            missions += 1
        elif CHECK_A[0] < median_A < CHECK_A[1]:
            if cycles and cycles[-1] == missions:
                capacity_C[-1] += charge_C
            else:
                cycles.append(missions)
                capacity_C.append(charge_C)
    return CheckUps(cycle=np.array(cycles), capacity_C=np.array(capacity_C))


def cooled(pack: Pack, load: Load, measured_K: FloatArray) -> Pack:
    """With the cooling that its temperature in a mission shows."""

    def with_transfer(log_transfer: float) -> Pack:
        heating = SelfHeating(heat_transfer_W_m2_K=float(np.exp(log_transfer)))
        rest = tuple(e for e in pack.effects if not isinstance(e, SelfHeating))
        return replace(pack, effects=(heating, *rest))

    def misfit_K(log_transfer: float) -> float:
        got_K = simulate(with_transfer(log_transfer), load).temperature_K
        return float(np.sqrt(np.mean((got_K - measured_K[: got_K.size]) ** 2)))

    best = minimize_scalar(
        misfit_K, bounds=(0.0, np.log(200.0)), method="bounded", options={"xatol": 0.05}
    )
    sys.stderr.write(f"temperature of the mission: {best.fun:.1f} K rms\n")
    return with_transfer(float(best.x))


def calibrated(columns: FloatArray) -> Pack:
    """The cell, fitted to a capacity test and a mission."""
    time_s, current_A, voltage_V, celsius = columns
    tests = [
        ReferenceTest(
            name=name, time_s=time_s[part] - time_s[part][0], current_A=current_A[part],
            voltage_V=voltage_V[part], between=between, ambient_K=celsius[part][0] + 273.15,
        )
        for name, part, between in (("capacity", TEST, Between.HOLD),
                                    ("mission", MISSION, Between.LINEAR))
    ]  # fmt: skip
    mission = tests[1]
    load = Load(time_s=mission.time_s, current_A=mission.current_A, ambient_K=mission.ambient_K)
    start = Pack(
        cell=load_cell("lipo_2200"), capacity_C=CAPACITY_C, initial_soc=0.85,
        initial_K=mission.ambient_K,
        effects=(SelfHeating(), SeriesResistance(resistance_ohm=CONTACTS_OHM)),
    )  # fmt: skip
    start = cooled(start, load, celsius[MISSION] + 273.15)
    *_, best = fit(problem_of(start, tests, only=FREE))
    found = conclude(best.problem, best.q, tests, cross_validate=False)
    for f in found.fitted:
        sys.stderr.write(f"{f.name}: {1e3 * f.rms_V:.1f} mV\n")
    ohm = SeriesResistance(resistance_ohm=found.numbers["series_resistance_ohm"])
    (heating,) = (e for e in start.effects if isinstance(e, SelfHeating))
    ageing = chosen(PHYSICS, heat_transfer_W_m2_K=heating.heat_transfer_W_m2_K)
    return Pack(cell=calibrated_cell(found), initial_K=start.initial_K, effects=(*ageing, ohm))


def main() -> None:
    """Print the table."""
    begun = time.perf_counter()
    columns = np.loadtxt(FILE, delimiter=",", skiprows=1).T
    time_s, current_A = columns[:2]
    ups, pack = check_ups(time_s, current_A), calibrated(columns)
    flown = Load(
        time_s=time_s[MISSION] - time_s[MISSION][0], current_A=np.maximum(current_A[MISSION], 0.0),
        ambient_K=pack.initial_K,
    )  # fmt: skip
    regime = Regime(load=flown.refined(10.0), rest_s=700.0, full_V=FULL_V, until_rate=0.035)
    for best in fit_life(pack, regime, ups.before(FITTED)):
        sys.stderr.write(
            f"{time.perf_counter() - begun:.0f} s: cost {best.cost:.3f}, {best.error:.2%}\n"
        )
    told = told_of_life(best)
    for e in (*told.answer.estimates, *told.answer.derived):
        print(f"{e.name} | {e.value:.3g} | {e.lower:.3g} to {e.upper:.3g} | {e.verdict.value}")
    measured = ups.capacity_C
    known_C, now = measured[:FITTED], np.sqrt(ups.cycle)
    root = np.polyval(np.polyfit(now[:FITTED], known_C, 1), now)
    plain = course(pack, regime, ups.cycle).capacity_C
    rows = {
        "fitted": told.measured_capacity * course(told.pack, regime, ups.cycle).capacity_C,
        "constants of the built-in cell": plain * (measured[0] / plain[0]),
        "no further loss": np.append(known_C, np.full(measured.size - FITTED, known_C[-1])),
        "square root": root,
    }
    print("missions | " + " | ".join(str(n) for n in ups.cycle))
    print("measured, Ah | " + " | ".join(f"{c / 3600:.3f}" for c in measured))
    for name, simulated_C in rows.items():
        off = simulated_C / measured - 1
        rms = float(np.sqrt(np.mean(off[FITTED:] ** 2)))
        print(f"{name}, % off | " + " | ".join(f"{o:+.2%}" for o in off) + f" | {rms:.2%}")
    print(f"{time.perf_counter() - begun:.0f} s; {FITTED} check-ups fitted")


if __name__ == "__main__":
    main()
