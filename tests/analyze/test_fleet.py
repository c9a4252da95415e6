"""Many logs on several workers: the same outcomes as one after the other."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from analyze.fleet import outcomes
from analyze.job import Failed, Job, Outcome

TEXTS = {"a.txt": "no log", "b.txt": "", "c.txt": "version https://git-lfs"}


def jobs(folder: Path) -> list[Job]:
    for name, text in TEXTS.items():
        (folder / name).write_text(text, encoding="utf-8")
    named = [*TEXTS, "missing.ulg"]
    return [Job(log=folder / n, shown=n, folder=folder / "out" / n) for n in named]


def told(found: Sequence[Outcome]) -> set[tuple[str, str, str]]:
    assert all(isinstance(outcome, Failed) for outcome in found)
    return {(o.failure.file, o.failure.code, o.failure.reason) for o in found}


def test_one_after_the_other_keeps_the_order_and_goes_on_after_each_failure(tmp_path) -> None:
    found = list(outcomes(jobs(tmp_path), workers=1, scheduler=None))
    assert [o.failure.file for o in found] == [*TEXTS, "missing.ulg"]
    assert [o.failure.code for o in found] == ["not_a_log"] * 3 + ["file_not_found_error"]


def test_workers_give_the_same_outcomes(tmp_path) -> None:
    alone = outcomes(jobs(tmp_path), workers=1, scheduler=None)
    shared = outcomes(jobs(tmp_path), workers=2, scheduler=None)
    assert told(list(shared)) == told(list(alone))


def test_the_workers_of_a_running_scheduler_are_used(tmp_path) -> None:
    from distributed import LocalCluster

    alone = outcomes(jobs(tmp_path), workers=1, scheduler=None)
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        shared = list(outcomes(jobs(tmp_path), workers=1, scheduler=address))
        assert cluster.scheduler.tasks == {}
    assert told(shared) == told(list(alone))


def test_leaving_early_stops_the_workers(tmp_path) -> None:
    running = outcomes(jobs(tmp_path), workers=2, scheduler=None)
    next(running)
    running.close()
    assert list(running) == []


@pytest.mark.parametrize("arguments", [[], ["--jobs", "2"]])
def test_ctrl_c_ends_the_command_and_its_workers_with_nothing_half_written(
    tmp_path: Path, arguments: list[str]
) -> None:
    """As a terminal does it: the signal goes to the command and to its workers."""
    for k in range(400):
        (tmp_path / f"{k}.txt").write_text("no log", encoding="utf-8")
    logs = sorted(str(p) for p in tmp_path.glob("*.txt"))
    command = [sys.executable, "-m", "analyze", *logs, "--out", str(tmp_path / "o"), *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, process_group=0
    ) as run:
        assert run.stderr is not None
        assert run.stderr.readline().startswith("failed")
        os.killpg(run.pid, signal.SIGINT)
        _, said = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "Traceback" not in said
    assert said.splitlines()[-1].startswith("Interrupted: 0 analysed, ")
    assert list((tmp_path / "o").iterdir()) == []
    deadline = time.monotonic() + 20
    while alive(run.pid) and time.monotonic() < deadline:  # Python's own tracker ends last
        time.sleep(0.1)
    assert not alive(run.pid)


def alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
