"""`twin prove --check DIR --again N`: what no ledger shows, that the verdicts are the tool's.

Trials drawn by chance are judged again from their question folders. Where the truth was simulated,
question and truth are made again from the seed.
"""

import json
import re
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from math import isclose
from pathlib import Path
from secrets import SystemRandom
from tempfile import TemporaryDirectory
from typing import Any

from proof.judge import NO_VERDICT, VERDICT, judge
from proof.places import ASKED, JUDGED, PROOF, QUESTION, TRIALS, TRUTH, WRITTEN
from proof.seal import truth_text
from proof.simulated.draw import PYBAMM
from proof.simulated.draw import trials as simulated
from proof.trial import NoTrial, order
from proof.truth import SIMULATED
from twin.load import Between

PROBABILITY = 0.02
ERRORS = 0.1  # of a parameter's standard error
SHARE = 0.01  # of a standard error, of an rms, of a parameter without error
MADE = 1e-4  # of a number of a question or a truth; of a voltage it is a millivolt
NEAR = (
    f"probabilities to {PROBABILITY}, parameters to {ERRORS} of their standard errors, these and "
    f"rms to {SHARE:.0%}, what is made again to {MADE:.2%}"
)
"""Another processor rounds otherwise."""
OPTIONS = ("--holdout", "--pack", "--between", "--floor-mv", *(b.value for b in Between))
FAULTS = (LookupError, TypeError, ValueError, AttributeError, OSError)  # of files that are none


def drawn(out: Path, count: int) -> list[str]:
    """So many of the trials with a verdict of the tool; which, nobody can know beforehand."""
    every = [t["name"] for t in _read(out / PROOF)["trials"] if t["verdict"] not in NO_VERDICT]
    return SystemRandom().sample(every, min(count, len(every)))


def can_make() -> bool:
    """Whether what makes truths is installed."""
    return find_spec("pybamm") is not None


def repeated(out: Path, name: str) -> Iterator[str]:
    """What of a trial does not come out again, in words."""
    own, begun = out / TRIALS / name, _read(out / ASKED)
    try:
        yield from (f"{name}: {text}" for text in _judged_again(own))
        source, kind = begun["sources"][name], _read(own / TRUTH)["kind"]
        if can_make() and (source == PYBAMM or kind in SIMULATED):
            yield from (f"{name}: {text}" for text in _made_again(own, begun))
    except FAULTS as e:
        yield f"{name}: cannot be done again: {type(e).__name__}: {e}"


def _judged_again(own: Path) -> Iterator[str]:
    """What of the verdict the installed tool does not say."""
    options = _read(own / WRITTEN / JUDGED)["options"]
    files = {path.name for path in (own / QUESTION).iterdir()}
    if strange := [o for o in options if not (o in files or o in OPTIONS or _number(o))]:
        yield f"{strange[0]!r} is no option of a question"  # it might write, or read elsewhere
        return
    with TemporaryDirectory() as scratch:
        said = judge(options, own / QUESTION, Path(scratch, WRITTEN)).content
    yield from _otherwise(_read(own / WRITTEN / VERDICT), said)


def _made_again(own: Path, begun: Mapping[str, Any]) -> Iterator[str]:
    """Files that the seed does not give; no answer of an earlier run is used."""
    names, count = list(begun["sources"]), list(begun["sources"].values()).count(PYBAMM)
    place = order(begun["seed"], len(names))[names.index(own.name)]
    if place >= count:
        yield "by the seed it is no simulated trial"
        return
    with TemporaryDirectory() as scratch:
        files = Path(scratch, QUESTION)
        files.mkdir()
        try:
            question, truth = simulated(begun["seed"], count, Path(scratch))[place].make()
        except NoTrial as e:
            yield f"by the seed it cannot be made: {e}"
            return
        question.write(files)
        made = {path.name: path.read_text(encoding="utf-8") for path in files.iterdir()}
    if not _alike((own / TRUTH).read_text(encoding="utf-8"), truth_text(truth)):
        yield f"{TRUTH} is not what the seed gives"
    for file in sorted(made.keys() | {path.name for path in (own / QUESTION).iterdir()}):
        path = own / QUESTION / file
        there = path.read_text(encoding="utf-8") if path.is_file() else ""
        if not _alike(there, made.get(file, "")):
            yield f"{QUESTION}/{file} is not what the seed gives"


def _otherwise(written: Mapping[str, Any], again: Mapping[str, Any]) -> Iterator[str]:
    if (one := _said(written)) != (other := _said(again)):
        yield f"{one} is written, judged again it is {other}"
        return
    there, said = dict(_numbers(written)), dict(_numbers(again))
    for what in {**said, **there}:
        (one, _), (other, within) = there.get(what, (None, 0.0)), said.get(what, (None, 0.0))
        if one != other and (one is None or other is None or not abs(one - other) <= within):
            yield f"{what} is {one} as written, judged again {other}"


def _said(verdict: Mapping[str, Any]) -> str:
    """Verdict and names; of one that is ours, why."""
    if verdict["verdict"] in NO_VERDICT:
        return f"{verdict['verdict']} ({' '.join(verdict['remarks'])})"
    names = " + ".join(" or ".join((e["id"], *e["equivalent"])) for e in verdict["effects"])
    return f"{verdict['verdict']}: {names}" if names else str(verdict["verdict"])


def _numbers(verdict: Mapping[str, Any]) -> Iterator[tuple[str, tuple[Any, float]]]:
    """What, its number, and how much another may differ."""
    for which, mv in verdict["rmse_mv"].items():
        yield f"{which} [mV]", (mv, SHARE * (mv or 0.0))
    for effect in verdict["effects"]:
        yield f"probability of {effect['id']}", (effect["probability"], PROBABILITY)
        for own, parameters in {**effect["instead"], effect["id"]: effect["parameters"]}.items():
            for p in parameters:
                what, std = f"{own}.{p['name']}", p["std"]
                yield what, (p["value"], ERRORS * std if std else SHARE * abs(p["value"] or 0.0))
                yield f"error of {what}", (std, SHARE * (std or 0.0))


def _alike(one: str, other: str) -> bool:
    """The same text but for its numbers, which are close."""
    if one == other:
        return True
    parts = [re.split(r'([\s,:=\[\]{}"]+)', text) for text in (one, other)]
    return len(parts[0]) == len(parts[1]) and all(map(_close, *parts))


def _close(one: str, other: str) -> bool:
    return one == other or (
        _number(one) and _number(other) and isclose(float(one), float(other), rel_tol=MADE)
    )


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))
