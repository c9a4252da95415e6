"""The command from outside: files, words and exit codes. The analysis itself is a stand-in here."""

import errno
import json
import os
import signal
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import analyze.job
from analyze import output, session
from analyze.job import Job
from flightlogs.errors import LogDamaged, NotALog
from reports import result as schema
from tests.analyze.calls import FILES, PACK, call, made, put

SENSOR = "time_s,current_A\n0,1\n1,2\n2,3\n3,1\n4,2\n"


@pytest.mark.usefixtures("analysed")
def test_a_log_gives_its_files_and_exit_code_0(tmp_path) -> None:
    put(tmp_path, "flight.ulg")
    run = call(tmp_path, "flight.ulg")
    assert run.exit_code == 0, run.output
    assert made(tmp_path / "analysis") == {"flight"}
    assert made(tmp_path / "analysis" / "flight") == FILES
    assert "analysed  flight.ulg: 0:46 min in flight (hover 16 s" in run.stdout
    assert "1 analysed." in run.stdout


@pytest.mark.parametrize("arguments", [[], ["--sensor", "flight.csv"]])
def test_a_worker_in_another_folder_finds_every_file(tmp_path, monkeypatch, arguments) -> None:
    jobs: list[Job] = []
    monkeypatch.setattr(session, "outcomes", lambda all_, **_: iter(jobs.extend(all_) or ()))
    put(tmp_path, "flight.ulg")
    (tmp_path / "flight.csv").write_text(SENSOR, encoding="utf-8")
    call(tmp_path, "flight.ulg", *arguments)
    (job,) = jobs
    assert (job.log, job.sensor) == (tmp_path / "flight.ulg", tmp_path / "flight.csv")
    assert job.folder == tmp_path / "analysis/flight"


@pytest.mark.parametrize(("arguments", "code"), [([], 0), (["--sensor", "flight.csv"], 1)])
def test_an_unreadable_sensor_fails_a_flight_only_if_it_was_asked_for(
    tmp_path, analysed, monkeypatch, arguments, code
) -> None:
    def sha256_of(path: Path) -> str:
        if path.suffix == ".csv":
            raise PermissionError(13, "Permission denied")
        return session.sha256_of(path)

    monkeypatch.setattr(analyze.job, "sha256_of", sha256_of)
    put(tmp_path, "flight.ulg")
    (tmp_path / "flight.csv").write_text(SENSOR, encoding="utf-8")
    run = call(tmp_path, "flight.ulg", *arguments)
    assert run.exit_code == code
    assert ("(permission_error)" in run.stderr) == bool(code)
    assert len(analysed) == 1 - code


@pytest.mark.usefixtures("analysed")
def test_the_result_is_for_the_bytes_that_were_read(tmp_path) -> None:
    put(tmp_path, "flight.ulg")
    call(tmp_path, "flight.ulg", "--out", "o")
    text = (tmp_path / "o/flight/result.json").read_bytes()
    result = schema.Result.model_validate_json(text)
    assert result.flight.sha256 == analyze.job.sha256_of(tmp_path / "flight.ulg")


