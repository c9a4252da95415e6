"""Stand-ins: for the analysis where only the command around it is tested, for a closed folder."""

import os
import signal
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

import analyze.job
from analyze.names import printable
from analyze.pipeline import Inputs
from flightlogs.errors import Refusal
from tests.reports import example


@pytest.fixture
def analysed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the logs the stand-in was asked for; the file's last bytes say how it goes."""
    asked: list[str] = []

    def analyse(inputs: Inputs, *, clock: object) -> object:
        del clock
        asked.append(inputs.log.name)
        content = inputs.log.read_bytes()
        if content.endswith(b"refused"):
            raise Refusal("no_current", "the current is 0.0 A all along")
        if content.endswith(b"fault"):
            raise KeyError("a fault of ours")
        if content.endswith(b"interrupted"):
            raise KeyboardInterrupt
        if b"lost" in content:  # as CasADi loses it
            with suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        if content.endswith(b"lost, of that"):
            raise AttributeError("'NoneType' object has no attribute 'full'")
        report = example.report(name=printable(inputs.log.name))
        made = replace(report.provenance, sha256=inputs.log_sha256, inputs_sha256=inputs.sha256)
        return replace(report, provenance=made, pack=replace(report.pack, serial=inputs.serial))

    monkeypatch.setattr(analyze.job, "analyse", analyse)
    return asked


@pytest.fixture
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders named "closed" cannot be listed."""
    scan = os.scandir

    def scandir(path: str) -> object:
        if Path(path).name == "closed":
            raise PermissionError(13, "Permission denied", path)
        return scan(path)

    monkeypatch.setattr(os, "scandir", scandir)
