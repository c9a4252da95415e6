"""The mismatch engine on cases whose truth is another simulator's.

    python -m tests.mismatch_cases.make FOLDER --split report    makes them (hours; FOLDER is kept)
    python -m benchmarks.mismatch FOLDER [--split report] [--jobs 2] [--only WORD...]
                                [--missing | --tables]

Each case of FOLDER/<split> is given to `explain` without its truth, the last flight held out; the
verdict goes to FOLDER/verdicts/<split>/<name>.json before the truth is looked at, with the time it
took. `--missing` leaves out cases that have one, `--tables` only reads those. About 15 s of
processor time a case, more for combinations.
"""

import argparse
import json
import multiprocessing
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.mismatch_score import Judged, judged, tables
from tests.mismatch_cases.case import Case, Question, Recording, load_question
from twin.load import Load
from twin.mismatch import Flight, explain, finding_json
from twin.whole_file import write_whole


def flight_of(question: Question, recording: Recording, name: str) -> Flight:
    """As the engine takes it."""
    load = Load(
        time_s=recording.time_s, current_A=recording.current_A, ambient_K=question.told.ambient_K
    )
    return Flight(
        name=name,
        pack=question.told.pack(),
        load=load,
        voltage_V=recording.voltage_V,
        judged=np.isfinite(recording.voltage_V),
        motion=recording.motion,
    )


def verdict(path: Path) -> dict[str, Any]:
    """Of one case, without its truth."""
    question, start = load_question(path), (time.perf_counter(), time.process_time())
    fitted = [
        flight_of(question, recording, f"flight {k}")
        for k, recording in enumerate(question.recordings)
    ]
    finding = explain(fitted, [flight_of(question, question.held_out, "held out")])
    return finding_json(finding) | {
        "seconds": time.perf_counter() - start[0],
        "processor_s": time.process_time() - start[1],
    }


def run(path: Path, out: Path) -> Judged:
    """Verdict of one case, written, then judged."""
    target = out / f"{path.stem}.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    write_whole(target, json.dumps(verdict(path), indent=1))
    return judge(path, out)


def judge(path: Path, out: Path) -> Judged:
    """A verdict that was written beside the truth."""
    return judged(Case.load(path), json.loads((out / f"{path.stem}.json").read_text()))


def chosen(folder: Path, only: Sequence[str]) -> list[Path]:
    """Cases with any of the words in their names."""
    return [
        path
        for path in sorted(folder.glob("*.npz"))
        if not only or any(word in path.stem for word in only)
    ]


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--split", default="report")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", nargs="+", default=[], metavar="WORD")
    parser.add_argument("--tables", action="store_true", help="of what has run before")
    parser.add_argument("--missing", action="store_true", help="only what has not run before")
    asked = parser.parse_args()
    paths, out = chosen(asked.folder / asked.split, asked.only), asked.folder / "verdicts"
    out /= asked.split
    there = [p for p in paths if (out / f"{p.stem}.json").exists()]
    if asked.missing:
        paths = [p for p in paths if p not in there]
    if asked.tables:
        done = [judge(path, out) for path in there]
    else:
        done = []
        with multiprocessing.get_context("spawn").Pool(asked.jobs) as pool:
            for own in pool.imap_unordered(partial(run, out=out), paths):
                done.append(own)
                sys.stdout.write(f"{own.line()}\n")
                sys.stdout.flush()
    sys.stdout.write(tables(sorted(done, key=lambda j: j.name)))


if __name__ == "__main__":
    main()
