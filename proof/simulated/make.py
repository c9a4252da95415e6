"""A drawn trial made: sizes found, flights flown, recordings with noise."""

from collections.abc import Iterator, Sequence
from math import hypot
from pathlib import Path

import numpy as np

from proof.question import Question
from proof.question import Recording as Asked
from proof.simulated.configured import Configured
from proof.simulated.draw import Drawn
from proof.simulated.effects import ALL, true_value_in
from proof.simulated.flights import TrueFlight, true_flight
from proof.simulated.flown import Flown, fly
from proof.simulated.pack_truth import PackTruth
from proof.simulated.record import Concealed, Recording, record
from proof.simulated.rest import Rest
from proof.simulated.solves import OutOfReachError, Solves
from proof.simulated.strength import answer_V, known_start, missed_V, size_for
from proof.trial import NoTrial
from proof.truth import Channel, Number, Truth

ATTEMPTS = 4
CLOSE = 0.2  # of the strength that was drawn; what it came to be is measured
REVEALED_S = 1.0  # between samples of what is revealed
HEAT, CELLS = ("self_heating", "cold_pack"), ("weak_cell",)
VERDICTS = {"control": ("none",), "foreign": ("unknown",), "single": ("named",), "pair": ("named",)}


def make(drawn: Drawn, folder: Path) -> tuple[Question, Truth]:
    """What is asked and what is true; NoTrial if no attempt gives an effect of that strength."""
    solves, reasons = Solves(folder=folder), []
    for attempt in range(ATTEMPTS):
        own = drawn.otherwise(attempt)
        try:
            return _made(own, [_flight(own, seed) for seed in own.flights], solves)
        except OutOfReachError as e:
            reasons.append(str(e)[:200])
    raise NoTrial("; ".join(reasons))


def _flight(drawn: Drawn, seed: int) -> TrueFlight:
    """After its rest, if that tells how full the pack is."""
    flight = true_flight(drawn.plan, seed, full_C=drawn.told.full_C, drawn=drawn.drawn)
    rest = drawn.told_by_rest
    return rest.before(flight) if rest else flight


def _made(drawn: Drawn, flights: Sequence[TrueFlight], solves: Solves) -> tuple[Question, Truth]:
    told, pack = drawn.told, PackTruth.of(drawn.told)
    by = drawn.instruments
    floor_V = hypot(by.noise_V, answer_V(told, flights[0], by))
    target_V = drawn.multiple * floor_V
    sizes = [
        size_for(ALL[e], flavour, told, flights[0], target_V, solves, close=CLOSE)
        for e, flavour in zip(drawn.effects, drawn.flavours, strict=True)
    ]
    ways = list(zip(drawn.effects, sizes, drawn.flavours, strict=True))
    for e, size, flavour in ways:
        pack = ALL[e].make(pack, size, flavour)
    flown = [fly(pack, flight, solves) for flight in flights]
    pieces = [
        record(f, np.random.default_rng([drawn.seed, k]), by, drawn.before)
        for k, f in enumerate(flown)
    ]
    names = [*(f"flight-{k + 1}" for k in range(len(flown) - 1)), "held-out"]
    asked = [_asked(name, r) for name, (r, _) in zip(names, pieces, strict=True)]
    question = Question(
        pack=_start(drawn, asked).pack(), ambient_K=told.ambient_K, fitted=tuple(asked[:-1]),
        held_out=tuple(asked[-1:]), builtin=told.cell,
    )  # fmt: skip
    truth = Truth(
        kind=drawn.kind,
        said=" and ".join(f"{e}: {size:.3g} ({ALL[e].meaning})" for e, size, _ in ways)
        or "nothing but noise",
        verdicts=VERDICTS[drawn.kind],
        effects=tuple((e,) for e in drawn.effects if drawn.kind != "foreign"),
        strength=_missed_V(told, flown[:-1], drawn.before) / floor_V,
        floor_V=floor_V,
        numbers=tuple(_numbers(told, ways)),
        channels=tuple(_channels(drawn, names, [c for _, c in pieces], asked)),
        details={
            "plan": drawn.plan, "cell": told.cell, "series": told.series,
            "heated": told.heat_transfer_W_m2_K or 0.0,
            "start": told.start_soc, "start_K": told.start_K, "noise_V": by.noise_V,
            "noise_A": by.noise_A, "every": by.every, "drawn before": drawn.before,
            **_told_by(drawn.told_by_rest),
        },
    )  # fmt: skip
    return question, truth


def _start(drawn: Drawn, asked: Sequence[Asked]) -> Configured:
    """As the pack file states it, else as the judge reads it from the first recording.

    OutOfReachError where it takes the rest of any for none.
    """
    if not drawn.told_by_rest:
        return drawn.told.begun(drawn.before)
    first, *_ = tuple(known_start(drawn.told, r) for r in asked)
    return first


def _told_by(rest: Rest | None) -> dict[str, str | float]:
    """Details: of a rest that is what tells how full the pack is."""
    return {} if rest is None else {"told by rest": rest.seconds, "idle_A": rest.idle_A}


def _asked(name: str, r: Recording) -> Asked:
    return Asked(name=name, time_s=r.time_s, current_A=r.current_A, voltage_V=r.voltage_V)


def _missed_V(told: Configured, flown: Sequence[Flown], before: float) -> float:
    """Rms over several flights, as they were recorded."""
    return float(np.sqrt(np.mean([missed_V(told, f, before) ** 2 for f in flown])))


def _numbers(told: Configured, ways: Sequence[tuple[str, float, int]]) -> Iterator[Number]:
    """What the twin's own numbers are in truth, where they are told by the size alone."""
    for effect, size, flavour in ways:
        if known := true_value_in(told, effect, size, flavour):
            yield Number(effect=effect, name=known[0], value=known[1], unit=known[2])


def _channels(
    drawn: Drawn, names: Sequence[str], hidden: Sequence[Concealed], asked: Sequence[Asked]
) -> Iterator[Channel]:
    warm = any(e in HEAT for e in drawn.effects)
    weak = any(e in CELLS for e in drawn.effects)
    if not (warm or weak):
        return
    for name, own, r in zip(names, hidden, asked, strict=True):
        each = max(1, round(REVEALED_S / float(np.median(np.diff(r.time_s)))))
        yield Channel(
            recording=name,
            time_s=r.time_s[::each],
            temperature_K=own.temperature_K[::each] if warm else None,
            cell_voltage_V=own.cells_V[:, ::each].T if weak else None,
        )
