"""What the terminal says of a flight is true of its replay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyze.job import Done, Job
from analyze.lines import done_line
from reports.flight import FlightReport
from reports.results import result_of
from tests.reports import example
from twin.solution import Status

WHOLE = example.report()
UNMEASURED = replace(WHOLE.replay, recorded_V=np.full(example.T.size, np.nan))
EARLY = example.solution(Status.ELECTRODE_EMPTY, 200)
AT_ONCE = example.solution(Status.NOT_CONVERGED, 0)


@pytest.mark.parametrize(
    ("report", "said"),
    [
        (WHOLE, "mV RMS; doubts"),
        (example.report(played=EARLY), "mV RMS, ended early (electrode_empty); doubts"),
        (example.report(played=AT_ONCE), "; replay ended early (not_converged), before any "
         "voltage; doubts"),
        (replace(WHOLE, replay=UNMEASURED), "; no voltage to compare with; doubts"),
    ],
)  # fmt: skip
def test_the_replay_in_a_line(report: FlightReport, said: str) -> None:
    job = Job(log=Path("a.ulg"), shown="a.ulg", folder=Path("out"))
    line = done_line(Done(job=job, result=result_of(report), kept=False))
    assert said in line


def test_a_folder_whose_name_is_no_text_can_be_told() -> None:
    job = Job(log=Path("a.ulg"), shown="a.ulg", folder=Path("Fl\udcfcge"))
    assert done_line(Done(job=job, result=result_of(WHOLE), kept=False)).encode()
