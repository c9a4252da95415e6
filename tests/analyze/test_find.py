"""Which files are analysed, and where their results go."""

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analyze.find import find, sensor_beside
from analyze.names import RESERVED, free_name, printable
from analyze.output import is_foreign


def touch(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("LOG" if path.suffix in {".ulg", ".data"} else "no log", encoding="utf-8")


def is_log(path: Path) -> bool:
    return path.read_text(encoding="utf-8") == "LOG"


def found(folder: Path, *paths: str) -> tuple[list[str], int]:
    got = find([folder / p for p in paths], besides=folder / "analysis", is_log=is_log)
    return [p.relative_to(folder).as_posix() for p in got.logs], len(got.passed_over)


def test_folders_are_searched_below_by_content_and_what_is_no_log_is_counted(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "deep/er/b.data", "notes.txt", "deep/picture.png")
    assert found(tmp_path, ".") == (["a.ulg", "deep/er/b.data"], 2)


def test_a_file_that_is_named_is_taken_whatever_it_is(tmp_path) -> None:
    touch(tmp_path, "notes.txt")
    assert found(tmp_path, "notes.txt") == (["notes.txt"], 0)


def test_a_file_that_is_called_a_log_is_taken_and_one_that_may_be_anything_is_not(tmp_path) -> None:
    (tmp_path / "empty.ulg").touch()
    touch(tmp_path, "c.ULG/b.tlog", "d.px4log", "e.TLOG", "f.bin", "g.log", "._h.tlog", "ulg")
    assert found(tmp_path, ".") == (["c.ULG/b.tlog", "d.px4log", "e.TLOG", "empty.ulg"], 4)


def test_an_empty_file_with_the_name_of_any_log_is_taken(tmp_path) -> None:
    empty = ["a.bin", "b.LOG", "c.px4log", "d.tlog", "e.ulg"]
    for name in (*empty, "f.txt", "._g.bin"):
        (tmp_path / name).touch()
    assert found(tmp_path, ".") == (empty, 2)


def test_a_file_that_is_named_and_in_a_folder_too_counts_once(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "x/notes.txt")
    assert found(tmp_path, ".", "x/notes.txt") == (["a.ulg", "x/notes.txt"], 0)
    failing = {"besides": tmp_path / "out", "is_log": lambda path: path.open("x")}
    named = find([tmp_path, tmp_path / "a.ulg"], **failing)
    assert (named.logs, len(named.unreadable)) == ((tmp_path / "a.ulg",), 1)


def test_results_and_hidden_folders_are_not_searched(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "analysis/a/b.ulg", ".trash/c.ulg")
    assert found(tmp_path, ".") == (["a.ulg"], 0)


def test_a_log_named_twice_is_analysed_once(tmp_path) -> None:
    touch(tmp_path, "x/a.ulg")
    assert found(tmp_path, ".", "x", "x/a.ulg") == (["x/a.ulg"], 0)
    roundabout = find(
        [tmp_path, tmp_path / "x" / ".." / "x"], besides=tmp_path / "analysis", is_log=is_log
    )
    assert len(roundabout.logs) == 1


def test_a_link_to_a_folder_above_does_not_go_round_in_circles(tmp_path) -> None:
    touch(tmp_path, "x/a.ulg")
    (tmp_path / "x" / "up").symlink_to(tmp_path, target_is_directory=True)
    assert found(tmp_path, ".") == (["x/a.ulg"], 0)


def test_a_sensor_recording_is_not_counted_as_passed_over(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "a.sensor.csv", "b.csv")
    assert found(tmp_path, ".") == (["a.ulg"], 1)


def test_a_file_that_cannot_be_read_is_told_and_costs_nothing_else(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "b.ulg")

    def broken(path: Path) -> bool:
        if path.name == "a.ulg":
            raise PermissionError(13, "Permission denied")
        return True

    got = find([tmp_path], besides=tmp_path / "out", is_log=broken)
    assert [p.name for p in got.logs] == ["b.ulg"]
    assert got.unreadable == ((tmp_path / "a.ulg", "Permission denied"),)


def test_a_link_that_leads_nowhere_a_file_may_be_is_told_and_costs_nothing_else(tmp_path) -> None:
    touch(tmp_path, "a.ulg")
    (tmp_path / "bad.ulg").symlink_to("x" * 300)
    got = find([tmp_path], besides=tmp_path / "out", is_log=is_log)
    assert [p.name for p in got.logs] == ["a.ulg"]
    assert got.unreadable == ((tmp_path / "bad.ulg", "File name too long"),)


def test_links_with_the_name_of_a_log_that_lead_nowhere_or_in_a_circle_are_told(tmp_path) -> None:
    touch(tmp_path, "a.ulg")
    (tmp_path / "gone.BIN").symlink_to("card/gone.bin")
    (tmp_path / "round.tlog").symlink_to("round.tlog")
    (tmp_path / "notes.txt").symlink_to("no such notes")
    got = find([tmp_path], besides=tmp_path / "out", is_log=is_log)
    assert [p.name for p in got.logs] == ["a.ulg"]
    assert [(p.name, why) for p, why in got.unreadable] == [
        ("gone.BIN", "No such file or directory"),
        ("round.tlog", "Too many levels of symbolic links"),
    ]


def test_linked_folders_are_named_and_not_searched(tmp_path) -> None:
    touch(tmp_path, "x/a.ulg", "y/b.ulg", "out/c.txt")
    (tmp_path / "x/y").symlink_to(tmp_path / "y", target_is_directory=True)
    (tmp_path / "x/out").symlink_to(tmp_path / "out", target_is_directory=True)
    got = find([tmp_path / "x"], besides=tmp_path / "out", is_log=is_log)
    assert (got.logs, got.linked) == ((tmp_path / "x/a.ulg",), (tmp_path / "x/y",))
    (tmp_path / "link").symlink_to(tmp_path / "y", target_is_directory=True)
    named = find([tmp_path / "link"], besides=tmp_path / "out", is_log=is_log)
    assert (named.logs, named.linked) == ((tmp_path / "link/b.ulg",), ())


def test_a_packed_log_is_told_unless_it_is_there_unpacked(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "a.ulg.gz", "b.ulg.gz", "c.BIN.Zip", "notes.txt.gz", "tools.zip")
    got = find([tmp_path], besides=tmp_path / "out", is_log=is_log)
    assert [p.name for p in got.logs] == ["a.ulg"]
    assert [(p.name, why) for p, why in got.unreadable] == [
        ("b.ulg.gz", "a packed log: unpack it first"),
        ("c.BIN.Zip", "a packed log: unpack it first"),
    ]
    assert [p.name for p in got.passed_over] == ["a.ulg.gz", "notes.txt.gz", "tools.zip"]


@pytest.mark.usefixtures("closed")
def test_a_folder_that_cannot_be_listed_is_told_and_costs_nothing_else(tmp_path) -> None:
    touch(tmp_path, "a.ulg", "closed/b.ulg", "open/c.ulg")
    got = find([tmp_path], besides=tmp_path / "out", is_log=is_log)
    assert [p.name for p in got.logs] == ["a.ulg", "c.ulg"]
    assert got.unreadable == ((tmp_path / "closed", "Permission denied"),)


def test_a_folder_that_can_only_be_listed_is_told_and_costs_nothing_else(
    tmp_path, monkeypatch
) -> None:
    touch(tmp_path, "a.ulg", "closed/b.ulg", "closed/deep/c.ulg", "open/d.ulg")

    def stat(path: Path, **options: object) -> object:
        if "closed" in path.parent.parts:
            raise PermissionError(13, "Permission denied", str(path))
        return usual(path, **options)

    usual = Path.stat
    monkeypatch.setattr(Path, "stat", stat)
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.X_OK or path.name != "closed")
    got = find([tmp_path], besides=tmp_path / "out", is_log=is_log)
    assert [p.name for p in got.logs] == ["a.ulg", "d.ulg"]
    assert got.unreadable == ((tmp_path / "closed", "Permission denied"),)


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (["flight.csv", "flight.sensor.csv"], "flight.sensor.csv"),
        (["flight.csv"], "flight.csv"),
        (["flight.CSV"], "flight.CSV"),
        (["other.csv"], None),
        (["flight.csv/x.txt"], None),
    ],
)
def test_the_sensor_of_a_log_has_its_stem(tmp_path, files, expected) -> None:
    touch(tmp_path, "flight.ulg", *files)
    sensor = sensor_beside(tmp_path / "flight.ulg")
    assert (sensor.name if sensor else None) == expected


