"""DataFlash logs cut, overwritten, mended and imitated: what is recovered, what is said."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.errors import LogDamaged, LogError, NotALog
from sample_logs import write_dataflash as w
from tests.flightlogs.dataflash_flight import (
    BOOT_S,
    CURRENT,
    PACK,
    SINGLE,
    VOLTAGE,
    T,
    binary,
    codes,
    flight,
    old_current,
    read,
    text,
    whole,
)

ANY = np.random.default_rng(7)


def test_what_no_sensor_can_have_said_is_left_out_and_counted() -> None:
    struck = np.isin(np.arange(T.size), [100, 200])
    log = read(binary([w.battery(replace(PACK, current_A=np.where(struck, 1e30, CURRENT)))]))
    np.testing.assert_array_equal(np.isnan(log.batteries[0].current_A), struck)
    assert "impossible_values" in codes(log)


def test_parameters_dumped_long_before_the_data_are_no_part_of_its_time() -> None:
    log = read(binary([w.parameters({"FRAME": 1.0}), *flight()[2:]]))
    assert (log.duration_s, log.warnings) == (pytest.approx(T[-1]), ())


@pytest.mark.parametrize(
    "lines",
    [
        b"FMT, 212, 15, PM, QI, TimeUS,LogDrop\nPM, 21000000, 3\nPM, 22000000, 3#7\n"
        b"PM, 23000000, inf\nPM, 24000000, 4\n",
        b"FMT, 213, 15, DSF, QI, TimeUS,Dp\nDSF, 21000000, 7\nDSF, 22000000, 3#7\n",
    ],
    ids=["PM", "DSF"],
)
def test_a_damaged_row_of_the_loggers_own_counts_as_nothing(lines: bytes) -> None:
    (said,) = [w for w in read(text(flight()) + lines).warnings if w.code == "logger_dropped"]
    assert said.message == "the logger says it could not write 7 messages"


def test_a_damaged_first_fix_leaves_the_next_to_tell_the_date() -> None:
    content = text(flight())
    first = next(line for line in content.splitlines() if line.startswith(b"GPS,"))
    fields = first.split(b",")
    labels = next(line for line in content.splitlines() if b", GPS," in line).split(b",")[5:]
    fields[1 + [label.strip() for label in labels].index(b"GMS")] = b" 12#4"
    spoilt = content.replace(first, b",".join(fields), 1)
    assert spoilt != content
    whole_utc, spoilt_utc = read(content).start_utc, read(spoilt).start_utc
    assert whole_utc is not None
    assert spoilt_utc is not None
    assert abs((spoilt_utc - whole_utc).total_seconds()) < 0.01


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(whole())))
def test_a_log_cut_anywhere_gives_its_beginning_or_says_why_not(size: int) -> None:
    full = read(whole()).batteries[0]
    try:
        log = read(whole()[:size])
    except LogError:
        assert size < 12_000  # the records that describe the others and the parameters
        return
    assert 0 < log.recovered_fraction <= 1
    for battery in log.batteries:
        n = battery.time_s.size
        np.testing.assert_array_equal(battery.time_s, full.time_s[:n])
        np.testing.assert_array_equal(battery.voltage_V, full.voltage_V[:n])


def test_a_log_that_ends_inside_a_message_says_so() -> None:
    data, lines = whole(), text(flight())
    last, line = data.rindex(b"\xa3\x95"), lines.rindex(b"\n", 0, -1) + 1
    comma = lines.index(b",", line)
    for cut in (*(data[:k] for k in range(last + 1, len(data))), lines[: line + 2], lines[:comma]):
        (said,) = (w for w in read(cut).warnings if w.code in ("log_truncated", "damaged"))
        assert said.message == "ends inside a message: what came after is not known"
    for ended in (data, data[:last], data + bytes(100), data + b"\xff" * 100, lines, lines[:line]):
        assert "log_truncated" not in codes(read(ended))


@pytest.mark.parametrize("data", [whole(), text(flight())], ids=["binary", "text"])
def test_places_that_are_hardly_a_part_of_the_file_are_counted_all_the_same(data: bytes) -> None:
    spoilt, head = bytearray(data), b"BAT, " if data.startswith(b"FMT") else b"\xa3\x95"
    for share in (0.5, 0.7):
        spoilt[data.index(head, int(share * len(data)))] ^= 1
    log = read(bytes(spoilt))
    assert log.recovered_fraction > 0.999
    lost = round((1 - log.recovered_fraction) * len(data))
    (said,) = (w.message for w in log.warnings if w.code == "damaged")
    assert said == (
        f"damaged places: 2; {lost} of {len(data)} bytes ({lost / len(data):.2%}) could not be "
        "decoded"
    )


@pytest.mark.parametrize("size", [1, 100])
@pytest.mark.parametrize("byte", [b"\0", b"\xff"], ids=["0", "255"])
def test_a_last_page_that_was_filled_is_no_damage(byte: bytes, size: int) -> None:
    assert read(whole() + byte * size).warnings == ()
    assert "damaged" in codes(read(whole() + b"x" + byte * size))


@settings(max_examples=30, deadline=None)
@given(st.integers(2_000, len(whole()) - 600), st.integers(1, 500), st.integers(0, 2**32 - 1))
def test_what_lies_behind_a_damaged_stretch_is_recovered(at: int, size: int, seed: int) -> None:
    noise = np.random.default_rng(seed).bytes(size)
    log = read(whole()[:at] + noise + whole()[at + size :])
    assert log.recovered_fraction > 0.97 - size / len(whole())
    (battery,) = [b for b in log.batteries if b.label == "BAT[0]"]  # noise can number another
    assert battery.time_s.size >= T.size - 1 - size // 20
    assert battery.time_s[-1] == pytest.approx(T[-1])


def test_bytes_lost_inside_a_record_cost_that_record_and_make_up_none() -> None:
    full = read(whole()).batteries[0]
    for at in range(len(whole()) // 2, len(whole()) // 2 + 200, 3):
        log = read(whole()[:at] + whole()[at + 7 :])
        (battery,) = log.batteries
        assert T.size - 1 <= battery.time_s.size <= T.size
        assert set(battery.time_s) <= set(full.time_s)
        assert set(battery.voltage_V) <= set(full.voltage_V)
        assert log.recovered_fraction > 0.99


def test_a_head_that_noise_imitates_is_not_believed() -> None:
    fake = b"\xa3\x95" + bytes([131]) + bytes(20)  # of the battery's type, followed by nothing
    log = read(whole()[:20_000] + b"\x00" + fake + whole()[20_000:])
    assert log.recovered_fraction < 1
    np.testing.assert_array_equal(log.batteries[0].voltage_V, read(whole()).batteries[0].voltage_V)


@pytest.mark.parametrize("data", [b"", b"hello\n" * 50, ANY.bytes(5000), b"\0" * 5000])
def test_what_is_no_log_is_said_to_be_none(data: bytes) -> None:
    with pytest.raises(NotALog):
        read(data)


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=400))
def test_noise_behind_a_log_head_raises_nothing_but_our_errors(noise: bytes) -> None:
    for head in (whole()[:1100], b"FMT, 150, 20, CURR, QBff, TimeUS,I,Volt,Curr\nCURR, "):
        with suppress(LogError):
            read(head + noise)


def test_a_log_that_only_describes_itself_is_damaged() -> None:
    with pytest.raises(LogDamaged, match=r"flight\.bin"):
        read(whole()[:500])


def test_an_empty_format_a_comma_and_a_torn_line_do_no_harm_to_a_text_log() -> None:
    lines = text(flight()).decode().splitlines()
    strange = ["FMT, 10, 3, STRT, , ", "STRT, ", "MSG, 20000000, one, two, three", "BAT, 2000"]
    log = read("\r\n".join([*lines[:20], *strange, *lines[20:]]).encode())
    assert log.batteries[0].time_s.size == T.size
    assert 0.999 < log.recovered_fraction < 1


@pytest.mark.parametrize("encode", [binary, text])
def test_a_type_described_anew_keeps_the_layout_with_more_rows(encode) -> None:
    short = w.Table(name="BAT", format="Qf", columns={"TimeUS": [9e7, 9.1e7], "Volt": [1.0, 1.0]})
    for data in (encode(flight()) + encode([short]), encode([short]) + encode(flight())):
        np.testing.assert_allclose(read(data).batteries[0].voltage_V, VOLTAGE, rtol=SINGLE)


@pytest.mark.parametrize("ahead_s", [5.0, 9e8])
def test_a_stray_stamp_is_left_out_and_counted(ahead_s: float) -> None:
    stamps = (T + BOOT_S + ahead_s * (np.arange(T.size) == 300)) * 1e6
    log = read(binary([replace(old_current("Qfff", 1.0, TimeUS=stamps), order_s=T)]))
    assert "stray_stamps" in codes(log)
    assert log.batteries[0].time_s.size == T.size - 1
    assert log.duration_s == pytest.approx(T[-1])


def test_a_clock_that_steps_back_goes_on_from_there() -> None:
    stamps = (T + BOOT_S - 15 * (T >= 30)) * 1e6
    log = read(binary([replace(old_current("Qfff", 1.0, TimeUS=stamps), order_s=T)]))
    assert "clock_stepped_back" in codes(log)
    assert log.duration_s == pytest.approx(T[-1], abs=0.11)  # one period is lost at the seam


def test_nothing_is_printed(capfd) -> None:
    read(whole()[:9000] + ANY.bytes(300) + whole()[9300:])
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")
