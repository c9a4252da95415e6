"""The sensor's CSV: every dialect gives the same numbers, every damage is counted and said."""

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.errors import LogError, NotALog
from flightlogs.sensor import SensorLog, keep_one_clock, read_sensor, saturated, spread_coarse
from flightlogs.sensor_table import moment, words

N = 300
TIME_S = np.round(5.0 + 0.1 * np.arange(N), 3)
CURRENT_A = np.round(15 + 5 * np.sin(0.3 * TIME_S) + 0.3 * np.cos(17 * TIME_S), 3)


def read(text: str | bytes) -> SensorLog:
    data = text.encode() if isinstance(text, str) else text
    return read_sensor(io.BytesIO(data), name="x.csv")


def table(header: str = "time_s,current_A", *, t=TIME_S, i=CURRENT_A, sep=",", end="\n") -> str:
    rows = [header] if header else []
    rows += [f"{a:.6f}{sep}{b:.4f}" for a, b in zip(t, i, strict=True)]
    return end.join(rows) + end


def codes(log: SensorLog) -> set[str]:
    return {w.code for w in log.warnings}


def same(log: SensorLog) -> None:
    assert log.time_s == pytest.approx(TIME_S - TIME_S[0], abs=1e-6)
    assert log.current_A == pytest.approx(CURRENT_A, abs=1e-9)


@pytest.mark.parametrize(
    ("header", "per_second", "per_ampere"),
    [
        ("time_s,current_A", 1, 1),
        ("Time [ms],Current [mA]", 1e3, 1e3),
        ("Test Time / s,Current / A", 1, 1),
        ("timestamp_us,I (A)", 1e6, 1),
        ("timeMs,currentA", 1e3, 1),
        ("millis,amps", 1e3, 1),
        ("t[s],I[mA]", 1, 1e3),
        ("timestamp_ns,current_cA", 1e9, 1e2),
        ("t;I", 1, 1),
    ],
)
def test_any_header_that_names_quantity_and_unit_will_do(header, per_second, per_ampere) -> None:
    sep = ";" if ";" in header else ","
    log = read(table(header, t=TIME_S * per_second, i=CURRENT_A * per_ampere, sep=sep))
    same(log)
    assert ("time_unit_inferred" in codes(log)) == (header == "t;I")


@pytest.mark.parametrize(
    ("header", "place", "said"),
    [
        ("time_s,shunt (mV),Current (A)", 1, ""),
        ("time_s,current_s,current_A", 1, ""),
        ("time_s,current_1 (A),current_2 (A),current_total (A)", 2, "current_total (A) is used"),
        ("time_s,I 1,I battery,current_A", 1, "I battery is used, not I 1, current_A"),
        ("time_s,current,current (A)", 1, "current (A) is used, not current"),
        ("time_s,current_1 (A),current_2 (A)", 0, "current_1 (A) is used, not current_2 (A)"),
        ("time_s,Bus Voltage,Shunt Voltage,Current,Power", 2, ""),
        ("time_s,pack current,Spannung,U", 0, ""),
        (
            "time_s,Battery Current Limit (A),Current",
            1,
            "Current is used, not Battery Current Limi",
        ),
        ("time_s,i_set_A,i_avg_A,i", 2, "i is used, not i_set_A, i_avg_A"),
    ],
)
def test_of_several_columns_the_current_of_the_pack_is_taken(header, place, said) -> None:
    others = header.count(",")
    rows = [
        f"{t:.3f}," + ",".join(f"{i if k == place else 0.2 * i:.4f}" for k in range(others))
        for t, i in zip(TIME_S, CURRENT_A, strict=True)
    ]
    log = read(f"{header}\n" + "\n".join(rows) + "\n")
    assert log.current_A == pytest.approx(CURRENT_A)
    assert ("several_currents" in codes(log)) == bool(said)
    assert not said or any(said in w.message for w in log.warnings)


@pytest.mark.parametrize(
    ("header", "place"),
    [
        ("time_s,Shunt Voltage,Bus Voltage,Current", 1),
        ("time_s,Cell 1 (V),U max,pack voltage,u_cell,Current", 2),
        ("time_s,Voltage Limit (V),voltage,Current", 1),
    ],
)
def test_of_several_columns_the_voltage_of_the_pack_is_taken(header, place) -> None:
    others = header.count(",") - 1
    rows = [
        f"{t:.3f}," + ",".join("16.2" if k == place else "4" for k in range(others)) + f",{i:.4f}"
        for t, i in zip(TIME_S, CURRENT_A, strict=True)
    ]
    log = read(f"{header}\n" + "\n".join(rows) + "\n")
    assert log.voltage_V is not None
    assert np.all(log.voltage_V == 16.2)


