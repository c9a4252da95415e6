"""Many logs on several workers: the same outcomes as one after the other."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

import analyze.job
from analyze import fleet
from analyze.checks import WrongUse
from analyze.fleet import outcomes
from analyze.job import Failed, Job, Outcome, run
from analyze.pipeline import Inputs
from flightlogs.errors import LogDamaged

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


def test_a_scheduler_without_workers_is_told_and_waited_for(tmp_path, capsys) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        with ThreadPoolExecutor(1) as thread:
            waiting = thread.submit(
                lambda: list(outcomes(jobs(tmp_path), workers=1, scheduler=address))
            )
            said, until = "", time.monotonic() + 30.0
            while "waiting" not in said and time.monotonic() < until:
                time.sleep(0.05)
                said += capsys.readouterr().err
            cluster.scale(1)
            assert len(waiting.result(timeout=60.0)) == 4
    assert said.count(f"--scheduler {address}: no workers yet: waiting for one") == 1


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


def test_threads_of_one_process_do_one_job_after_the_other(tmp_path, monkeypatch) -> None:
    inside, together = [], []

    def analyse(inputs: Inputs, *, clock: object) -> None:
        del clock
        inside.append(inputs.log)
        together.append(len(inside))
        time.sleep(0.02)  # long enough for the others to come in
        inside.pop()
        raise LogDamaged("a stand-in")

    monkeypatch.setattr(analyze.job, "analyse", analyse)
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(run, jobs(tmp_path)[:3]))
    assert told(found)
    assert together == [1, 1, 1]


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "tcp://nowhere", "nonsense"])
def test_a_scheduler_that_does_not_answer_is_wrong_use(tmp_path, monkeypatch, address) -> None:
    monkeypatch.setattr(fleet, "CONNECT_S", 0.5)
    with pytest.raises(WrongUse, match=f"--scheduler {address}: no Dask scheduler answers there"):
        list(outcomes(jobs(tmp_path), workers=1, scheduler=address))


SCHEDULER = """
import sys
from distributed import LocalCluster

if __name__ == "__main__":
    cluster = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None)
    print(cluster.scheduler_address, flush=True)
    sys.stdin.read()
"""


def test_what_a_lost_scheduler_leaves_undone_has_failed_and_the_rest_is_kept(
    tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(fleet, "CONNECT_S", 2.0)  # the library waits so long for it to come back
    (tmp_path / "scheduler.py").write_text(SCHEDULER, encoding="utf-8")
    os.mkfifo(tmp_path / "never.ulg")  # a log that is never read to its end
    todo = jobs(tmp_path)
    todo[1:1] = [replace(todo[0], log=tmp_path / "never.ulg", shown="never.ulg")]
    with subprocess.Popen(
        [sys.executable, str(tmp_path / "scheduler.py")],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, process_group=0,
    ) as other:  # fmt: skip
        assert other.stdout is not None
        running = outcomes(todo, workers=1, scheduler=other.stdout.readline().strip())
        first = next(running)
        os.killpg(other.pid, signal.SIGKILL)
        found = [first, *running]
    assert first.failure.file == "a.txt"
    assert {o.failure.file for o in found} == {j.shown for j in todo}
    lost = {o.failure.reason for o in found if o.failure.code == "worker_lost"}
    assert lost == {"the connection to the scheduler was lost before its worker had an answer"}
