"""Where the numbers of the simulated pack come from."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyze.pack_choice import cell_beside, cell_of, read_pack
from analyze.start import pack_of, pack_use, rest_voltage
from flightlogs.log import LogWarning
from reports.flight import PackUse
from tests.reports import example
from twin.at_rest import open_circuit_V
from twin.builtin import builtin_text, load_cell
from twin.effects import AnyEffect, InitialSoc, VoltageGain, WeakCell
from twin.load_csv import LoadTable
from twin.mismatch import START_SOC
from twin.pack import PackError
from twin.pack_file import parse_pack_file

CELL, _ = cell_of("lipo_2200")
FILE = parse_pack_file(
    """
    [pack]
    name = "mine"
    cell = "lipo_2200"
    capacity_ah = 3.3
    series = 6
    parallel = 2
    serial = "of the file"
    [start]
    soc = 0.7
    temperature_c = 10.0
    [environment]
    ambient_c = 5.0
    heat_transfer_W_m2_K = 20.0
    heat_transfer_std_W_m2_K = 4.0
    [twin]
    physics = []
    cell_error_mv = 12.5
    [standard_errors.solid_diffusion_positive]
    diffusivity_factor = 0.1
    """,
    name="pack.toml",
)


def test_without_a_pack_file_everything_is_from_the_log_or_stated() -> None:
    use = pack_use(example.recording(), None, CELL, builtin=True)
    assert (use.series, use.parallel) == (4, 1)
    assert use.capacity_C == example.recording().capacity_C
    assert not use.calibrated
    assert use.origins["series"] == "cells in series inferred from the voltage"
    assert use.origins["capacity_C"] == "parameter in the log"
    assert use.origins["initial_K"] == "not measured: 25 °C assumed"
    assert use.origins["initial_soc"].startswith("from the voltage at rest")
    assert use.effect_ids == ("self_heating",)
    assert pack_of(use, CELL).heat_transfer_W_m2_K is None  # a default states nothing
    assert pack_of(use, CELL).cell_error_V == 0.0


def test_a_capacity_nobody_knows_is_that_of_the_cell_and_said_so() -> None:
    use = pack_use(example.recording(capacity_C=None), None, CELL, builtin=True)
    assert use.capacity_C == CELL.nominal_capacity_C
    assert "not known" in use.origins["capacity_C"]
    assert not use.capacity_known
    assert use.rated_C is None


def test_a_capacity_that_may_be_the_autopilots_default_is_no_rating() -> None:
    doubt = LogWarning("capacity_doubtful", "what ArduPilot takes where nobody entered one")
    recording = replace(example.recording(), warnings=(doubt,))
    use = pack_use(recording, None, CELL, builtin=True)
    assert use.capacity_C == recording.capacity_C
    assert use.origins["capacity_C"].endswith("which may be ArduPilot's default")
    assert not use.capacity_known
    assert use.rated_C is None
    assert pack_use(recording, FILE, CELL, builtin=False).capacity_known


def test_the_pack_file_wins_over_the_log_and_every_key_of_it_counts() -> None:
    use = pack_use(example.recording(), FILE, CELL, builtin=False)
    pack = pack_of(use, CELL)
    assert (pack.series, pack.parallel, pack.capacity_C) == (6, 2, 3.3 * 3600)
    assert (pack.initial_soc, pack.initial_K) == (0.7, 283.15)
    assert not pack.soc_by_rest
    assert (use.ambient_K, use.heat_transfer_W_m2_K) == (278.15, 20.0)
    assert pack.heat_transfer_std_W_m2_K == 4.0
    assert pack.standard_errors == {"solid_diffusion_positive": {"diffusivity_factor": 0.1}}
    assert pack.cell_error_V == 0.0125
    assert pack.heat_transfer_W_m2_K == 20.0  # what is to be expected of a heating not switched on
    assert pack.effects == ()
    assert use.calibrated
    assert use.serial == "of the file"
    assert use.rated_C == pytest.approx(3.3 * 3600)


def test_a_serial_number_in_the_log_and_a_measured_temperature_win_over_the_file() -> None:
    temperature = np.full(example.T.size, 285.0)
    temperature[:5] = np.nan
    temperature[5] = 284.0  # a sensor has noise
    recording = example.recording(serial="of the log", temperature_K=temperature)
    use = pack_use(recording, FILE, CELL, builtin=False)
    assert use.serial == "of the log"
    assert use.initial_K == 285.0


def test_the_heat_transfer_of_the_file_reaches_the_effect() -> None:
    file = FILE.model_copy(update={"twin": FILE.twin.model_copy(update={"physics": None})})
    (heating,) = pack_of(pack_use(example.recording(), file, CELL, builtin=False), CELL).effects
    assert heating.heat_transfer_W_m2_K == 20.0


def recorded(current: np.ndarray, open_V: float, resistance: float):
    return example.recording(
        current_A=current, voltage_V=open_V - resistance * current, resistance_ohm=resistance
    )


def test_rest_is_found_before_take_off_and_the_idle_current_is_taken_back() -> None:
    known = rest_voltage(recorded(example.CURRENT, 16.2, 0.03))
    assert known is not None
    assert known.value == pytest.approx(16.2)
    assert "at rest" in known.origin


def test_a_sensor_that_was_on_before_the_autopilot_does_not_hide_the_rest() -> None:
    whole = recorded(example.CURRENT, 16.2, 0.03)
    early = np.arange(-40.0, 0.0, 0.2)
    before = {
        "time_s": early, "current_A": np.full(early.size, 0.5),
        "voltage_V": np.full(early.size, np.nan), "velocity_m_s": np.zeros((early.size, 3)),
        "velocity_setpoint_m_s": np.zeros((early.size, 3)),
        "in_air": np.zeros(early.size, dtype=bool),
    }  # fmt: skip
    joined = {name: np.concatenate([v, getattr(whole, name)]) for name, v in before.items()}
    known = rest_voltage(example.recording(**joined, resistance_ohm=0.03))
    assert known is not None
    assert known.value == pytest.approx(16.2)
    assert "at rest" in known.origin
    use = pack_use(example.recording(**joined, resistance_ohm=0.03), None, CELL, builtin=True)
    assert pack_of(use, CELL).soc_by_rest


def test_a_log_that_starts_in_the_air_is_said_to_have_no_rest() -> None:
    known = rest_voltage(recorded(np.full(example.T.size, 20.0), 16.2, 0.03))
    assert known is not None
    assert known.value == pytest.approx(16.2)
    assert "no rest in it" in known.origin


def test_a_voltage_the_cell_cannot_have_is_owned_up_to() -> None:
    use = pack_use(recorded(example.CURRENT, 17.4, 0.03), None, CELL, builtin=True)
    assert use.shown_soc == 1.0
    assert "4.350 V a cell; the cell cannot have that, 0.150 V off" in use.origins["initial_soc"]


def test_a_voltage_above_full_starts_full_unless_its_sensor_reads_high() -> None:
    """By 0.4 %: what a full pack's start was told by then is what it has, not 0.4 % less."""
    series = 4
    full_V = open_circuit_V(CELL, 1.0)
    use = pack_use(
        recorded(example.CURRENT, 1.004 * full_V * series, 0.03), None, CELL, builtin=True
    )
    assert use.shown_soc == 1.0
    own = pack_of(use, CELL)
    for gain, rests_V in ((1.0, full_V), (1.004, full_V), (1.01, 1.004 / 1.01 * full_V)):
        starts = replace(own, effects=(VoltageGain(gain=gain),)).numbers()["initial_soc"]
        assert open_circuit_V(CELL, starts) == pytest.approx(rests_V, abs=2e-4)