def test_a_unit_that_is_not_known_is_doubted_as_what_it_is() -> None:
    (warning,) = read(table("time_s,current_adc")).warnings
    assert warning.code == "current_unit_inferred"
    assert "current_adc names no unit known here: taken for A" in warning.message


def test_nanoseconds_since_1970_are_a_time_without_a_unit_too() -> None:
    log = read(table("timestamp,current_A", t=1e9 * (1.7e9 + TIME_S)))
    assert log.time_s == pytest.approx(TIME_S - TIME_S[0], abs=1e-6)


@pytest.mark.parametrize("sep", [",", ";", "\t", " ", "|"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_delimiter_line_ends_and_byte_order_mark_make_no_difference(sep, end, mark) -> None:
    log = read(mark + table(f"time_s{sep}current_A", sep=sep, end=end).encode())
    same(log)
    assert not log.warnings


def test_decimal_commas_are_read() -> None:
    same(read(table("time_s;current_A", sep=";").replace(".", ",")))


def test_utf_16_is_read() -> None:
    same(read(table().encode("utf-16")))


def test_a_file_without_header_is_read_and_says_what_it_took_for_what() -> None:
    log = read(table("", t=TIME_S * 1000))
    same(log)
    assert {"no_header", "time_unit_inferred", "current_unit_inferred"} <= codes(log)


def test_a_commented_header_counts_and_other_comments_do_not() -> None:
    same(
        read("# logger 1.2\n# time_ms, current_mA\n" + table("", t=TIME_S * 1e3, i=CURRENT_A * 1e3))
    )


def test_dates_are_times_and_midnight_is_no_reset() -> None:
    seconds = (86400 - 10 + TIME_S) % 86400
    rows = [
        f"{int(s // 3600):02d}:{int(s // 60 % 60):02d}:{s % 60:06.3f};{i:.4f}"
        for s, i in zip(seconds, CURRENT_A, strict=True)
    ]
    log = read("time;current_A\n" + "\n".join(rows) + "\n")
    assert log.time_s == pytest.approx(TIME_S - TIME_S[0], abs=2e-3)
    assert not log.counts.resets


@pytest.mark.parametrize(
    "text",
    ["2024-03-01T12:00:00.250Z", "2024-03-01 12:00:00,250", "01.03.2024 12:00:00.250"],
)
def test_a_date_is_read_in_several_spellings(text) -> None:
    assert moment(text) == pytest.approx(1709294400.25)


def test_date_and_time_of_day_in_two_columns_make_one_stamp() -> None:
    rows = [f"2024-03-01,12:00:{s:06.3f},{i:.4f}" for s, i in zip(TIME_S, CURRENT_A, strict=True)]
    same(read("date,time,current_A\n" + "\n".join(rows) + "\n"))


LOOPS = np.random.default_rng(5).normal(100, 3, N).round()


@pytest.mark.parametrize(
    ("header", "beside"),
    [
        ("time_s,loop time (us),current_A", 1e3 * LOOPS),
        ("Time (s),Time diff (ms),Current (A)", np.where(np.arange(N) % 90 < 3, 101, 100)),
        ("Time (s),Time step (ms),Current (A)", np.full(N, 100)),
    ],
)
def test_a_duration_beside_the_time_is_no_clock(header, beside) -> None:
    rows = zip(TIME_S, beside, CURRENT_A, strict=True)
    same(read("\n".join([header, *(f"{t},{b:.0f},{i}" for t, b, i in rows)]) + "\n"))


def test_milliseconds_within_the_second_leave_the_time_to_date_and_time_of_day() -> None:
    rows = [
        f"2024-03-01;12:00:{int(t):02d};{round(1e3 * (t % 1)) % 1000};{i}"
        for t, i in zip(TIME_S, CURRENT_A, strict=True)
    ]
    log = read("\n".join(["Date;Time;ms;Current [A]", *rows]) + "\n")
    assert log.time_s == pytest.approx(TIME_S - TIME_S[0], abs=0.02)


def test_a_clock_that_often_starts_anew_is_still_the_only_one() -> None:
    log = read(table(t=np.concatenate([TIME_S[:9], TIME_S[:20], TIME_S[:9]]), i=CURRENT_A[:38]))
    assert log.current_A == pytest.approx(CURRENT_A[9:29])


def test_stamps_to_the_second_are_spread_over_it() -> None:
    log = read(table(t=np.floor(TIME_S + 0.45)))
    assert "coarse_stamps" in codes(log)
    assert np.diff(log.time_s) == pytest.approx(0.1, abs=1e-9)


def test_voltage_is_kept_in_volt() -> None:
    rows = [f"{t},{i},{15000 + k}" for k, (t, i) in enumerate(zip(TIME_S, CURRENT_A, strict=True))]
    log = read("time_s,current_A,voltage_mV\n" + "\n".join(rows) + "\n")
    assert log.voltage_V == pytest.approx(15 + 1e-3 * np.arange(N))


def test_discharge_counted_negative_is_turned_and_said() -> None:
    log = read(table(i=-CURRENT_A))
    same(log)
    assert "current_sign_turned" in codes(log)


def test_a_cut_last_line_is_left_out_and_said() -> None:
    log = read(table()[:-3])
    assert len(log.time_s) == N - 1
    assert log.current_A == pytest.approx(CURRENT_A[:-1])
    assert (log.counts.rows, log.counts.malformed) == (N, 1)
    assert "last_line_cut" in codes(log)


def test_a_header_in_the_middle_is_counted() -> None:
    lines = table().splitlines()
    log = read("\n".join([*lines[:100], lines[0], *lines[100:]]) + "\n")
    same(log)
    assert log.counts.repeated_headers == 1
    assert "header_repeated" in codes(log)


def test_after_a_reset_only_the_longest_piece_is_kept() -> None:
    t = np.concatenate([TIME_S[:100], TIME_S[:200] - TIME_S[0]])
    log = read(table(t=t))
    assert log.current_A == pytest.approx(CURRENT_A[100:])
    assert (log.counts.resets, log.counts.rows_after_reset) == (1, 100)
    assert "sensor_reset" in codes(log)


@pytest.mark.parametrize("stray", [99999.0, -1.0])
def test_a_single_stray_stamp_costs_one_row_and_no_piece(stray) -> None:
    t = TIME_S.copy()
    t[120] = stray
    log = read(table(t=t))
    assert log.current_A == pytest.approx(np.delete(CURRENT_A, 120))
    assert (log.counts.stray_stamps, log.counts.resets) == (1, 0)


def test_rows_that_repeat_a_stamp_are_counted() -> None:
    log = read(table(t=np.insert(TIME_S, 50, TIME_S[50]), i=np.insert(CURRENT_A, 51, 3.0)))
    same(log)
    assert log.counts.duplicate_stamps == 1


@pytest.mark.parametrize("times", [2, 3])
def test_rows_that_are_written_again_are_dropped_and_counted(times) -> None:
    log = read(table(t=np.repeat(TIME_S, times), i=np.repeat(CURRENT_A, times)))
    same(log)
    assert log.counts.duplicate_stamps == (times - 1) * N
    assert codes(log) == {"duplicate_stamps"}


def test_coarse_stamps_of_a_current_that_stands_still_at_times_are_spread() -> None:
    still = np.where(TIME_S < 15, 0.44, CURRENT_A)
    log = read(table(t=np.floor(TIME_S + 0.45), i=still))
    assert log.current_A == pytest.approx(still)
    assert codes(log) == {"coarse_stamps"}


@pytest.mark.parametrize(
    ("value", "field"),
    [("nan", "missing"), ("", "missing"), ("3.4e38", "absurd"), ("-inf", "absurd"),
     ("99.95", "saturated"), ("-100.0", "saturated")],
)  # fmt: skip
def test_what_is_no_measurement_becomes_nan_and_is_counted(value, field) -> None:
    lines = table().splitlines()
    lines[51] = lines[51].split(",")[0] + "," + value
    log = read("\n".join(lines) + "\n")
    assert np.isnan(log.current_A[50])
    assert np.isfinite(log.current_A).sum() == N - 1
    assert getattr(log.counts, field) == 1
    assert f"current_{field}" in codes(log)


def test_single_values_that_overflowed_are_no_current_and_a_peak_is_one() -> None:
    """655.35 A is all bits of an INA's 16; a peak of a flight has others near its size."""
    odd = CURRENT_A.copy()
    odd[[50, 150]], odd[220] = 655.35, -327.68
    odd[100] = 38.0
    log = read(table(i=odd))
    assert np.flatnonzero(np.isnan(log.current_A)).tolist() == [50, 150, 220]
    assert log.current_A[100] == 38.0
    assert log.counts.glitches == 3
    assert "current_glitches" in codes(log)


@pytest.mark.parametrize(("header", "unit_s"), [("time_us", 1e-6), ("time_ms", 1e-3)])
def test_a_counter_of_32_bits_that_begins_again_is_made_good(header: str, unit_s: float) -> None:
    count = np.round(TIME_S / unit_s) + 2**32 - np.round(15.0 / unit_s)
    log = read(table(f"{header},current_A", t=count % 2**32))
    assert log.time_s == pytest.approx(TIME_S - TIME_S[0], abs=2 * unit_s)
    assert (log.counts.wraps, log.counts.resets) == (1, 0)
    assert "clock_wrapped" in codes(log)


def test_a_plateau_at_the_top_is_a_rail_and_a_single_maximum_is_not() -> None:
    clipped = np.minimum(CURRENT_A, 18.5)
    assert saturated(clipped).sum() == (CURRENT_A >= 18.5).sum()
    assert not saturated(CURRENT_A).any()


def test_a_constant_discharge_that_ends_a_little_lower_is_no_rail() -> None:
    assert not saturated(np.array([0.0, *[91.8] * 70, 91.79, 91.77, 91.74, 0.0])).any()


def test_an_unreadable_row_is_counted() -> None:
    lines = table().splitlines()
    lines[10] = "12.0;??"
    lines[20] = "7.1,x9"
    log = read("\n".join(lines) + "\n")
    assert (log.counts.malformed, log.counts.kept) == (2, N - 2)


def test_gaps_stay_gaps_and_are_counted() -> None:
    keep = np.r_[:100, 130:N]
    log = read(table(t=TIME_S[keep], i=CURRENT_A[keep]))
    assert np.max(np.diff(log.time_s)) == pytest.approx(3.1)
    assert log.counts.gaps == 1


@pytest.mark.parametrize(
    "data",
    [b"", b"\n\n", b"hello\nworld\n", bytes(range(256)) * 20, b"a,b\n1,2\n2,3\n", b"time_s\n1\n2\n",
     b"time_s,current_A\n", b"0,1", b"#time_ms,current_A\n0,1",
     b"speed,height\n" + b"1.0,2.0\n" * 50],
)  # fmt: skip
def test_what_is_no_recording_is_refused_in_words(data) -> None:
    with pytest.raises(NotALog, match=r"x\.csv: "):
        read(data)


def test_a_name_falls_apart_into_words() -> None:
    assert words("Test Time / s") == ["test", "time", "s"]
    assert words("timeMs[0]") == ["time", "ms", "0"]


def test_coarse_stamps_keep_their_first_and_last_step() -> None:
    t, coarse = spread_coarse(np.repeat([1.0, 2.0, 3.0, 4.0], [4, 10, 10, 3]))
    assert coarse
    assert np.diff(t) == pytest.approx(0.1)


def test_coarse_stamps_beyond_whole_numbers_are_spread_too() -> None:
    """Nanoseconds since 1970 under a header of seconds."""
    t, coarse = spread_coarse(np.repeat(1.7e18 + np.array([0.0, 1e9, 2e9, 3e9]), 5))
    assert coarse
    assert np.diff(t) == pytest.approx(2e8, rel=1e-2)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0, 100, width=16), min_size=2, max_size=60))
