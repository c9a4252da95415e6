"""A proof made by hand: trials of all kinds, some of which fail."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from typing import Any

import numpy as np

from proof.outcome import (
    Baseline,
    Judged,
    Named,
    NotMade,
    Opened,
    Outcome,
    Proof,
    Sized,
    Stamp,
)
from proof.truth import Channel, Number, Truth

NOISE_V = 8e-3
START = datetime(2026, 11, 21, 18, 0, tzinfo=UTC)
TIME_S = np.arange(0.0, 900.0, 1.0)
UNITS = {"temperature": "K", "weakest cell": "V", "other cells": "V"}


def stamp(name: str, minute: float) -> Stamp:
    at = START + timedelta(minutes=minute)
    digest = sha256(name.encode()).hexdigest()
    entry = sha256(digest.encode()).hexdigest()
    return Stamp(utc=at.isoformat(timespec="milliseconds"), sha256=digest, entry=entry)


def truth(kind: str, said: str, *effects: str, strength: float = 3.1, **more: Any) -> Truth:
    """Of effects each with one right id, or several joined by `|`."""
    verdict = "unknown" if kind == "foreign" else "named" if effects else "none"
    return replace(
        Truth(
            kind=kind, said=said, verdicts=(verdict,), strength=strength, floor_V=NOISE_V,
            effects=tuple(tuple(e.split("|")) for e in effects),
        ),
        **more,
    )  # fmt: skip


def named(*ids: str, probability: float = 0.97) -> tuple[Named, ...]:
    """Each with what looks the same, joined by `~`."""
    parts = [i.split("~") for i in ids]
    return tuple(Named(id=p[0], probability=probability, equivalent=tuple(p[1:])) for p in parts)


def judged(
    number: int, of: Truth, outcome: Outcome, verdict: str, *effects: str, left_V: float = 8.2e-3,
    source: str = "PyBaMM", **more: Any,
) -> Judged:  # fmt: skip
    """With two baselines where the tool named something; sealed, judged and opened in order."""
    name, before_V = f"trial-{number:02d}", of.strength * NOISE_V
    baselines = (
        Baseline(id="refit", what="its parameters refitted", numbers=9, held_out_V=2.1 * left_V),
        Baseline(id="correction", what="a spline of current and charge", numbers=20,
                 held_out_V=1.4 * left_V),
        Baseline(id="random", what="an effect drawn by chance", numbers=1, held_out_V=before_V),
    )  # fmt: skip
    return replace(
        Judged(
            name=name, source=source, truth=of, verdict=verdict, named=named(*effects),
            outcome=outcome, noise_V=NOISE_V, held_out_before_V=before_V, held_out_after_V=left_V,
            baselines=baselines if effects else (), sized=(), channels=(), capacity_C=None,
            sealed=stamp(f"{name} truth", 0.01 * number), judged=stamp(f"{name} said", 5 + number),
            opened=stamp(f"{name} opened", 60 + 0.01 * number), seconds=31.5 + number,
        ),
        **more,
    )  # fmt: skip


def opened(recording: str, channel: str, rms: tuple[float, float | None]) -> Opened:
    """A measured rise, and twins that differ from it by a constant."""
    base = 298.0 + TIME_S / 60 if channel == "temperature" else 4.1 - TIME_S / 1000
    before, after = rms
    return Opened(
        recording=recording, channel=channel, unit=UNITS[channel], time_s=TIME_S, measured=base,
        before=base - before, after=None if after is None else base + after,
        rms_before=before, rms_after=after, rms_named=after,
    )  # fmt: skip


def hidden(recording: str) -> Channel:
    return Channel(recording=recording, time_s=TIME_S, temperature_K=298.0 + TIME_S / 60)


def sized(effect: str, name: str, unit: str, *, true: float, found: float | None) -> Sized:
    std = None if found is None else 0.05 * abs(true)
    return Sized(effect=effect, name=name, unit=unit, true=true, found=found, std=std)


def simulated() -> list[Judged]:
    right, wrong = Outcome.RIGHT, Outcome.WRONG
    nothing = truth("control", "nothing", strength=1.0)
    heat = truth("single", "self-heating at 8 W/m2/K", "self_heating", strength=3.3,
                 numbers=(Number(effect="self_heating", name="heat_transfer_W_m2_K", value=8.0,
                                 unit="W/(m2 K)"),))  # fmt: skip
    film = truth("single", "a film of 1 mOhm m2", "film_resistance", strength=10.2)
    both = truth("pair", "leak and slow sensor", "leakage", "sensor_lag", strength=4.0)
    foreign = truth("foreign", "a loose connector", strength=5.0)
    weak = truth("single", "current gain of 0.5 %", "current_gain", strength=1.1)
    resistance = truth("single", "5 mOhm in series", "series_resistance", strength=3.2)
    return [
        judged(1, nothing, right, "none", left_V=8.0e-3),
        judged(2, nothing, wrong, "named", "clock_shift", left_V=7.9e-3),
        judged(3, heat, right, "named", "self_heating",
               sized=(sized("self_heating", "heat_transfer_W_m2_K", "W/(m2 K)", true=8.0,
                            found=8.9),)),
        judged(4, film, right, "named", "series_resistance~film_resistance",
               sized=(sized("film_resistance", "negative_ohm_m2", "Ohm m2", true=1e-3,
                            found=None),)),
        judged(5, both, right, "named", "leakage", "sensor_lag"),
        judged(6, both, Outcome.PART, "named", "leakage", left_V=14e-3),
        judged(7, foreign, right, "unknown", left_V=36e-3),
        judged(8, foreign, wrong, "named", "series_resistance", left_V=11e-3),
        judged(9, weak, Outcome.MISSED, "none", left_V=8.6e-3),
        judged(10, resistance, wrong, "named", "current_gain~voltage_gain", left_V=13.5e-3),
        judged(11, resistance, Outcome.MISSED, "ambiguous", "series_resistance", "current_gain"),
    ]  # fmt: skip


def recorded() -> list[Judged]:
    right = Outcome.RIGHT
    control = truth("real control", "nothing: its own pulse test again", strength=1.0)
    warm = truth(
        "temperature",
        "it heats itself; the twin is isothermal",
        "self_heating",
        strength=6.0,
        channels=(hidden("recording-a"), hidden("recording-b")),
    )
    aged = truth(
        "ageing",
        "aged at 1C for 400 cycles",
        "lithium_inventory_loss|active_material_loss_negative",
        strength=7.0,
        capacity_C=2.61 * 3600,
    )
    one = truth(
        "weak cell",
        "the third of six cells is weak",
        "weak_cell",
        strength=4.4,
        channels=(
            Channel(
                recording="recording-c",
                time_s=TIME_S,
                cell_voltage_V=np.full((TIME_S.size, 6), 3.7),
            ),
        ),
    )
    samsung, melasta = "Samsung 30Q 3 Ah, USC", "Melasta 6S, ETH"
    return [
        judged(12, control, right, "none", source=samsung),
        judged(13, warm, right, "named", "self_heating", source=samsung, left_V=11e-3,
               channels=(opened("recording-a", "temperature", (9.3, 0.8)),
                         opened("recording-b", "temperature", (14.2, 2.6)))),
        judged(14, aged, right, "named", "active_material_loss_negative", source="LG M50",
               capacity_C=2.57 * 3600),
        judged(15, aged, Outcome.MISSED, "unknown", source="Panasonic", left_V=30e-3),
        judged(16, one, right, "named", "weak_cell", source=melasta, left_V=9e-3,
               channels=(opened("recording-c", "weakest cell", (0.08, 0.012)),
                         opened("recording-c", "other cells", (0.02, 0.004))),
               baselines=(Baseline(id="correction", what="a spline of current and charge",
                                   numbers=20, held_out_V=8.1e-3),)),
    ]  # fmt: skip


def proof(trials: list[Judged] | None = None) -> Proof:
    return Proof(
        seed=7,
        command="twin prove --seed 7 --out proof",
        trials=tuple([*simulated(), *recorded()] if trials is None else trials),
        not_made=(NotMade(name="trial-17", source="PyBaMM",
                          reason="leakage: no size from 0.005 to 8 gives 80 mV on hover"),),
        versions={"drone-battery-health": "0.1.0", "PyBaMM": "26.1.0", "CasADi": "3.7.2"},
        code=sha256(b"code").hexdigest(),
        head=sha256(b"head").hexdigest(),
        seconds=4711.0,
    )  # fmt: skip
