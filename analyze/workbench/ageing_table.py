"""A life as a table, on file and on the terminal."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pyarrow as pa

from analyze.columns import Columns, measured
from reports.quantity import fixed
from twin.ageing import Cycle
from twin.constants import ZERO_CELSIUS_K
from twin.health import Health
from twin.pack import CellKind

SHOWN = 12  # rows on the terminal, and the last


def ageing_columns(cycles: Sequence[Cycle]) -> Columns:
    """One row a cycle; empty where there is no value."""
    words = {
        "cycle": pa.array([c.number for c in cycles]),
        "status": pa.array([c.status.name.lower() for c in cycles]),
        "stopped_in": pa.array([c.stopped_in for c in cycles]),
    }
    return {**words, **_columns([_numbers(c) for c in cycles])}


def cell_columns(cycles: Sequence[Cycle], kinds: Sequence[CellKind]) -> Columns:
    """One row a cycle and kind of cell, for a pack of unlike cells."""
    words = {
        "cycle": pa.array([c.number for c in cycles for _ in kinds]),
        "kind": pa.array([kind.name for _ in cycles for kind in kinds]),
        "cells": pa.array([kind.count for _ in cycles for kind in kinds]),
    }
    found = [cell for c in cycles for cell in c.health.cells]
    rows = [{"full_v": c.full_V, "empty_v": c.empty_V, **_health(c.health)} for c in found]
    return {**words, **_columns(rows)}


def _columns(rows: Sequence[Mapping[str, float]]) -> Columns:
    return {name: measured(np.array([row[name] for row in rows])) for name in rows[0]}


def _numbers(cycle: Cycle) -> Mapping[str, float]:
    return {
        "time_h": cycle.time_s / 3600,
        "flown_s": cycle.flown_s,
        "charge_ah": cycle.drawn_C / 3600,
        "energy_wh": cycle.energy_J / 3600,
        "end_v": cycle.end_V,
        "min_v": cycle.min_V,
        "max_temperature_c": cycle.max_K - ZERO_CELSIUS_K,
        "charged_ah": cycle.charged_C / 3600,
        **_health(cycle.health),
    }


def _health(health: Health) -> Mapping[str, float]:
    lost = health.lost
    return {
        "capacity_ah": health.capacity_C / 3600,
        "lli_percent": 100 * health.lithium_loss,
        "lam_negative_percent": 100 * health.negative_loss,
        "lam_positive_percent": 100 * health.positive_loss,
        "sei_ah": lost.sei_C / 3600,
        "sei_on_cracks_ah": lost.sei_on_cracks_C / 3600,
        "plated_ah": lost.plated_C / 3600,
        "dead_ah": lost.dead_C / 3600,
        "trapped_ah": lost.trapped_C / 3600,
        "resistance_mohm": 1000 * health.resistance_ohm,
        "resistance_10s_mohm": 1000 * health.resistance_10s_ohm,
        "lithium_audit": health.lithium_error,
        "salt_audit": health.salt_change,
        "charge_audit_c": health.charge_error_C,
    }


HEADER = (
    "cycle", "flown Ah", "Wh", "end V", "max °C", "capacity Ah", "%", "LLI %", "LAM- %", "LAM+ %",
    "R mΩ", "R 10 s mΩ",
)  # fmt: skip


def rows(cycles: Sequence[Cycle]) -> Iterator[tuple[str, ...]]:
    """The first, some evenly after it, and the last, for the terminal, in the order of HEADER."""
    last = len(cycles) - 1
    for k in (*range(0, last, -(-last // SHOWN) or 1), last):
        cycle, health = cycles[k], cycles[k].health
        flown = cycle.number > 0
        yield (
            str(cycle.number),
            fixed(cycle.drawn_C / 3600 if flown else None, 3),
            fixed(cycle.energy_J / 3600 if flown else None, 2),
            fixed(cycle.end_V, 3),
            fixed(cycle.max_K - ZERO_CELSIUS_K, 1),
            *_shown(health, cycles[0].health),
        )


CELLS_HEADER = (
    "cell", "like it", "full V", "empty V", "capacity Ah", "%", "LLI %", "LAM- %", "LAM+ %", "R mΩ",
    "R 10 s mΩ",
)  # fmt: skip


def cell_rows(cycles: Sequence[Cycle], kinds: Sequence[CellKind]) -> Iterator[tuple[str, ...]]:
    """Each kind of cell after the last cycle, in the order of CELLS_HEADER."""
    first, last = cycles[0].health.cells, cycles[-1].health.cells
    for kind, before, now in zip(kinds, first, last, strict=True):
        volts = fixed(now.full_V, 3), fixed(now.empty_V, 3)
        yield (kind.name, str(kind.count), *volts, *_shown(now.health, before.health))


def _shown(health: Health, first: Health) -> tuple[str, ...]:
    """What both tables show of it."""
    return (
        fixed(health.capacity_C / 3600, 4),
        fixed(100 * health.capacity_C / first.capacity_C, 2),
        fixed(100 * health.lithium_loss, 3),
        fixed(100 * health.negative_loss, 3),
        fixed(100 * health.positive_loss, 3),
        fixed(1000 * health.resistance_ohm, 2),
        fixed(1000 * health.resistance_10s_ohm, 2),
    )
