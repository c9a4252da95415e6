"""The judge: `twin explain`, the command that everybody uses, in a process and a folder of its own.

It is given the files of the question and nothing else: no seed, no truth, no name of an effect.
"""

import json
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proof.question import Question
from twin.whole_file import write_whole

VERDICT, SAID = "mismatch.json", "explain.html"
FAILED = "failed"  # a verdict of ours: the judge came to none
LONGEST_S = 1800.0  # of seven runs of 55 to 60 trials the longest took 391 s


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What was written.

    Attributes:
        content: of `mismatch.json`.
        seconds: that it took.
    """

    content: Mapping[str, Any]
    seconds: float


def judge(question: Question, files: Path, out: Path) -> Verdict:
    """The verdict on the question whose files are in `files`.

    A judge that fails, or takes longer than LONGEST_S, has said so: that counts as every verdict.
    """
    command = [sys.executable, "-m", "analyze.workbench", "explain", *question.options()]
    start = time.perf_counter()
    try:
        done = subprocess.run(
            [*command, "--out", str(out.resolve())],
            cwd=files, capture_output=True, text=True, check=False, timeout=LONGEST_S,
            start_new_session=True,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return _failed(out, f"no verdict after {LONGEST_S:.0f} s", LONGEST_S)
    seconds = time.perf_counter() - start
    if done.returncode != 0:
        last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        said = f"exit code {done.returncode}: {''.join(last) or 'nothing was said'}"
        return _failed(out, said, seconds)
    return Verdict(content=json.loads((out / VERDICT).read_text(encoding="utf-8")), seconds=seconds)


def _failed(out: Path, said: str, seconds: float) -> Verdict:
    errors = dict.fromkeys(("noise_floor", "holdout_before", "holdout_after"))
    content = {"verdict": FAILED, "effects": [], "rmse_mv": errors, "remarks": [said]}
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / VERDICT, json.dumps(content, indent=1) + "\n")
    return Verdict(content=content, seconds=seconds)
