"""The judge: `twin explain`, the command that everybody uses, in a process and a folder of its own.

It is given the files of the question and nothing else: no seed, no truth, no name of an effect. The
folder is a copy elsewhere: above it lies nothing of the run.
"""

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from signal import SIGHUP, SIGINT, SIGKILL, SIGTERM
from tempfile import TemporaryDirectory
from typing import Any

from proof.places import QUESTION, WRITTEN
from twin.whole_file import write_whole

VERDICT, SAID = "mismatch.json", "explain.html"
FAILED, STOPPED = "failed", "stopped"
NO_VERDICT = (FAILED, STOPPED)  # verdicts of ours: the judge came to none, or was stopped
LONGEST_S = 3600.0  # of three runs of 55 to 60 trials the longest took 11 min of processor time
FROM_OUTSIDE = (-SIGHUP, -SIGINT, -SIGKILL, -SIGTERM, 128 + SIGINT)
"""Exit codes: these are sent, by a person or where memory lacks; other signals are a crash's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What was written.

    Attributes:
        content: of `mismatch.json`.
        seconds: that it took.
    """

    content: Mapping[str, Any]
    seconds: float


def judge(options: Sequence[str], files: Path, out: Path) -> Verdict:
    """The verdict on the question whose files are in `files`, written to `out`.

    A judge that fails, or takes longer than LONGEST_S, has said so: that counts as every verdict.
    """
    with TemporaryDirectory(prefix="twin-judge-", ignore_cleanup_errors=True) as scratch:
        shutil.copytree(files, Path(scratch, QUESTION))
        return _judged(options, Path(scratch), out)


def _judged(options: Sequence[str], scratch: Path, out: Path) -> Verdict:
    written = scratch / WRITTEN
    command = [sys.executable, "-m", "analyze.workbench", "explain", *options]
    start = time.perf_counter()
    try:
        done = subprocess.run(
            [*command, "--out", str(written.resolve())],
            cwd=scratch / QUESTION, capture_output=True, text=True, check=False, timeout=LONGEST_S,
            start_new_session=True,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return _without(out, FAILED, f"no verdict after {LONGEST_S:.0f} s", LONGEST_S)
    seconds = time.perf_counter() - start
    if done.returncode in FROM_OUTSIDE:
        return _without(out, STOPPED, f"stopped from outside after {seconds:.0f} s", seconds)
    if done.returncode != 0:
        last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        said = f"exit code {done.returncode}: {''.join(last) or 'nothing was said'}"
        return _without(out, FAILED, said, seconds)
    shutil.copytree(written, out, dirs_exist_ok=True)
    return Verdict(content=json.loads((out / VERDICT).read_text(encoding="utf-8")), seconds=seconds)


def _without(out: Path, verdict: str, said: str, seconds: float) -> Verdict:
    """One of NO_VERDICT."""
    errors = dict.fromkeys(("noise_floor", "holdout_before", "holdout_after"))
    content = {"verdict": verdict, "effects": [], "rmse_mv": errors, "remarks": [said]}
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / VERDICT, json.dumps(content, indent=1) + "\n")
    return Verdict(content=content, seconds=seconds)