@pytest.mark.usefixtures("analysed")
def test_a_folder_gives_an_index_a_table_and_the_failures(tmp_path) -> None:
    put(tmp_path, "logs/a.ulg")
    put(tmp_path, "logs/deep/a.ulg", b"other")
    put(tmp_path, "logs/bad.ulg", b"refused")
    (tmp_path / "logs/notes.txt").write_text("no log", encoding="utf-8")
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 1
    assert "failed    logs/bad.ulg: the current is 0.0 A all along (no_current)" in run.stderr
    assert "2 analysed, 1 failed, 1 passed over (no logs)." in run.stdout
    folders = {p.name for p in (tmp_path / "o").iterdir() if p.is_dir()}
    assert len(folders) == 2
    assert "a" in folders
    failures = json.loads((tmp_path / "o/failures.json").read_text(encoding="utf-8"))
    assert failures == [
        {
            "file": "logs/bad.ulg",
            "code": "no_current",
            "reason": "the current is 0.0 A all along",
        }
    ]
    table = pq.read_table(tmp_path / "o/fleet.parquet")
    assert sorted(table["folder"].to_pylist()) == sorted(folders)
    assert table["hover_s"].to_pylist() == [16.0, 16.0]
    assert sorted(table["file"].to_pylist()) == ["deep/a.ulg", "logs/a.ulg"]
    assert table["left_out"].to_pylist() == [None, None]
    assert "a/report.html" in (tmp_path / "o/index.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("analysed")
def test_what_is_passed_over_is_named_if_asked_for(tmp_path) -> None:
    put(tmp_path, "logs/a.ulg")
    (tmp_path / "logs/update.bin").write_bytes(b"firmware")
    assert "update.bin" not in call(tmp_path, "logs").output
    assert "passed over (no log)  logs/update.bin" in call(tmp_path, "logs", "-v").stderr
    (tmp_path / "logs/a.ulg").unlink()
    assert "passed over (no log)  logs/update.bin" in call(tmp_path, "logs", "-v").stderr


@pytest.mark.usefixtures("analysed")
def test_linked_folders_are_told(tmp_path) -> None:
    put(tmp_path, "card/a.ulg")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs/card").symlink_to(tmp_path / "card", target_is_directory=True)
    told = "linked folders not searched: 1"
    assert told in call(tmp_path, "logs").output
    put(tmp_path, "logs/b.ulg", b"b")
    run = call(tmp_path, "logs", "-v", "--out", "o")
    assert f"1 analysed, {told} (name them to search them)." in run.stdout
    assert "not searched (a link)  logs/card" in run.stderr
    assert "Linked folders" in (tmp_path / "o/index.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("analysed")
def test_copies_of_a_log_are_in_the_table_with_what_they_are_copies_of(tmp_path) -> None:
    for name in ("a", "b", "c"):
        put(tmp_path, f"logs/{name}.ulg")
    assert call(tmp_path, "logs", "--out", "o").exit_code == 0
    table = pq.read_table(tmp_path / "o/fleet.parquet")
    assert table["left_out"].to_pylist() == [None, "a copy of a.ulg", "a copy of a.ulg"]
    assert "0:46 min:s" in (tmp_path / "o/index.html").read_text(encoding="utf-8")


def test_a_folder_for_each_pack_names_it(tmp_path, analysed) -> None:
    """What was analysed without its name is again; where nobody says so a folder is no pack."""
    for name in ("BAT 7/a", "BAT 7/deep/b", "c"):
        put(tmp_path, f"logs/{name}.ulg", name.encode())
    call(tmp_path, "logs", "--out", "o")
    assert pq.read_table(tmp_path / "o/fleet.parquet")["serial"].to_pylist() == ["", "", ""]
    assert "--pack-per-folder" in (tmp_path / "o/index.html").read_text(encoding="utf-8")
    run = call(tmp_path, "logs", "--out", "o", "--pack-per-folder")
    assert run.exit_code == 0
    assert len(analysed) == 6
    table = pq.read_table(tmp_path / "o/fleet.parquet")
    assert table["serial"].to_pylist() == ["BAT 7", "BAT 7", "logs"]
    assert "1 of the logs lie in no folder below PATH" in run.stderr
    assert "one pack, 'logs'." in run.stderr
    assert "Packs, the weakest first" in (tmp_path / "o/index.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("analysed")
def test_a_fault_of_the_program_costs_one_log_and_is_owned_up_to(tmp_path) -> None:
    put(tmp_path, "a.ulg", b"fault")
    put(tmp_path, "b.ulg")
    run = call(tmp_path, "a.ulg", "b.ulg")
    assert run.exit_code == 1
    assert "KeyError: 'a fault of ours'. This is a fault of the program" in run.stderr
    assert "Traceback" not in run.stderr
    assert "analysed  b.ulg" in run.stdout
    assert "Traceback" in call(tmp_path, "a.ulg", "-v").stderr


def test_ctrl_c_leaves_what_is_whole_and_says_how_much(tmp_path, analysed) -> None:
    put(tmp_path, "logs/a.ulg")
    put(tmp_path, "logs/b.ulg", b"interrupted")
    put(tmp_path, "logs/c.ulg")
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 130
    assert "Interrupted: 1 analysed." in run.stderr
    assert "index.html was not written. The same command goes on from there." in run.stderr
    again = call(tmp_path, "logs/b.ulg", "--out", "o", "--force")
    assert "whole. The same command without --force goes on from there." in again.stderr
    assert analysed.pop() == "b.ulg"
    assert made(tmp_path / "o") == {"a"}
    assert not list(tmp_path.rglob("*.part"))
    assert analysed == ["a.ulg", "b.ulg"]


@pytest.mark.parametrize(("end", "whole"), [(b"lost", {"a", "b"}), (b"lost, of that", {"a"})])
def test_a_ctrl_c_that_was_lost_in_a_job_is_heard_after_it_and_no_failure_of_the_log(
    tmp_path, analysed, end, whole
) -> None:
    before = signal.getsignal(signal.SIGINT)
    put(tmp_path, "logs/a.ulg")
    put(tmp_path, "logs/b.ulg", end)
    put(tmp_path, "logs/c.ulg")
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 130
    said = f"Interrupted: {len(whole)} analysed. What is written is whole. index.html was not"
    assert run.stderr.startswith(said)
    assert run.stderr.count("\n") == 1
    assert made(tmp_path / "o") == whole
    assert analysed == ["a.ulg", "b.ulg"]
    assert signal.getsignal(signal.SIGINT) is before


def test_a_file_that_is_no_log_fails_when_named(tmp_path) -> None:
    (tmp_path / "notes.txt").write_text("no log", encoding="utf-8")
    run = call(tmp_path, "notes.txt")
    assert run.exit_code == 1
    assert "(not_a_log)" in run.stderr


def test_empty_and_damaged_logs_in_a_folder_fail_with_their_reasons(tmp_path) -> None:
    (tmp_path / "logs").mkdir()
    for name, content in {"a": b"", "b": b"ULo", "c": b"\x01\x02 no log at all"}.items():
        (tmp_path / f"logs/{name}.ulg").write_bytes(content)
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 1
    assert "0 analysed, 3 failed." in run.stdout
    failures = json.loads((tmp_path / "o/failures.json").read_text(encoding="utf-8"))
    assert [f["code"] for f in failures] == ["not_a_log"] * 3
    said = [f["reason"].partition(";")[0] for f in failures]
    assert said == [
        "the file is empty",
        "only the first 3 bytes of a ULog",
        "no known log (it starts with 01 02 20 6e 6f 20 6c 6f)",
    ]


@pytest.mark.usefixtures("analysed")
def test_quiet_says_only_what_failed(tmp_path) -> None:
    put(tmp_path, "a.ulg")
    put(tmp_path, "b.ulg", b"refused")
    run = call(tmp_path, "a.ulg", "b.ulg", "-q")
    assert run.stdout == ""
    assert run.stderr.count("\n") == 1


WRONG = {
    "a missing file": (["nowhere.ulg"], "does not exist"),
    "nothing": ([], "Missing argument"),
    "an empty folder": (["empty"], "no flight log in empty (0 files looked at)"),
    "a folder without logs": (["texts"], "no flight log in texts (1 files looked at)"),
    "a file as output": (["a.ulg", "--out", "texts/x.txt"], "is a file: expected"),
    "too long a name of the output": (["a.ulg", "--out", "o" * 300], "cannot be made"),
    "a missing pack": (["a.ulg", "--pack", "none.toml"], "does not exist"),
    "a bad pack": (["a.ulg", "--pack", "bad.toml"], "did you mean pack.series?"),
    "an unknown cell": (["a.ulg", "--pack", "cell.toml"], "lipo_2200"),
    "a fit to a life that is no text": (
        ["a.ulg", "--pack", "life.toml"],
        "life.ageing.json: cannot",
    ),
    "an unknown effect": (["a.ulg", "--pack", "effect.toml"], "no effect 'memory'"),
    "one sensor for two": (["a.ulg", "b.ulg", "--sensor", "s.csv"], "--sensor belongs to one log"),
    "no sensor": (
        ["a.ulg", "--sensor", "texts/x.txt"],
        "--sensor texts/x.txt: no table: expected lines of a time and a current",
    ),
    "no worker": (["a.ulg", "--jobs", "0"], "not in the range"),
    "two kinds of workers": (["a.ulg", "--jobs", "2", "--scheduler", "tcp://x"], "only one"),
    "no scheduler": (["a.ulg", "--scheduler", "nowhere"], "no Dask scheduler answers there"),
    "loud and quiet": (["a.ulg", "-q", "-v"], "contradict"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_use_is_exit_code_2_with_a_message_and_nothing_written(
    tmp_path, analysed, case
) -> None:
    for name in ("a.ulg", "b.ulg"):
        put(tmp_path, name)
    (tmp_path / "empty").mkdir()
    for name, text in {
        "texts/x.txt": "no log",
        "s.csv": "time,current\n",
        "bad.toml": PACK.replace("series", "serries"),
        "cell.toml": PACK.replace("lipo_2200", "lipo_2300"),
        "life.toml": PACK,
        "effect.toml": PACK + '[twin]\nphysics = ["memory"]\n',
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "life.ageing.json").write_bytes(b"\xff\xfe{")
    before = sorted(tmp_path.rglob("*"))
    arguments, said = WRONG[case]
    run = call(tmp_path, *arguments)
    assert run.exit_code == 2, run.output
    assert said in run.output
    assert sorted(tmp_path.rglob("*")) == before
    assert not analysed


@pytest.mark.usefixtures("analysed")
def test_a_log_whose_name_is_no_text_is_analysed(tmp_path) -> None:
    name = b"fl\xffght.ulg".decode("utf-8", "surrogateescape")
    put(tmp_path, name)
    run = call(tmp_path, ".")
    assert run.exit_code == 0, run.output
    assert (tmp_path / "analysis/index.html").is_file()


@pytest.mark.usefixtures("analysed", "closed")
def test_a_folder_that_cannot_be_searched_is_a_failure(tmp_path) -> None:
    put(tmp_path, "logs/a.ulg")
    put(tmp_path, "logs/closed/b.ulg")
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 1
    assert "failed    logs/closed: Permission denied (unreadable)" in run.stderr
    assert "1 analysed, 1 failed." in run.stdout


@pytest.mark.usefixtures("analysed")
def test_a_fleet_page_that_cannot_be_written_is_told_and_the_flights_are_summed_up(
    tmp_path,
) -> None:
    put(tmp_path, "logs/a.ulg")
    (tmp_path / "o/index.html").mkdir(parents=True)
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 1
    assert "o: index.html, fleet.parquet and failures.json could not all be" in run.stderr
    assert "directory" in run.stderr
    assert run.stderr.count("\n") == 1
    assert "1 analysed." in run.stdout
    assert "on one page" not in run.stdout
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.usefixtures("analysed")
def test_a_folder_that_may_not_be_written_to_is_wrong_use(tmp_path) -> None:
    put(tmp_path, "a.ulg")
    (tmp_path / "o").mkdir(mode=0o500)
    if os.access(tmp_path / "o", os.W_OK):
        pytest.skip("this user may write everywhere")
    run = call(tmp_path, "a.ulg", "--out", "o")
    assert run.exit_code == 2
    assert "may not be written to" in run.output


@pytest.mark.usefixtures("analysed")
def test_a_full_disk_fails_the_flight_and_leaves_no_empty_folder(tmp_path, monkeypatch) -> None:
    def full(path: Path, content: object) -> None:
        del content
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(output, "write_whole", full)
    put(tmp_path, "a.ulg")
    run = call(tmp_path, "a.ulg")
    assert run.exit_code == 1
    assert "No space left on device" in run.stderr
    assert "(os_error)" in run.stderr
    assert made(tmp_path / "analysis") == set()


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (OSError, "os_error"),
        (PermissionError, "permission_error"),
        (FileNotFoundError, "file_not_found_error"),
        (NotALog, "not_a_log"),
        (LogDamaged, "log_damaged"),
    ],
)
def test_the_code_of_a_failure_is_the_name_of_its_error(monkeypatch, error, code) -> None:
    def fail(job: Job) -> None:
        del job
        raise error("why")

    monkeypatch.setattr(analyze.job, "_run", fail)
    job = Job(log=Path("a.ulg"), shown="a.ulg", folder=Path("o"))
    assert analyze.job.run(job).failure.code == code
