"""The paper's figures and its four statements: `python -m benchmarks.paper OUT [LOG...]`.

Two synthetic airframes (see flights.py) and any logs given. Writes into OUT, for each airframe, the
current from raw to periodic (course.svg) and damage beside constant currents (normalised.svg);
prints whether the twin supports each statement, of flight and recharge and of the flight alone,
and how that depends on what is not known of the cell. 3 min on two cores. No statement has to hold.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from analyze.assessing import manoeuvres_of
from analyze.find import sensor_beside
from analyze.pipeline import Source, read_flight
from analyze.start import pack_of
from benchmarks.paper.figures import course_svg
from benchmarks.paper.flights import AIRFRAMES, flown, words
from benchmarks.paper.statements import verdicts
from reports.damage_plots import normalised_svg
from segment import cut, periodic_profiles
from twin.builtin import load_cell
from twin.damage import Assessment, Manoeuvre, Part, Protocol, assess
from twin.effects import ActiveMaterialLoss, AnyEffect, Cracking, Plating, SelfHeating
from twin.pack import Pack

PROTOCOL = Protocol()
VARIED: dict[str, tuple[AnyEffect, ...]] = {
    "cooling 5 W/(m2 K)": (SelfHeating(heat_transfer_W_m2_K=5.0),),
    "cooling 40 W/(m2 K)": (SelfHeating(heat_transfer_W_m2_K=40.0),),
    "held at 25 degC": (SelfHeating(heat_transfer_W_m2_K=1e4),),
    "Paris exponent 3": (Cracking(paris_exponent=3.0),),
    "Paris exponent 4": (Cracking(paris_exponent=4.0),),
    "critical stress / 3": (
        ActiveMaterialLoss(negative_critical_Pa=20e6, positive_critical_Pa=125e6),
    ),
    "dead lithium 100 times faster": (Plating(decay_1_s=1e-4),),
}


def tell(name: str, found: Assessment) -> None:
    """The four statements."""
    amps = ", ".join(f"{a:g}" for a in found.baselines.currents_A)
    print(f"\n## {name} (baselines {amps} A)", flush=True)
    for reason in found.cannot.items():
        print("not assessed:", *reason)
    for part in Part:
        print(f"{part.value}:")
        for v in verdicts(found, part):
            print(
                f"- {v.statement}: {'supported' if v.supported else 'NOT supported'} ({v.numbers})"
            )


def compact(found: Assessment) -> str:
    """Yes or no to each of the four, of the whole and of the flight alone."""
    return " | ".join(
        "".join(str(k) if v.supported else "-" for k, v in enumerate(verdicts(found, part), 1))
        for part in Part
    )


def reproduce(name: str, out: Path) -> None:
    """One airframe."""
    of, pack = flown(name), Pack(cell=load_cell("lipo_2200"), series=4)
    print(f"\n{words(of)}")
    found = assess(pack, of.manoeuvres, PROTOCOL)
    tell(name, found)
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "course.svg").write_text(course_svg(of, pack), encoding="utf-8")
    (folder / "normalised.svg").write_text(normalised_svg(found), encoding="utf-8")
    print(f"\n| {name} varied | supported: flight and charge | flight alone |\n|---|---|---|")
    for label, effects in VARIED.items():
        varied = assess(replace(pack, effects=effects), of.manoeuvres, replace(PROTOCOL, cycles=4))
        print(f"| {label} | {compact(varied)} |", flush=True)


def of_log(log: Path) -> tuple[Pack, Sequence[Manoeuvre]]:
    """As `analyze` has them."""
    flight = read_flight(Source(log=log, sensor=sensor_beside(log), pack=None, battery=None))
    segments = cut(flight.recording)
    profiles = periodic_profiles(flight.recording, segments)
    pack = pack_of(flight.use, flight.cell)
    return pack, manoeuvres_of(flight.recording, segments, profiles)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for airframe in AIRFRAMES:
        reproduce(airframe, Path(sys.argv[1]))
    for path in map(Path, sys.argv[2:]):
        used, motions = of_log(path)
        if motions:
            tell(path.name, assess(used, motions, replace(PROTOCOL, ambient_K=used.initial_K)))
        else:
            print(f"\n## {path.name}: no motion lasted long enough")
