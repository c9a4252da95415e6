"""Folders that are packs: which logs are of which, and what they are called."""

from pathlib import Path

from analyze.pack_folders import pack_folders


def packs(folder: Path, logs: list[str], *paths: str) -> tuple[list[str], list[str]]:
    for log in logs:
        (folder / log).parent.mkdir(parents=True, exist_ok=True)
        (folder / log).touch()
    found = pack_folders([folder / log for log in logs], [folder / p for p in paths])
    loose = [log.relative_to(folder).as_posix() for log in found.loose]
    return [found.names[folder / log] for log in logs], loose


def test_the_first_folder_below_the_path_is_the_pack_and_those_of_its_card_are_none(
    tmp_path,
) -> None:
    logs = ["f/A/LOGS/1.bin", "f/A/2024-05-01/2.bin", "f/B/LOGS/1.bin", "f/B/3.bin"]
    assert packs(tmp_path, logs, "f") == (["A", "A", "B", "B"], [])


def test_two_folders_of_one_name_are_two_packs(tmp_path) -> None:
    logs = ["x/A/1.bin", "y/A/LOGS/1.bin", "y/B/1.bin"]
    assert packs(tmp_path, logs, "x", "y") == (["x/A", "y/A", "B"], [])
    assert packs(tmp_path, ["A/LOGS/1.bin", "B/LOGS/1.bin"], "A", "B")[0] == ["A/LOGS", "B/LOGS"]


def test_logs_directly_in_the_path_are_of_it_and_told(tmp_path) -> None:
    logs = ["A/1.bin", "A/deep/2.bin"]
    assert packs(tmp_path, logs, "A") == (["A", "deep"], ["A/1.bin"])


def test_a_log_that_is_named_is_of_its_folder(tmp_path) -> None:
    assert packs(tmp_path, ["A/1.bin", "B/2.bin"], "A/1.bin", "B/2.bin") == (["A", "B"], [])


def test_of_two_paths_to_a_log_the_upper_one_counts(tmp_path) -> None:
    assert packs(tmp_path, ["f/A/LOGS/1.bin"], "f/A", "f") == (["A"], [])


def test_the_folder_that_the_command_is_called_in_has_a_name(tmp_path, monkeypatch) -> None:
    (tmp_path / "here/A").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here")
    logs = [Path("1.bin"), Path("A/2.bin")]
    assert list(pack_folders(logs, [Path()]).names.values()) == ["here", "A"]