def test_what_is_kept_always_grows_and_every_row_has_one_fate(stamps) -> None:
    t = np.array(stamps)
    kept, stray, duplicate, _, other = keep_one_clock(t)
    assert np.all(np.diff(t[kept]) > 0)
    assert kept.sum() + stray + duplicate + other == len(t)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 3000))
def test_a_file_cut_anywhere_gives_a_beginning_or_a_reason(length) -> None:
    try:
        log = read(table()[:length])
    except LogError:
        return
    assert log.current_A == pytest.approx(CURRENT_A[: len(log.current_A)])


@pytest.mark.parametrize("rows", [3, 20_000])
def test_a_quote_that_is_never_closed_is_refused_with_its_line(rows) -> None:
    t = 0.1 * np.arange(40_000)
    lines = table(t=t, i=15 + np.sin(t)).splitlines()
    lines[rows] = '"' + lines[rows]
    text = "# from the module\n\n" + "\n".join(lines) + "\n"
    with pytest.raises(NotALog, match=rf"x\.csv: line {rows + 3}: no table: field larger than"):
        read(text)


def test_a_line_too_long_for_a_table_is_refused_with_its_number() -> None:
    with pytest.raises(NotALog, match=r"x\.csv: line 2: "):
        read("time_s,current_A\n0.0," + "1" * 200_000 + "\n0.1,1.0\n0.2,1.0\n")
