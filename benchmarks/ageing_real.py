"""A measured life: ageing fitted to its first half, the second predicted. 5 min on two cores.

    python -m benchmarks.ageing_real

Sony VTC6 over 268 missions of an electric aircraft (the eVTOL set of Carnegie Mellon, samples
every 30 s), charged to 4.0 V, capacity measured every 50 missions from 4.2 V at C/5. The cell is
the built-in LG M50 with the thin coatings of a cell made for power, fitted to its first capacity
test and its first mission, its resistance to cooling to the temperature of that mission. Then its
ageing is fitted to the check-ups up to mission 150, and the later ones are predicted. Beside it:
the ageing constants as they come with the built-in cell, no further loss, and a square root of time
through the same check-ups.
"""

import sys
import time
from dataclasses import replace

import numpy as np

from benchmarks.real_cells.__main__ import SHARED
from proof.recorded.cooling import cooled
from proof.recorded.heat_bases import POWER, thinner
from proof.recorded.measured import NotHere, RealTest
from proof.recorded.vtc6 import CAPACITY_C, DRAWN_A, Life, life
from twin.ageing import Regime
from twin.builtin import load_cell
from twin.calibrate.ageing import fit_life, told_of_life
from twin.calibrate.check_ups import CheckUps
from twin.calibrate.degradation import course
from twin.calibrate.out import calibrated_cell
from twin.calibrate.run import conclude, fit, problem_of
from twin.effects import SelfHeating, SeriesResistance, chosen
from twin.load import Between, Load
from twin.pack import Pack

FULL_V = 4.0
TEST, MISSION = slice(262, 900), slice(1062, 1112)  # rows of the first of each, with rests
FREE = (
    "negative.stoichiometry_max", "positive.stoichiometry_max", "negative.stoichiometry_min",
    "capacity_C", "negative.diffusivity_m2_s", "positive.diffusivity_m2_s",
    "negative.exchange_current_A_m2", "positive.exchange_current_A_m2", "series_resistance_ohm",
)  # fmt: skip
"""Of the cell; samples every 30 s tell no more."""
CONTACTS_OHM = 0.025  # to begin with: the voltage steps by 0.5 V at 15 A, half of it at once
FITTED = 4  # check-ups
ENDED = "ended"  # the twin came to its cut-off within a mission before
PHYSICS = ("self_heating", "sei", "sei_on_cracks", "plating", "cracking", "active_material_loss")


def check_ups(own: Life) -> CheckUps:
    """Charge of each capacity test, without its pauses, and missions before it."""
    return CheckUps(
        cycle=np.array([missions for missions, _ in own.check_ups]),
        capacity_C=np.array([drawn_C(own.whole.part(rows)) for _, rows in own.check_ups]),
    )


def drawn_C(test: RealTest) -> float:
    """While a current flows."""
    flows = test.current_A > DRAWN_A
    return float(np.diff(test.drawn_C)[flows[1:] & flows[:-1]].sum())


def calibrated(own: Life) -> Pack:
    """The cell, fitted to a capacity test and a mission."""
    mission = own.whole.part(MISSION)
    start = Pack(
        cell=load_cell("lg_m50"), capacity_C=CAPACITY_C, initial_soc=0.85,
        effects=(SeriesResistance(resistance_ohm=CONTACTS_OHM),),
    )  # fmt: skip
    start = thinner(start, POWER)
    start = cooled(start, [mission])
    tests = [
        replace(test, name=name, temperature_K=None).reference(
            ambient_K=test.start_K(start.initial_K), between=between
        )
        for name, test, between in (
            ("capacity", own.whole.part(TEST), Between.HOLD),
            ("mission", mission, Between.LINEAR),
        )
    ]
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
    try:
        own = life(SHARED)
    except NotHere as e:
        print(f"left out: {e}")
        return
    ups, pack, mission = check_ups(own), calibrated(own), own.whole.part(MISSION)
    flown = Load(
        time_s=mission.time_s, current_A=np.maximum(mission.current_A, 0.0),
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
        off = np.where(simulated_C > 0.0, simulated_C / measured - 1, np.nan)
        rms = np.sqrt(np.mean(off[FITTED:] ** 2))
        shown = [ENDED if np.isnan(o) else f"{o:+.2%}" for o in (*off, rms)]
        print(f"{name}, % off | " + " | ".join(shown))
    print(f"{time.perf_counter() - begun:.0f} s; {FITTED} check-ups fitted")


if __name__ == "__main__":
    main()