def test_neither_rest_nor_slope_is_a_full_pack_and_said_so() -> None:
    flying = example.recording(current_A=np.full(example.T.size, 20.0), resistance_ohm=None)
    assert rest_voltage(flying) is None
    use = pack_use(flying, None, CELL, builtin=True)
    assert use.initial_soc == 1.0
    assert "a full pack assumed" in use.origins["initial_soc"]


def test_a_log_without_voltage_is_a_full_pack_too() -> None:
    blind = example.recording(voltage_V=np.full(example.T.size, np.nan))
    assert pack_use(blind, None, CELL, builtin=True).initial_soc == 1.0


def test_the_pack_file_says_whether_the_cell_is_the_packs_own() -> None:
    use = pack_use(example.recording(), replace_series(4), CELL, builtin=True)
    assert not use.calibrated
    assert not use.series_inferred


def replace_series(series: int):
    table = FILE.pack.model_copy(update={"series": series})
    return FILE.model_copy(update={"pack": table})


def test_the_same_use_gives_the_same_pack() -> None:
    use = pack_use(example.recording(), FILE, CELL, builtin=False)
    assert pack_of(use, CELL) == pack_of(replace(use), CELL)


def test_a_pack_file_that_begins_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    """As the editor of Windows saves it."""
    text = '[pack]\nname = "a"\ncell = "lipo_2200"\nseries = 4\n'
    for name, encoding in (("plain", "utf-8"), ("marked", "utf-8-sig")):
        (tmp_path / f"{name}.toml").write_text(text, encoding=encoding)
    plain, marked = (read_pack(tmp_path / f"{name}.toml") for name in ("plain", "marked"))
    assert marked == plain


