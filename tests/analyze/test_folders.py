"""Folders of results: kept while they are up to date, made again else, the user's left alone."""

import errno
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import analyze.job
from analyze.alone import alone
from analyze.checks import writable
from analyze.version import code_sha256
from tests.analyze.calls import FILES, PACK, call, made, put


def test_what_is_up_to_date_is_kept_and_said_to_be(tmp_path, analysed) -> None:
    put(tmp_path, "flight.ulg")
    call(tmp_path, "flight.ulg")
    run = call(tmp_path, "flight.ulg")
    assert "kept      flight.ulg" in run.stdout
    assert "0 analysed, 1 up to date and kept" in run.stdout
    assert len(analysed) == 1
    call(tmp_path, "flight.ulg", "--force")
    assert len(analysed) == 2


@pytest.mark.usefixtures("analysed")
def test_kept_flights_are_in_the_fleet_too(tmp_path) -> None:
    put(tmp_path, "logs/a.ulg")
    call(tmp_path, "logs", "--out", "o")
    call(tmp_path, "logs", "--out", "o")
    assert pq.read_table(tmp_path / "o/fleet.parquet").num_rows == 1


@pytest.mark.usefixtures("analysed")
def test_results_of_an_earlier_run_that_are_not_on_the_page_are_told(tmp_path) -> None:
    for name in ("A/a", "B/b", "C/c"):
        put(tmp_path, f"fleet/{name}.ulg", name.encode())
    assert "earlier runs" not in call(tmp_path, "fleet/A", "fleet/B", "--out", "o").output
    (tmp_path / "o/mine").mkdir()
    told = "Results of earlier runs that are not on this page: 2."
    run = call(tmp_path, "fleet/C", "--out", "o")
    assert told in run.stdout
    assert told in (tmp_path / "o/index.html").read_text(encoding="utf-8")
    run = call(tmp_path, "fleet", "--out", "o")
    assert "0 analysed, 3 up to date and kept" in run.stdout
    assert "earlier runs" not in run.stdout + (tmp_path / "o/index.html").read_text(
        encoding="utf-8"
    )


def test_what_other_code_made_is_made_again(tmp_path, analysed, monkeypatch) -> None:
    """Between two releases results change, and a fleet would hold both."""
    put(tmp_path, "flight.ulg")
    call(tmp_path, "flight.ulg")
    monkeypatch.setattr("analyze.job.code_sha256", lambda *_: "another")
    call(tmp_path, "flight.ulg")
    assert len(analysed) == 2


