"""Trials whose truth is the twin's own: quick, and nothing but the twin is needed."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from proof.question import Question, Recording
from proof.trial import NoTrial, Trial
from proof.truth import Channel, Number, Truth
from tests.reference.loads import flight
from tests.twin.mismatch.recordings import NOISE_V, pack
from twin.effects import SeriesResistance
from twin.load import Load
from twin.simulate import simulate

OHM = 0.006


def asked(ohm: float, seeds: Sequence[int] = (1, 2), seconds: float = 120.0) -> Question:
    """Recordings of a pack with a resistance more than the twin has; the current without noise."""
    true = replace(pack(), effects=(SeriesResistance(resistance_ohm=ohm),) if ohm else ())
    flights = [flight(2.2, mean=8.0, peak=16.0, duration_s=seconds, seed=seed) for seed in seeds]
    loads = [Load(time_s=f.time_s, current_A=f.current_A) for f in flights]
    noise = np.random.default_rng(0)
    recordings = [
        Recording(
            name=name, time_s=load.time_s, current_A=load.current_A,
            voltage_V=simulate(true, load).voltage_V + noise.normal(0, NOISE_V, load.time_s.size),
        )
        for name, load in zip(("flight-1", "held-out"), loads, strict=True)
    ]  # fmt: skip
    return Question(
        pack=pack(), ambient_K=loads[0].ambient_K, fitted=(recordings[0],),
        held_out=(recordings[1],), builtin="lipo_2200",
    )  # fmt: skip


def true_of(ohm: float, question: Question) -> Truth:
    held_out = question.held_out[0]
    answer = simulate(question.pack, question.load(held_out))
    return Truth(
        kind="single" if ohm else "control",
        said=f"series_resistance: {ohm} Ohm" if ohm else "nothing",
        verdicts=("named",) if ohm else ("none",),
        effects=(("series_resistance",),) if ohm else (),
        strength=10.0 if ohm else 0.0,
        floor_V=NOISE_V,
        numbers=(Number(effect="series_resistance", name="resistance_ohm", value=ohm, unit="Ohm"),)
        if ohm
        else (),
        channels=(
            Channel(
                recording="held-out",
                time_s=held_out.time_s[::10],
                temperature_K=np.full(held_out.time_s[::10].size, answer.temperature_K[0] + 1.0),
            ),
        ),
    )


def made(ohm: float) -> tuple[Question, Truth]:
    question = asked(ohm)
    return question, true_of(ohm, question)


def refused() -> tuple[Question, Truth]:
    raise NoTrial("there is no recording of it")


def broken() -> tuple[Question, Truth]:
    raise ZeroDivisionError("a fault of ours")


def trial(name: str, ohm: float) -> Trial:
    return Trial(name=name, source="the twin itself", make=partial(made, ohm))