def test_a_cell_is_read_again_when_its_file_is_another(tmp_path: Path) -> None:
    (tmp_path / "pack.toml").write_text('[pack]\nname = "a"\ncell = "./c.json"\nseries = 4\n')
    for name in ("lipo_2200", "lg_m50"):
        (tmp_path / "c.json").write_text(builtin_text(name), encoding="utf-8")
        choice = read_pack(tmp_path / "pack.toml")
        assert cell_of(choice.cell)[0].name == load_cell(name).name
        assert cell_of(choice.cell)[0] is cell_of(choice.cell)[0]


def test_a_pack_file_in_a_folder_that_is_a_link_finds_the_cell_of_one_that_is_a_link(
    tmp_path: Path,
) -> None:
    for name in ("own", "far/below"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "own" / "c.json").write_text(builtin_text("lipo_2200"), encoding="utf-8")
    text = '[pack]\nname = "a"\ncell = "{}"\nseries = 4\n'
    (tmp_path / "own" / "pack.toml").write_text(text.format("./c.json"), encoding="utf-8")
    (tmp_path / "pack.toml").symlink_to("own/pack.toml")
    (tmp_path / "out").symlink_to("far/below", target_is_directory=True)
    choice, out = read_pack(tmp_path / "pack.toml"), tmp_path / "out" / "new.toml"
    out.write_text(text.format(cell_beside(choice.cell, out)), encoding="utf-8")
    assert cell_of(read_pack(out).cell)[0].name == CELL.name
    assert cell_beside("lipo_2200", out) == "lipo_2200"


@pytest.mark.parametrize(
    ("effect", "said"),
    [(InitialSoc(offset=0.6), "at 1.300: expected"), (WeakCell(soc_offset=-0.8), "weak_cell")],
)
def test_a_start_that_no_cell_can_have_is_refused(effect: AnyEffect, said: str) -> None:
    use = pack_use(example.recording(), FILE, CELL, builtin=False)
    with pytest.raises(PackError, match=said):
        pack_of(replace(use, effects=(effect,)), CELL)


def test_a_table_that_begins_in_flight_tells_about_how_full_the_pack_was() -> None:
    """As a log does: by the voltage under load and its slope on the current."""
    random, t = np.random.default_rng(4), np.arange(0.0, 60.0, 0.1)
    current_A = 10.0 + 3.0 * np.sin(t) + random.normal(0.0, 0.5, t.size)
    table = LoadTable(time_s=t, current_A=current_A, voltage_V=15.6 - 0.02 * current_A)
    file = replace_series(4)
    start = file.start.model_copy(update={"soc": None})
    use = pack_use(None, file.model_copy(update={"start": start}), CELL, builtin=True, table=table)
    assert not use.soc_known
    assert "no rest in it" in use.origins["initial_soc"]
    assert 4 * open_circuit_V(CELL, use.initial_soc) == pytest.approx(15.6, abs=0.02)