def test_the_hash_of_the_code_is_that_of_every_file_of_it(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("analyze.version.HERE", tmp_path)
    seen = set()
    for name, text in (("a.py", "1"), ("a.py", "2"), ("b/c.json", ""), ("b/c.pyc", "")):
        path = tmp_path / "twin" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        code_sha256.cache_clear()
        seen.add(code_sha256("twin"))
    code_sha256.cache_clear()
    assert len(seen) == 3


@pytest.mark.usefixtures("analysed")
def test_a_result_that_another_version_wrote_is_not_replaced_by_another_log(tmp_path) -> None:
    put(tmp_path, "x/flight.ulg")
    put(tmp_path, "y/flight.ulg", b"other")
    call(tmp_path, "x/flight.ulg")
    result = tmp_path / "analysis/flight/result.json"
    whole = json.loads(result.read_bytes())
    result.write_text(json.dumps(whole | {"a_later_field": 1}), encoding="utf-8")
    before = result.read_bytes()
    call(tmp_path, "y/flight.ulg")
    assert result.read_bytes() == before
    assert len(made(tmp_path / "analysis")) >= 2


@pytest.mark.parametrize(
    "change", ["pack", "battery", "thorough", "sensor", "result", *sorted(FILES - {"result.json"})]
)
def test_what_was_made_from_other_inputs_is_made_again(tmp_path, analysed, change) -> None:
    put(tmp_path, "flight.ulg")
    (tmp_path / "pack.toml").write_text(PACK, encoding="utf-8")
    call(tmp_path, "flight.ulg")
    more: list[str] = []
    if change == "pack":
        more = ["--pack", "pack.toml"]
    elif change == "battery":
        more = ["--battery", "1"]
    elif change == "thorough":
        more = ["--thorough"]
    elif change == "sensor":
        (tmp_path / "flight.csv").write_text("time,current\n", encoding="utf-8")
    elif change in FILES:
        (tmp_path / "analysis/flight" / change).unlink()
    else:
        (tmp_path / "analysis/flight/result.json").write_text("{", encoding="utf-8")
    call(tmp_path, "flight.ulg", *more)
    assert len(analysed) == 2


def test_another_log_of_the_same_name_does_not_overwrite_the_first(tmp_path, analysed) -> None:
    put(tmp_path, "x/flight.ulg")
    put(tmp_path, "y/flight.ulg", b"other")
    call(tmp_path, "x/flight.ulg")
    call(tmp_path, "y/flight.ulg")
    before = made(tmp_path / "analysis")
    assert len(before) == 2
    call(tmp_path, "y", "x")
    assert made(tmp_path / "analysis") - before == {
        "index.html", "fleet.parquet", "failures.json",
    }  # fmt: skip
    assert len(analysed) == 2


def test_two_runs_at_once_do_not_write_into_one_folder(tmp_path, analysed) -> None:
    put(tmp_path, "x/flight.ulg")
    with writable(tmp_path / "o"), alone(tmp_path / "o"):
        refused = call(tmp_path, "x", "--out", "o")
    assert refused.exit_code == 2
    assert "o: another analyze is writing there" in refused.output
    assert not analysed
    assert made(tmp_path / "o") == set()
    assert call(tmp_path, "x", "--out", "o").exit_code == 0


def test_a_folder_of_the_users_with_the_name_of_a_log_is_left_alone(tmp_path, analysed) -> None:
    put(tmp_path, "flight.ulg")
    (tmp_path / "flight").mkdir()
    (tmp_path / "flight/photo.jpg").write_bytes(b"a photo")
    call(tmp_path, "flight.ulg", "--out", ".")
    run = call(tmp_path, "flight.ulg", "--out", ".")
    digest = analyze.job.sha256_of(tmp_path / "flight.ulg")
    assert made(tmp_path / "flight") == {"photo.jpg"}
    assert made(tmp_path / f"flight-{digest[:8]}") == FILES
    assert "kept      flight.ulg" in run.stdout
    assert len(analysed) == 1


@pytest.mark.parametrize("letter", ["l", "ü"])  # one byte, or two
def test_names_as_long_as_a_file_system_allows_are_analysed(tmp_path, analysed, letter) -> None:
    long = letter * (251 // len(letter.encode())) + ".ulg"
    for folder in ("a", "b"):
        put(tmp_path, f"logs/{folder}/{long}", end=folder.encode())
    put(tmp_path, "logs/c.ulg")
    run = call(tmp_path, "logs")
    assert "3 analysed" in run.stdout
    assert len(analysed) == 3
    names = sorted(path.name for path in (tmp_path / "analysis").iterdir() if path.is_dir())
    assert (len(names), len({name[:120] for name in names})) == (3, 2)


@pytest.mark.usefixtures("analysed")
def test_a_file_with_the_name_of_a_folder_is_left_alone(tmp_path) -> None:
    put(tmp_path, "flight")
    run = call(tmp_path, "flight", "--out", ".")
    assert run.exit_code == 0, run.output
    assert (tmp_path / "flight").is_file()


@pytest.mark.parametrize("left", [[], ["report.html"], [".report.html.7.part"], ["result.json"]])
@pytest.mark.usefixtures("analysed")
def test_what_an_interrupted_run_left_is_replaced(tmp_path, left) -> None:
    put(tmp_path, "flight.ulg")
    (tmp_path / "analysis/flight").mkdir(parents=True)
    for name in left:
        (tmp_path / "analysis/flight" / name).write_text("half of i", encoding="utf-8")
    call(tmp_path, "flight.ulg")
    assert made(tmp_path / "analysis") == {"flight"}
    assert made(tmp_path / "analysis/flight") >= FILES


@pytest.mark.usefixtures("analysed")
def test_a_profile_of_an_earlier_run_does_not_stay(tmp_path) -> None:
    put(tmp_path, "flight.ulg")
    call(tmp_path, "flight.ulg")
    (tmp_path / "analysis/flight/profile_vertical.csv").write_text("old", encoding="utf-8")
    (tmp_path / "analysis/flight/notes.txt").write_text("the user's", encoding="utf-8")
    call(tmp_path, "flight.ulg", "--force")
    assert made(tmp_path / "analysis/flight") == FILES | {"notes.txt"}


@pytest.mark.usefixtures("analysed")
def test_a_log_whose_stem_is_dots_has_a_folder_of_its_own(tmp_path) -> None:
    put(tmp_path, "logs/..ulg")
    put(tmp_path, "logs/...ulg", b"other")
    run = call(tmp_path, "logs", "--out", "deep/o")
    assert run.exit_code == 0, run.output
    assert made(tmp_path / "deep") == {"o"}
    folders = made(tmp_path / "deep/o") - {"index.html", "fleet.parquet", "failures.json"}
    assert len(folders) == 2
    page = (tmp_path / "deep/o/index.html").read_text(encoding="utf-8")
    for name in folders:
        assert made(tmp_path / "deep/o" / name) == FILES
        assert f'href="{name}/report.html"' in page


@pytest.mark.usefixtures("analysed")
def test_a_log_that_no_folder_can_have_the_name_of_fails_and_the_others_are_done(
    tmp_path, monkeypatch
) -> None:
    """As where OUT lies so deep that each name makes its path too long for the system."""

    def iterdir(path: Path) -> object:
        if path.name.startswith("long"):
            raise too_long(path)
        return usual_iterdir(path)

    def mkdir(path: Path, **options: bool) -> None:
        if path.name.startswith("long"):
            raise too_long(path)
        usual_mkdir(path, **options)

    def too_long(path: Path) -> OSError:
        return OSError(errno.ENAMETOOLONG, "File name too long", str(path))

    usual_iterdir, usual_mkdir = Path.iterdir, Path.mkdir
    monkeypatch.setattr(Path, "iterdir", iterdir)
    monkeypatch.setattr(Path, "mkdir", mkdir)
    put(tmp_path, "logs/long.ulg")
    put(tmp_path, "logs/other.ulg")
    run = call(tmp_path, "logs", "--out", "o")
    assert run.exit_code == 1
    assert "failed    logs/long.ulg: [Errno 36] File name too long" in run.stderr
    assert made(tmp_path / "o/other") == FILES


@pytest.mark.usefixtures("analysed")
def test_results_of_an_earlier_run_are_not_counted_among_what_is_passed_over(tmp_path) -> None:
    put(tmp_path, "self/a.ulg")
    put(tmp_path, "self/b.ulg", b"other")
    (tmp_path / "self/notes.txt").write_text("the user's", encoding="utf-8")
    first = call(tmp_path, "self", "--out", "self")
    assert "2 analysed, 1 passed over (no logs)." in first.stdout
    put(tmp_path, "self/a/c.ulg", b"put there by the user")
    again = call(tmp_path, "self", "--out", "self")
    assert "1 analysed, 2 up to date and kept (--force analyses again), 1 passed" in again.stdout
    elsewhere = call(tmp_path, "self", "--out", "new")
    assert "3 analysed, 1 passed over (no logs)." in elsewhere.stdout
