"""What `twin explain` prints of a finding and of the packs of its recordings."""

from dataclasses import replace

import pytest

from analyze.workbench.explained import print_finding, print_packs
from tests.reports import example
from tests.reports.mismatch_example import finding
from twin.mismatch import Verdict


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (Verdict.NONE, "35.2 mV as configured, 8.2 mV with starts within their tolerance"),
        (Verdict.NAMED, "35.2 mV before, 8.2 mV after"),
        (Verdict.AMBIGUOUS, "35.2 mV before, 8.2 mV after"),
        (Verdict.UNKNOWN, "35.2 mV as configured"),
    ],
)
def test_an_error_after_is_told_where_something_was_taken(
    verdict: Verdict, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    print_finding(finding(verdict))
    text = capsys.readouterr().out
    assert f"error    on what was held out: {said}; noise 8.0 mV\n" in text
    assert "evidence lost (6 is strong)" in text


def test_of_an_unknown_one_it_is_told_where_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    unknown = finding(Verdict.UNKNOWN)
    print_finding(unknown)
    assert (
        "where    recorded minus simulated is 45.0 mV in b.ulg from 60.0 to 119.9 s (55 % of the "
        "mismatch), 20.0 mV in a.ulg from 20.0 to 60.0 s (45 % of the mismatch)\n"
    ) in capsys.readouterr().out
    for of in (replace(unknown, spans=()), finding(Verdict.NAMED)):
        print_finding(of)
        assert "where" not in capsys.readouterr().out


def test_a_pack_is_printed_once_for_all_recordings_that_agree(
    capsys: pytest.CaptureFixture[str],
) -> None:
    origins = dict.fromkeys(("capacity_C", "initial_soc", "initial_K", "ambient_K"), "pack file")
    cool = replace(example.pack(), origins=origins)
    warm = replace(cool, initial_K=cool.initial_K + 9.0)
    print_packs({"a.ulg": cool, "b.ulg": warm, "c.ulg": cool})
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if "ulg" in line] == ["a.ulg, c.ulg", "b.ulg"]
    assert sum(line.startswith("pack ") for line in lines) == 2