def test_a_name_too_long_for_a_suffix_has_no_sensor(tmp_path) -> None:
    long = f"{'l' * 250}.ulg"
    touch(tmp_path, long)
    assert sensor_beside(tmp_path / long) is None
    assert found(tmp_path, ".") == ([long], 0)


def test_a_folder_name_longer_than_the_file_system_allows_is_not_taken(tmp_path) -> None:
    assert not is_foreign(tmp_path / ("l" * 300))


def test_equal_stems_are_kept_apart_by_the_hash() -> None:
    taken = {"flight"}
    assert free_name("flight", "0123456789ab", taken.__contains__) == "flight-01234567"
    taken.add("flight-01234567")
    assert free_name("flight", "0123456789ab", taken.__contains__) == "flight-01234567-2"


def test_a_long_stem_is_cut_where_the_hash_stands_behind_it() -> None:
    name = free_name("é" * 125, "0123456789ab", {"é" * 120}.__contains__)
    assert name == "é" * 120 + "-01234567"


@given(st.lists(st.sampled_from(["a", "b", "index.html", ".", ".."]), max_size=12))
@settings(max_examples=50)
def test_no_two_logs_share_a_folder_and_none_hides_a_file_of_the_fleet(stems: list[str]) -> None:
    used: set[str] = set()
    for k, stem in enumerate(stems):
        used.add(free_name(stem, f"{k % 3}" * 64, used.__contains__))
    assert len(used) == len(stems)
    assert not used & RESERVED


def test_a_name_that_is_no_text_can_be_printed() -> None:
    assert printable(b"fl\xffight.ulg".decode("utf-8", "surrogateescape")) == "fl?ight.ulg"
