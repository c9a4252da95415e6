"""`pack.toml`: what is in it is used, what is not known is refused with the nearest key."""

from pathlib import Path

import pytest

from twin.effects import (
    EFFECTS,
    AnyEffect,
    FilmResistance,
    Mechanics,
    Sei,
    SelfHeating,
    SeriesResistance,
    WeakCell,
)
from twin.pack_file import (
    PackFileError,
    cell_reference,
    effects_of,
    mechanics_of,
    parse_pack_file,
)

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
    assert effects_of(file) == (SelfHeating(heat_transfer_W_m2_K=12.0),)


def test_what_is_absent_stays_unknown() -> None:
    file = parse_pack_file(PACK, name="pack.toml")
    assert file.pack.capacity_ah is None
    assert file.start.soc is None
    assert effects_of(file) == effects_of(None) == (SelfHeating(),)
    assert mechanics_of(file) == mechanics_of(None) == Mechanics()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PACK + "sereal = 'x'\n", "unknown key pack.sereal: did you mean pack.serial?"),
        (PACK + "[strat]\nsoc = 1\n", "unknown key strat: did you mean start?"),
        (PACK + "[start]\nambient_c = 20\n", "did you mean environment.ambient_c?"),
        (PACK + "[start]\nsoc = 100\n", "start.soc: Input should be less than or equal to 1"),
        (PACK.replace("4", "4.5"), "pack.series: expected a whole number, without quotes"),
        (PACK + 'capacity_ah = "2.2"\n', "capacity_ah: expected a number, without quotes (got '2"),
        (PACK + "[start]\nsoc = true\n", "start.soc: expected a number, without quotes (got True)"),
        (PACK + "capacity_ah = " + "9" * 5000 + "\n", "not valid TOML"),
        (PACK + "x = " + "[" * 3000 + "]" * 3000, "not valid TOML"),
        (
            PACK + "[standard_errors.current_gain]\ngain = inf\n",
            "standard_errors.current_gain.gain = inf: expected a number from",
        ),
        (
            PACK + "[standard_errors.current_gain]\ngain = 1" + "0" * 400 + "\n",
            "expected a number from",
        ),
        (PACK + "serial = 7\n", "pack.serial: expected text in quotes (got 7)"),
        (PACK + '[twin]\nphysics = "sei"\n', "twin.physics: expected a list in brackets"),
        ("start = 1\n" + PACK, "start: expected a table (got 1)"),
        (PACK.replace("4", "0"), "pack.series"),
        (PACK + "capacity_ah = nan\n", "pack.capacity_ah"),
        (PACK + "capacity_ah = -2.2\n", "pack.capacity_ah"),
        ('[pack]\nname = "a"\n', "pack.cell is missing; pack.series is missing"),
        ("", "pack is missing"),
        ("[pack", "not valid TOML"),
        (PACK + "[environment]\nheat_transfer_W_m2_K = inf\n", "heat_transfer_W_m2_K"),
        (PACK + "[environment]\nheat_transfer_std_W_m2_K = inf\n", "heat_transfer_std_W_m2_K"),
    ],
)
def test_a_bad_file_is_refused_by_name_and_key(text: str, said: str) -> None:
    with pytest.raises(PackFileError, match=r"^pack\.toml: ") as error:
        parse_pack_file(text, name="pack.toml")
    assert said in str(error.value)


def listing(*names: str) -> str:
    return f"[twin]\nphysics = {list(names)}\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PACK + "capacity_ah = 2200\n", "(got 2200); it is in Ah, 2.2 for 2200 mAh"),
        (PACK + "[start]\nsoc = 90.0\n", "(got 90.0); it is a share, 0.9 for 90 %"),
        (PACK + "[start]\ntemperature_c = 273.15\n", "(got 273.15); it is in °C, 25 for 298.15 K"),
        (PACK + "[environment]\nambient_c = 298\n", "(got 298); it is in °C, 25 for 298.15 K"),
    ],
)
def test_a_number_in_another_unit_is_told_the_right_one(text: str, said: str) -> None:
    with pytest.raises(PackFileError) as refused:
        parse_pack_file(text, name="pack.toml")
    assert str(refused.value).endswith(said)


