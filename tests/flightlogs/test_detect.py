"""The format is told by the bytes; whatever is no log is told what it looks like."""

import gzip
import io
import random
import re

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from flightlogs.detect import HEAD_BYTES, Format, detect
from flightlogs.errors import NotALog
from flightlogs.read import read_log
from sample_logs import write_dataflash, write_tlog
from tests.flightlogs import px4_flight as px4


def tlog() -> bytes:
    t = np.arange(0, 10, 1.0)
    out = io.BytesIO()
    write_tlog.write_tlog(out, [write_tlog.heartbeat(t, t > 2, 0)], start_unix_s=1.6e9)
    return out.getvalue()


def bare(version: int) -> bytes:
    """Telemetry of ten seconds without the ground station's time stamps."""
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = mavlink.MAVLink_heartbeat_message(2, 12, 128, 0, 4, 3)
    power = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16_000, 1_000, 90, 0, 0, 0, 0, 0, 0)
    mavlink1 = version == 1
    return b"".join(bytes(m.pack(link, force_mavlink1=mavlink1)) for m in (beat, power) * 10)


def dataflash(*, text: bool) -> bytes:
    tables = [
        write_dataflash.parameters({"BATT_CAPACITY": 2200.0}),
        write_dataflash.texts([1.0], ["ArduCopter V4.5.7"]),
    ]
    out = io.BytesIO()
    write = write_dataflash.write_dataflash_text if text else write_dataflash.write_dataflash
    write(out, tables)
    return out.getvalue()


def sdlog2() -> bytes:
    """The format records at the head of a PX4 log of 2015."""

    def fmt(kind: int, name: bytes, form: bytes, labels: bytes) -> bytes:
        body = bytes([kind, 3 + 8]) + name.ljust(4, b"\0") + form.ljust(16, b"\0")
        return b"\xa3\x95\x80" + body + labels.ljust(64, b"\0")

    return fmt(2, b"ATT", b"ff", b"Roll,Pitch") + fmt(129, b"TIME", b"Q", b"StartTime")


LOGS = {
    Format.ULOG: px4.ulog,
    Format.TLOG: tlog,
    Format.DATAFLASH: lambda: dataflash(text=False),
    Format.DATAFLASH_TEXT: lambda: dataflash(text=True),
    Format.PX4LOG: sdlog2,
}


@pytest.mark.parametrize("kind", Format)
@pytest.mark.parametrize("name", ["flight.ulg", "flight.bin", "flight.csv", "flight"])
def test_the_name_does_not_matter(kind: Format, name: str) -> None:
    assert detect(LOGS[kind]()[:HEAD_BYTES], name=name) is kind


@pytest.mark.parametrize("kind", [Format.TLOG, Format.DATAFLASH, Format.PX4LOG])
def test_a_beginning_that_is_lost_does_not_matter(kind: Format) -> None:
    assert detect(b"\x17\x99\x00" * 7 + LOGS[kind](), name="x") is kind


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "empty"),
        (b"ULo", "first 3 bytes of a ULog"),
        (bytes(4096), "zero bytes"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
        (gzip.compress(b"a log", mtime=0), "gzip archive"),
        (b"PK\x03\x04rest", "zip archive"),
        (b"time_s,current_A\n0.0,1.2\n", "--sensor"),
        (random.Random(1).randbytes(HEAD_BYTES), "no known log"),
    ],
)
def test_what_is_no_log_is_told_what_it_looks_like(content: bytes, said: str) -> None:
    with pytest.raises(NotALog, match=said) as caught:
        read_log(io.BytesIO(content), name="thing.ulg")
    assert str(caught.value).startswith("thing.ulg: ")
    assert "expected a PX4 ULog" in str(caught.value)


def test_noise_is_never_taken_for_telemetry() -> None:
    rng = random.Random(2)
    for _ in range(20):
        with pytest.raises(NotALog):
            detect(rng.randbytes(HEAD_BYTES), name="x")


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("lost", [b"", b"\x17\x99\x00" * 7])
def test_telemetry_without_stamps_is_telemetry(version: int, lost: bytes) -> None:
    assert detect(lost + bare(version), name="x") is Format.TLOG


@pytest.mark.parametrize("version", [1, 2])
def test_telemetry_without_stamps_counts_by_its_checksums(version: int) -> None:
    whole = bare(version)
    spoilt = bytearray(whole)
    for at in (m.start() for m in re.finditer(b"\xfe|\xfd", whole)):
        spoilt[at + 8] ^= 1  # in the payload of MAVLink 1, in the number of MAVLink 2
    with pytest.raises(NotALog):
        detect(bytes(spoilt), name="x")


def test_the_stream_is_read_from_its_beginning() -> None:
    stream = io.BytesIO(px4.ulog())
    stream.read(1000)
    assert read_log(stream, name="x").format == "ulog"