@pytest.mark.parametrize(
    ("idle_A", "noise_A", "at_rest"),
    [(0.0, 0.1, True), (0.4, 0.1, True), (0.3, 0.4, True), (1.5, 0.1, False)],
)
def test_noise_of_a_sensor_and_avionics_are_no_load(
    idle_A: float,
    noise_A: float,
    at_rest: bool,  # noqa: FBT001
) -> None:
    """By either the pack was taken to be full. A bench's weak current is one."""
    random, t = np.random.default_rng(4), np.arange(0.0, 60.0, 0.1)
    current_A = np.where(t < 5.0, idle_A, 10.0) + random.normal(0.0, noise_A, t.size)
    voltage_V = 16.4 - 0.02 * current_A + random.normal(0.0, 5e-3, t.size)
    table = LoadTable(time_s=t, current_A=current_A, voltage_V=voltage_V)
    file = replace_series(4)
    start = file.start.model_copy(update={"soc": None})
    use = pack_use(None, file.model_copy(update={"start": start}), CELL, builtin=True, table=table)
    assert use.soc_known is at_rest
    if at_rest:
        full = 4 * open_circuit_V(CELL, use.initial_soc)
        assert full == pytest.approx(16.4, abs=5e-3)


def test_how_well_a_rest_tells_the_charge_is_by_the_slope_of_the_open_circuit_voltage() -> None:
    """And by what the idle current took from it: slower losses than the slope of gusts shows."""
    t = np.arange(0.0, 60.0, 0.1)

    def use_at(volts: float, idle_A: float) -> PackUse:
        current_A = np.where(t < 5.0, idle_A, 10.0 + 3.0 * np.sin(t))
        table = LoadTable(time_s=t, current_A=current_A, voltage_V=volts - 0.02 * current_A)
        file = replace_series(4)
        start = file.start.model_copy(update={"soc": None})
        file = file.model_copy(update={"start": start})
        return pack_use(None, file, CELL, builtin=True, table=table)

    told = pack_use(None, FILE, CELL, builtin=True)
    assert told.soc_std == START_SOC
    steep, flat = use_at(16.4, 0.0), use_at(14.9, 0.0)
    assert START_SOC == steep.soc_std < flat.soc_std
    for use in (flat, use_at(14.9, 0.4)):
        idle_V = 2 * 0.02 * 0.4 / 4 if use is not flat else 0.0
        off_V = np.hypot(1e-3, idle_V)
        moved = [open_circuit_V(CELL, use.initial_soc + k * use.soc_std) for k in (-1, 1)]
        widest = max(abs(v - open_circuit_V(CELL, use.initial_soc)) for v in moved)
        assert widest == pytest.approx(off_V, rel=0.3)


@pytest.mark.parametrize(
    ("soc", "rows", "noise_V"),
    [(0.95, 1, 5e-3), (0.5, 3, 5e-3), (0.5, 12, 5e-3), (0.5, 3, 0.0), (0.97, 3, 2e-3)],
)
def test_a_start_by_a_noisy_rest_is_known_no_better_than_that(
    soc: float, rows: int, noise_V: float
) -> None:
    """Of one cell, by 40 draws: deviations and what is stated of them agree, on slope and flat."""
    t = np.arange(0.0, 120.0)
    current_A = np.where(t < rows, 0.0, 2.0)
    file = replace_series(1)
    start = file.start.model_copy(update={"soc": None})
    file = file.model_copy(update={"start": start})
    off = []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0.0, noise_V, t.size)
        clean_V = open_circuit_V(CELL, soc) - 0.02 * current_A - 1e-5 * np.maximum(t - rows, 0.0)
        table = LoadTable(time_s=t, current_A=current_A, voltage_V=clean_V + noise)
        use = pack_use(None, file, CELL, builtin=True, table=table)
        off.append((use.initial_soc - soc) / use.soc_std)
    assert np.sqrt(np.mean(np.square(off))) < 1.5
    assert np.max(np.abs(off)) < 4.0


def test_a_voltage_in_steps_tells_the_start_no_better_than_those() -> None:
    t = np.arange(0.0, 120.0)
    current_A = np.where(t < 10.0, 0.0, 2.0)
    smooth_V = open_circuit_V(CELL, 0.5) - 0.02 * current_A - 1e-4 * np.maximum(t - 10.0, 0.0)
    table = LoadTable(time_s=t, current_A=current_A, voltage_V=np.round(smooth_V / 0.02) * 0.02)
    file = replace_series(1)
    start = file.start.model_copy(update={"soc": None})
    use = pack_use(None, file.model_copy(update={"start": start}), CELL, builtin=True, table=table)
    assert START_SOC < abs(use.initial_soc - 0.5) < 2.0 * use.soc_std