def test_every_effect_can_be_switched_on_by_its_name() -> None:
    file = parse_pack_file(PACK + listing(*EFFECTS), name="pack.toml")
    assert effects_of(file) == tuple(kind() for kind in EFFECTS.values())


def test_what_the_search_calls_otherwise_is_told() -> None:
    with pytest.raises(PackFileError, match=r"'plating_stripping' \(what `twin explain` finds as"):
        parse_pack_file(PACK + listing("plating_stripping"), name="pack.toml")


def test_no_effects_is_a_choice_too() -> None:
    assert effects_of(parse_pack_file(PACK + listing(), name="pack.toml")) == ()


@pytest.mark.parametrize(
    ("listed", "table", "expected"),
    [
        ("series_resistance", "resistance_ohm = 0.012", SeriesResistance(resistance_ohm=0.012)),
        (
            "series_resistance",
            "resistance_ohm = 0.012\noutside = 1",
            SeriesResistance(resistance_ohm=0.012, outside=1.0),
        ),
        ("film_resistance", "negative_ohm_m2 = 1e-3", FilmResistance(negative_ohm_m2=1e-3)),
        ("sei", "strength = 2", Sei(strength=2.0)),
        ("weak_cell", "cell = 2\nsoc_offset = -0.1", WeakCell(cell=2, soc_offset=-0.1)),
    ],
)
def test_the_numbers_of_an_effect_are_in_its_table(
    listed: str, table: str, expected: AnyEffect
) -> None:
    text = PACK + listing("self_heating", listed) + f"[effects.{listed}]\n{table}\n"
    assert effects_of(parse_pack_file(text, name="pack.toml")) == (SelfHeating(), expected)


def test_weak_cells_may_be_several_and_elastic_constants_have_a_table() -> None:
    text = PACK + listing("weak_cell", "cracking")
    text += "[[effects.weak_cell]]\ncapacity_factor = 0.9\n"
    text += "[[effects.weak_cell]]\ncell = 4\nresistance_ohm = 0.01\n"
    file = parse_pack_file(text + "[mechanics]\nnegative_poisson = 0.25\n", name="pack.toml")
    weak = WeakCell(capacity_factor=0.9), WeakCell(cell=4, resistance_ohm=0.01)
    assert effects_of(file)[:2] == weak
    assert mechanics_of(file) == Mechanics(negative_poisson=0.25)


