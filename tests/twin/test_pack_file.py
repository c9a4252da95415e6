"""`pack.toml`: what is in it is used, what is not known is refused with the nearest key."""

from pathlib import Path

import pytest

from twin.effects import EFFECTS, chosen
from twin.pack_file import PackFileError, cell_reference, effect_ids, parse_pack_file

PACK = '[pack]\nname = "S500"\ncell = "cell.bpx.json"\nseries = 4\n'
WHOLE = """
[pack]
name = "S500-4S-2200"
cell = "cell.bpx.json"
capacity_ah = 2.2
series = 4
parallel = 1
serial = ""
[start]
soc = 1.0
temperature_c = 25.0
[environment]
ambient_c = 25.0
heat_transfer_W_m2_K = 12.0
[twin]
physics = ["self_heating"]
"""


def test_every_documented_key_is_read() -> None:
    file = parse_pack_file(WHOLE, name="pack.toml")
    assert file.pack.capacity_ah == 2.2
    assert file.pack.parallel == 1
    assert file.start.soc == 1.0
    assert file.environment.heat_transfer_W_m2_K == 12.0
    assert effect_ids(file) == ("self_heating",)


def test_what_is_absent_stays_unknown() -> None:
    file = parse_pack_file(PACK, name="pack.toml")
    assert file.pack.capacity_ah is None
    assert file.start.soc is None
    assert effect_ids(file) == ("self_heating",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PACK + "sereal = 'x'\n", "unknown key pack.sereal: did you mean pack.serial?"),
        (PACK + "[strat]\nsoc = 1\n", "unknown key strat: did you mean start?"),
        (PACK + "[start]\nambient_c = 20\n", "did you mean environment.ambient_c?"),
        (PACK + "[start]\nsoc = 100\n", "start.soc: Input should be less than or equal to 1"),
        (PACK.replace("4", "4.5"), "pack.series"),
        (PACK.replace("4", "0"), "pack.series"),
        (PACK + "capacity_ah = nan\n", "pack.capacity_ah"),
        (PACK + "capacity_ah = -2.2\n", "pack.capacity_ah"),
        ('[pack]\nname = "a"\n', "pack.cell is missing; pack.series is missing"),
        ("", "pack is missing"),
        ("[pack", "no TOML"),
        (PACK + "[environment]\nheat_transfer_W_m2_K = inf\n", "heat_transfer_W_m2_K"),
    ],
)
def test_a_bad_file_is_refused_by_name_and_key(text: str, said: str) -> None:
    with pytest.raises(PackFileError, match=r"^pack\.toml: ") as error:
        parse_pack_file(text, name="pack.toml")
    assert said in str(error.value)


def test_an_effect_this_version_lacks_is_refused_rather_than_ignored() -> None:
    file = parse_pack_file(PACK + '[twin]\nphysics = ["memory"]\n', name="pack.toml")
    with pytest.raises(PackFileError, match="no effect 'memory'; it has self_heating, sei"):
        effect_ids(file)


def test_every_effect_can_be_switched_on_and_none_but_heating_is_by_itself() -> None:
    listed = ", ".join(f'"{name}"' for name in EFFECTS)
    file = parse_pack_file(PACK + f"[twin]\nphysics = [{listed}]\n", name="pack.toml")
    assert effect_ids(file) == tuple(EFFECTS)
    assert [e.id for e in chosen(effect_ids(file), heat_transfer_W_m2_K=9.0)] == list(EFFECTS)
    assert effect_ids(parse_pack_file(PACK, name="pack.toml")) == ("self_heating",)


def test_no_effects_is_a_choice_too() -> None:
    assert effect_ids(parse_pack_file(PACK + "[twin]\nphysics = []\n", name="pack.toml")) == ()


@pytest.mark.parametrize(
    ("cell", "expected"),
    [
        ("cell.bpx.json", Path("/packs/cell.bpx.json")),
        ("../cells/a.json", Path("/packs/../cells/a.json")),
        ("lg_m50", "lg_m50"),
    ],
)
def test_a_cell_file_lies_relative_to_the_pack_file(cell: str, expected: str | Path) -> None:
    file = parse_pack_file(PACK.replace("cell.bpx.json", cell), name="pack.toml")
    assert cell_reference(file, Path("/packs")) == expected
