"""Where an ageing run stands, as one file: what run it is, its rows, and the state to go on from.

JSON, whose numbers keep every bit of a float: a run that goes on is the run that never stopped.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from twin.ageing import Aged, Cycle
from twin.health import CellHealth, Health, LostLithium
from twin.solution import Status


class CheckpointError(ValueError):
    """A file that is no checkpoint, or that of another run."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checkpoint:
    """A run after a whole cycle.

    Attributes:
        identity: what must be the same to go on: name -> value or hash.
        cycles: the rows so far.
        last: the pack after the last of them.
    """

    identity: Mapping[str, str]
    cycles: tuple[Cycle, ...]
    last: Aged


def to_text(checkpoint: Checkpoint) -> str:
    """The content of a file."""
    document = {
        "identity": dict(checkpoint.identity),
        "cycles": [_row(c) for c in checkpoint.cycles],
        "state": checkpoint.last.state.tolist(),
        "net_charge_C": checkpoint.last.net_charge_C,
    }
    return json.dumps(document) + "\n"


def from_text(text: str, identity: Mapping[str, str], *, name: str) -> Checkpoint:
    """The checkpoint in `text`; CheckpointError if it is none, or not of the run `identity`."""
    try:
        document = json.loads(text)
        theirs = dict(document["identity"])
        cycles = tuple(_cycle(row) for row in document["cycles"])
        last = Aged(
            cycle=cycles[-1],
            state=np.array(document["state"], dtype=float),
            net_charge_C=float(document["net_charge_C"]),
        )
    except (ValueError, KeyError, TypeError, IndexError) as e:
        raise CheckpointError(
            f"{name} is no checkpoint of this version ({type(e).__name__}: {e}); "
            "remove it to begin anew"
        ) from e
    if differing := [k for k in identity if theirs.get(k) != identity[k]]:
        raise CheckpointError(
            f"{name} is of another run: not the same {', '.join(differing)}"
            f"{_both(theirs, identity, differing)}. Give the run a folder of its own with --out, "
            "or go on as it began"
        )
    return Checkpoint(identity=theirs, cycles=cycles, last=last)


def _row(cycle: Cycle) -> dict[str, Any]:
    return asdict(cycle) | {"status": cycle.status.name, "health": _health_row(cycle.health)}


def _health_row(health: Health) -> dict[str, Any]:
    """Without `cells` where all are alike."""
    row = asdict(health)
    del row["cells"]
    if not health.cells:
        return row
    cells = [asdict(c) | {"health": _health_row(c.health)} for c in health.cells]
    return row | {"cells": cells}


def _cycle(row: dict[str, Any]) -> Cycle:
    return Cycle(**(row | {"status": Status[row["status"]], "health": _health(row["health"])}))


def _health(row: dict[str, Any]) -> Health:
    cells = [CellHealth(**(c | {"health": _health(c["health"])})) for c in row.get("cells", ())]
    return Health(**(row | {"lost": LostLithium(**row["lost"]), "cells": tuple(cells)}))


def _both(theirs: Mapping[str, str], ours: Mapping[str, str], differing: list[str]) -> str:
    """What can be read of the difference; hashes say nothing to a person."""
    words = [k for k in differing if k not in HASHES]
    return "".join(f"; {k} was {theirs.get(k)}, is {ours[k]}" for k in words)


HASHES = ("pack", "load")