LEADS = PACK + listing("series_resistance") + "[effects.series_resistance]\n"
WEAK = PACK + listing("weak_cell") + "[effects.weak_cell]\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PACK + listing("memory"), "no effect 'memory'; it has self_heating, sei"),
        (PACK + listing("sei", "sei"), "'sei' is listed twice"),
        (LEADS + "resistance_om = 0.1", "did you mean effects.series_resistance.resistance_ohm?"),
        (LEADS + "resistance_ohm = 5", "resistance_ohm = 5: expected a number from 0 to 0.5 Ohm"),
        (LEADS + "resistance_ohm = nan", "resistance_ohm = nan: expected a number"),
        (LEADS + "resistance_ohm = '5'", "resistance_ohm = '5': expected a number"),
        (LEADS + "resistance_ohm = true", "resistance_ohm = True: expected a number"),
        (LEADS, "nothing without its number: give resistance_ohm in [effects.series_resistance]"),
        (LEADS + "outside = 1", "nothing without its number: give resistance_ohm in"),
        (PACK + listing("series_resistance"), "nothing without its number: give resistance_ohm"),
        (WEAK + "cell = 2", "give capacity_factor or soc_offset or resistance_ohm"),
        (WEAK + "cell = 5\ncapacity_factor = 0.9", "cell = 5: expected 1 to 4, or 0"),
        (WEAK + "cell = 1.5\ncapacity_factor = 0.9", "cell = 1.5: expected a whole number"),
        (WEAK + "place = 2", "unknown key effects.weak_cell.place: did you mean"),
        (PACK + "[effects.sei]\nstrength = 2", "twin.physics does not list 'sei'"),
        (PACK + "[effects.say]\nstrength = 2", "unknown key effects.say: did you mean effects.se"),
        (PACK + "[effects]\nstrength = 2", "unknown key effects.strength: did you mean effects."),
        (PACK + listing("sei") + "[effects]\nsei = 2", "effects.sei = 2: expected a table"),
        (
            PACK + listing("self_heating") + "[effects.self_heating]\nheat = 2",
            "its number is environment.heat_transfer_W_m2_K",
        ),
        (PACK + "[mechanics]\nnegative_poisson = 0.25", "twin.physics lists none of cracking"),
        (
            PACK + listing("cracking") + "[mechanics]\npoisson = 0.25",
            "unknown key mechanics.poisson: did you mean mechanics.",
        ),
        (
            PACK
            + listing("stress_enhanced_diffusion")
            + "[effects.stress_enhanced_diffusion]\na = 1",
            "unknown key effects.stress_enhanced_diffusion.a: it has no numbers",
        ),
        (
            PACK + "[standard_errors.solid_difusion_positive]\ndiffusivity_factor = 0.1",
            "did you mean standard_errors.solid_diffusion_positive?",
        ),
        (
            PACK + "[standard_errors.solid_diffusion_positive]\ndiffusivity = 0.1",
            "did you mean standard_errors.solid_diffusion_positive.diffusivity_factor?",
        ),
        (
            PACK + "[standard_errors.solid_diffusion_positive]\ndiffusivity_factor = -0.1",
            "diffusivity_factor = -0.1: expected a number from 1e-12 to 1e+12",
        ),
    ],
)
def test_physics_that_cannot_be_is_refused_by_key(text: str, said: str) -> None:
    with pytest.raises(PackFileError, match=r"^pack\.toml: ") as error:
        parse_pack_file(text, name="pack.toml")
    assert said in str(error.value)


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


def started(soc: float, offset: float, *of_weak: float) -> str:
    text = PACK + f"[start]\nsoc = {soc}\n" + listing("initial_soc", *["weak_cell"][: len(of_weak)])
    text += f"[effects.initial_soc]\noffset = {offset}\n"
    return text + "".join(f"[[effects.weak_cell]]\nsoc_offset = {w}\n" for w in of_weak)


@pytest.mark.parametrize(
    ("text", "start"),
    [
        (started(1.0, 0.5), "1.5"),
        (started(0.2, -0.3), "-0.1"),
        (started(0.9, 0.05, 0.2), "1.15"),
        (started(0.5, 0.0, -0.6), "-0.1"),
        (started(0.9, 0.5, -0.5, -0.5, -0.5), "1.4"),
    ],
)
def test_a_charge_at_the_start_that_no_cell_can_have_is_refused(text: str, start: str) -> None:
    with pytest.raises(PackFileError, match=r"^pack\.toml: start\.soc = ") as error:
        parse_pack_file(text, name="pack.toml")
    assert f"lets a cell start at {start}: expected 0 to 1.1 together" in str(error.value)


@pytest.mark.parametrize(
    "text",
    [
        started(1.0, 0.1),
        started(0.3, -0.3),
        started(0.9, 0.5, -0.5, -0.5, -0.5, -0.5),
        started(1.0, 0.5).replace("soc = 1.0", ""),
    ],
)
def test_a_charge_that_the_cells_can_have_or_that_the_log_will_tell_is_taken(text: str) -> None:
    assert parse_pack_file(text, name="pack.toml").pack.series == 4
