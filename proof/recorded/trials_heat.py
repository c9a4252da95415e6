"""Trials of concealed temperature and transport on real cells, with controls: `heat_list`."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from proof.question import Question
from proof.question import Recording as Given
from proof.recorded.base import Base, start_soc
from proof.recorded.heat_bases import CELLS
from proof.recorded.heat_list import ENTRIES, Entry, Kind
from proof.recorded.instruments import by_cycler
from proof.recorded.measured import NotHere, RealTest
from proof.recorded.replay import whole_V
from proof.recorded.trials_ageing import LOSSES, WITH_AGE
from proof.trial import NoTrial, Trial
from proof.truth import NO_NAME, Channel, Truth
from twin.constants import ZERO_CELSIUS_K
from twin.mismatch.problem import Problem
from twin.mismatch.split import split

TRANSPORTS = ("electrolyte_transport", "solid_diffusion_negative", "solid_diffusion_positive")
KINDS = {
    Kind.ISOTHERMAL: "temperature",
    Kind.MISSTATED: "temperature",
    Kind.TRANSPORT: "transport",
    Kind.TOLD: "real control",
    Kind.CONTROL: "real control",
    Kind.FOREIGN: "real foreign",
}
EFFECTS: dict[Kind, tuple[tuple[str, ...], ...]] = {
    Kind.ISOTHERMAL: (("self_heating",),),
    Kind.MISSTATED: (("cold_pack",),),
    Kind.TRANSPORT: (TRANSPORTS,),
    Kind.TOLD: (),
    Kind.CONTROL: (),
    Kind.FOREIGN: (),
}
SAID = {
    Kind.ISOTHERMAL: "the cell warmed itself; the twin stays as warm as it was at the start",
    Kind.MISSTATED: "start and surroundings were not at the 25 degC that the twin is told",
    Kind.TRANSPORT: "the twin has another cell's diffusivities, radii, pores and salt",
    Kind.TOLD: "nothing: the twin is told how warm the cell was",
    Kind.CONTROL: "nothing: its publisher measured the twin on this cell, without heat",
    Kind.FOREIGN: "uneven filling and a change of phase, which no homogeneous model has",
}
VERDICTS = {Kind.TOLD: NO_NAME, Kind.CONTROL: NO_NAME, Kind.FOREIGN: ("unknown",)}
HEAT = (Kind.ISOTHERMAL, Kind.MISSTATED)  # a temperature is concealed


def heat_trials(folder: Path, cache: Path) -> tuple[Trial, ...]:
    """All of `heat_list`, of the recordings in `folder`; calibrated twins are kept in `cache`."""
    return tuple(
        Trial(name=e.name, source=CELLS[e.cell].source, make=partial(_made, e, folder, cache))
        for e in ENTRIES
    )


def _made(entry: Entry, folder: Path, cache: Path) -> tuple[Question, Truth]:
    material = CELLS[entry.cell]
    names = [name for name in (entry.fitted, entry.held_out) if name]
    try:
        tests = [material.recordings[name](folder) for name in names]
        base = material.base(folder, cache, names)
    except NotHere as e:
        raise NoTrial(str(e)) from e
    thin = [material.thin(test) for test in tests]
    soc = start_soc(base.pack.cell, tests[0], base.full_soc) if material.rests else base.full_soc
    question = _question(entry, base, soc, thin)
    shown_V = shows_V(entry, question, base, thin[0])
    return question, _truth(entry, question, base, thin, shown_V)


def _question(entry: Entry, base: Base, soc: float, tests: Sequence[RealTest]) -> Question:
    """Recordings are called by their place; all start as the first one did."""
    told_K = tests[0].start_K(base.pack.initial_K)
    if entry.told_C is not None:
        told_K = entry.told_C + ZERO_CELSIUS_K
    heats = entry.kind in (Kind.MISSTATED, Kind.TRANSPORT, Kind.TOLD)
    pack = base.heated() if heats else base.pack
    given = [
        Given(name=name_of(k), time_s=t.time_s, current_A=t.current_A, voltage_V=t.voltage_V)
        for k, t in enumerate(tests)
    ]
    return Question(
        pack=by_cycler(replace(pack, initial_soc=soc, initial_K=told_K)),
        ambient_K=told_K,
        fitted=tuple(given[:1]),
        held_out=tuple(given[1:]),
        floor_V=base.error_V,
    )


def name_of(place: int) -> str:
    """Of a recording in its question."""
    return f"recording-{place + 1}"


def shows_V(entry: Entry, question: Question, base: Base, fitted: RealTest) -> float:
    """Rms by which the concealed temperature changes the voltage of the fitted recording.

    By the base twin: as given, and with its own losses from the temperature that was measured at
    the start. Where no temperature is concealed: what the twin as given misses.
    """
    if entry.kind not in HEAT:
        return missed_V(question)
    start_K = fitted.start_K(base.pack.initial_K)
    there = replace(base.heated(), initial_soc=question.pack.initial_soc, initial_K=start_K)
    given = question.load(question.fitted[0])
    change_V = whole_V(there, replace(given, ambient_K=start_K)) - whole_V(question.pack, given)
    return float(np.sqrt(np.mean(change_V**2)))


def _truth(
    entry: Entry, question: Question, base: Base, tests: Sequence[RealTest], shown_V: float
) -> Truth:
    floor_V = float(question.floor_V or 0.0)
    return Truth(
        kind=KINDS[entry.kind],
        said=f"{SAID[entry.kind]} ({CELLS[entry.cell].source})",
        verdicts=VERDICTS.get(entry.kind, ("named",)),
        effects=EFFECTS[entry.kind],
        strength=shown_V / floor_V,
        floor_V=floor_V,
        also=(*LOSSES, *WITH_AGE) if entry.aged else (),
        channels=tuple(
            Channel(recording=name_of(k), time_s=t.time_s, temperature_K=t.temperature_K)
            for k, t in enumerate(tests)
            if t.temperature_K is not None and entry.kind in HEAT
        ),
        details={
            **{f"recording {k + 1}": t.name for k, t in enumerate(tests)},
            "missed by the twin as given, V rms": missed_V(question),
            "base twin fitted to": ", ".join(base.fitted_V),
            "base twin predicted": ", ".join(base.errors_V),
        },
    )


def missed_V(question: Question) -> float:
    """Rms by which the twin as given misses the fitted recordings.

    Where it is empty before a recording ends, it is taken to stand at its cut-off from there.
    """
    data = split(question.flights(question.fitted), question.flights(question.held_out))
    null = Problem(data.fitted, ())
    return null.rms_V(np.zeros(null.size))
