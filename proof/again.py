"""`proof.json` made again: what of it the trials' own files do not bear out."""

import json
from collections.abc import Iterator, Mapping, Sequence
from math import isclose, nan
from pathlib import Path
from typing import Any

import numpy as np

from proof.judge import VERDICT
from proof.judged import judged_trial
from proof.ledger import Entry
from proof.out import IN_JSON, proof_json
from proof.outcome import Baseline, Judged, NotMade, Opened, Proof
from proof.places import ASKED, COMPARED, JUDGED, TRIALS, TRUTH, WRITTEN
from proof.seal import truth_of

SAME = 1e-9  # relative: numbers go to mV and back, which rounds
UNITS = {ending: (unit, factor) for unit, (ending, factor) in IN_JSON.items() if unit in ("V", "K")}


def proof_again(out: Path, shown: Mapping[str, Any], entries: Sequence[Entry]) -> dict[str, Any]:
    """What `shown` would be by the trials' files and the ledger.

    Where neither has it (the time it took in all) it is as shown.

    Raises:
        LookupError, TypeError, ValueError, AttributeError, OSError: it is no proof, or a file is
            not what it should be.
    """
    events: dict[str, dict[str, Entry]] = {}
    for entry in entries:
        events.setdefault(entry.trial, {})[entry.event] = entry
    begun = json.loads((out / ASKED).read_text(encoding="utf-8"))
    trials = tuple(
        _trial(out / TRIALS, t, events[t["name"]], begun["sources"][t["name"]])
        for t in shown["trials"]
    )
    proof = Proof(
        seed=begun["seed"],
        command=begun["command"],
        trials=trials,
        not_made=tuple(NotMade(**n) for n in shown["not_made"]),
        versions=begun["versions"],
        code=begun["code"],
        head=entries[-1].hash,
        seconds=shown["seconds"],
    )
    return dict(json.loads(json.dumps(proof_json(proof))))


def differences(shown: Any, again: Any, where: str) -> Iterator[str]:
    """In words, what of `shown` is not so in `again`."""
    if isinstance(shown, dict) and isinstance(again, dict):
        for key in {**again, **shown}:
            if key in shown and key in again:
                yield from differences(shown[key], again[key], f"{where}: {key}")
            else:
                yield f"{where}: {key} is {'too much' if key in shown else 'missing'}"
    elif isinstance(shown, list) and isinstance(again, list) and len(shown) == len(again):
        for number, (one, other) in enumerate(zip(shown, again, strict=True), start=1):
            name = one.get("name", number) if isinstance(one, dict) else number
            yield from differences(one, other, f"{where} {name}")
    elif not _same(shown, again):
        yield f"{where} is {shown!r}, but by the files of the trials {again!r}"


def _same(one: object, other: object) -> bool:
    numbers = isinstance(one, float | int) and isinstance(other, float | int)
    if numbers and isclose(one, other, rel_tol=SAME):  # type: ignore[arg-type]
        return True
    return one == other


def _trial(
    folder: Path, shown: Mapping[str, Any], entries: Mapping[str, Entry], source: str
) -> Judged:
    own = folder / str(shown["name"])
    judged = json.loads((own / WRITTEN / JUDGED).read_text(encoding="utf-8"))
    compared = json.loads((own / COMPARED).read_text(encoding="utf-8"))
    return judged_trial(
        truth_of((own / TRUTH).read_text(encoding="utf-8")),
        json.loads((own / WRITTEN / VERDICT).read_text(encoding="utf-8")),
        entries,
        name=shown["name"],
        source=source,
        seconds=judged["seconds"],
        baselines=tuple(map(_baseline, compared["baselines"])),
        channels=tuple(map(_channel, compared["channels"])),
        capacity_C=None if compared["capacity_ah"] is None else 3600 * compared["capacity_ah"],
        not_compared=compared.get("not_compared", ""),
    )


def _baseline(b: Mapping[str, Any]) -> Baseline:
    held_out_V = _number(b["held_out_mv"], 1e3)
    return Baseline(id=b["id"], what=b["what"], numbers=b["numbers"], held_out_V=held_out_V)


def _channel(c: Mapping[str, Any]) -> Opened:
    """All but its course, which is in no file."""
    ending = next(e for e in UNITS if f"rms_before_{e}" in c)
    unit, factor = UNITS[ending]
    before, after, named = (c[f"rms_{which}_{ending}"] for which in ("before", "after", "named"))
    course = np.full(c["samples"], np.nan)
    return Opened(
        recording=c["recording"],
        channel=c["channel"],
        unit=unit,
        time_s=course,
        measured=course,
        before=course,
        after=None if after is None else course,
        rms_before=_number(before, factor),
        rms_after=None if after is None else _number(after, factor),
        rms_named=None if named is None else _number(named, factor),
    )


def _number(shown: float | None, factor: float) -> float:
    return nan if shown is None else shown / factor
