"""`twin calibrate` replaces what an earlier calibration left, and nothing else."""

from pathlib import Path

from tests.analyze.test_workbench_calibrate import PACK, call, put_test
from twin.bpx_out import write_bpx
from twin.builtin import load_cell
from twin.whole_file import write_whole


def test_what_is_in_the_way_is_named_before_anything_is_computed(tmp_path: Path) -> None:
    file, _ = put_test(tmp_path, stop=50)
    (tmp_path / "out").write_text("a file")
    result = call(tmp_path, file)
    assert (result.exit_code, "is a file: expected a folder" in result.output) == (2, True)
    (tmp_path / "out").unlink()
    result = call(tmp_path, file, out=f"{'o' * 300}.toml")
    assert (result.exit_code, "cannot be made" in result.output) == (2, True)
    for name in ("new.html", "new.ageing.json"):
        (tmp_path / "out" / name).mkdir(parents=True)
        result = call(tmp_path, file)
        assert (result.exit_code, "is a folder" in result.output) == (2, True)
        (tmp_path / "out" / name).rmdir()
    for name in ("new.toml", "new.bpx.json", "new.html"):
        (tmp_path / "out" / name).write_text("mine")
        result = call(tmp_path, file)
        assert (result.exit_code, "not from an earlier calibration" in result.output) == (2, True)
        assert (tmp_path / "out" / name).read_text() == "mine"
        (tmp_path / "out" / name).unlink()
    result = call(tmp_path, file, out="../pack.toml")
    assert (result.exit_code, "the pack file to start from" in result.output) == (2, True)
    assert (tmp_path / "pack.toml").read_text() == PACK


def test_the_cell_that_a_calibration_starts_from_is_not_replaced_by_what_it_finds(
    tmp_path: Path,
) -> None:
    file, _ = put_test(tmp_path, stop=50)
    out = tmp_path / "out"
    out.mkdir()
    own = out / "new.bpx.json"
    write_whole(own, write_bpx(load_cell("lipo_2200"), description="mine"))
    before = own.read_bytes()
    (out / "new.search.json").write_text("{}")  # of an earlier calibration of that name
    pack = PACK.replace('"lipo_2200"', '"out/new.bpx.json"')
    assert pack != PACK
    result = call(tmp_path, file, pack=pack)
    assert (result.exit_code, "which the pack file starts from" in result.output) == (2, True)
    assert own.read_bytes() == before
