"""The judge: a process of its own that sees its question, and how one that ends early is told."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("cryptography", reason="truths are sealed with `cryptography`")

from proof import run as protocol
from proof.check import check
from proof.judge import FAILED, STOPPED, VERDICT, judge
from proof.outcome import Outcome, Proof
from proof.places import PAGE, QUESTION, WRITTEN
from proof.run import prove
from proof.shown import show
from tests.proof import trials
from tests.proof.test_protocol import ASKED, watch


def test_the_judge_itself_names_it(tmp_path: Path) -> None:
    question = trials.asked(trials.OHM, seconds=50.0)
    files = tmp_path / QUESTION
    files.mkdir()
    question.write(files)
    verdict = judge(question.options(), files, tmp_path / WRITTEN)
    ids = [(e["id"], *e["equivalent"]) for e in verdict.content["effects"]]
    assert verdict.content["verdict"] == "named"
    assert len(ids) == 1
    assert "series_resistance" in ids[0]


def test_a_question_that_cannot_be_judged_says_why(tmp_path: Path) -> None:
    question = trials.asked(0.0)
    short = [
        replace(r, time_s=r.time_s[:20], current_A=r.current_A[:20], voltage_V=r.voltage_V[:20])
        for r in (*question.fitted, *question.held_out)
    ]
    question = replace(question, fitted=(short[0],), held_out=(short[1],))
    question.write(tmp_path)
    verdict = judge(question.options(), tmp_path, tmp_path / "out").content
    assert verdict["verdict"] == FAILED
    assert "20 samples" in verdict["remarks"][0]
    assert json.loads((tmp_path / "out" / VERDICT).read_text()) == verdict


def program(folder: Path, text: str) -> SimpleNamespace:
    """In place of Python."""
    path = folder / "judge.sh"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return SimpleNamespace(executable=str(path))


@pytest.mark.parametrize(
    ("ends", "verdict", "said"),
    [
        ("kill -KILL $$", STOPPED, "stopped from outside after 0 s"),
        ("kill -TERM $$", STOPPED, "stopped from outside after 0 s"),
        ("exit 130", STOPPED, "stopped from outside after 0 s"),
        ("kill -SEGV $$", FAILED, "exit code -11: nothing was said"),
        ("exit 1", FAILED, "exit code 1: nothing was said"),
    ],
)
def test_a_judge_that_is_stopped_from_outside_did_not_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ends: str, verdict: str, said: str
) -> None:
    monkeypatch.setattr("proof.judge.sys", program(tmp_path, ends))
    (tmp_path / QUESTION).mkdir()
    content = judge((), tmp_path / QUESTION, tmp_path / WRITTEN).content
    assert (content["verdict"], content["remarks"]) == (verdict, [said])
    assert json.loads((tmp_path / WRITTEN / VERDICT).read_text()) == content


def test_a_judge_that_was_stopped_is_told_and_counts_as_missed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("proof.judge.sys", program(tmp_path, "kill -KILL $$"))
    monkeypatch.setattr(protocol, "_processes", ThreadPoolExecutor)
    monkeypatch.setattr(protocol, "_compared", lambda *_: protocol._without("not asked"))
    one = [trials.trial("trial-001", 0.0)]
    done, _, ledger = prove(one, tmp_path, jobs=1, watch=watch(), asked=ASKED)
    assert [(j.verdict, j.outcome) for j in done] == [(STOPPED, Outcome.MISSED)]
    show(tmp_path, Proof(**ASKED, trials=done, not_made=(), head=ledger.head, seconds=1.0), ledger)
    page = (tmp_path / PAGE).read_text()
    assert "the tool failed" not in page
    assert "stopped from outside after 0 s" in page
    assert not check(tmp_path).broken


def test_above_the_folder_of_the_judge_lies_nothing_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It writes where it is and what it sees there; what it wrote comes back."""
    says = 'for out; do :; done; mkdir "$out"; (pwd; ls) > "$out/mismatch.json"; echo 7 > "$out/a"'
    monkeypatch.setattr("proof.judge.sys", program(tmp_path, says))
    monkeypatch.setattr("proof.judge.json", SimpleNamespace(loads=str.split))
    files, out = tmp_path / QUESTION, tmp_path / WRITTEN
    files.mkdir()
    (files / "pack.toml").write_text("")
    where, *seen = judge((), files, out).content
    assert seen == ["pack.toml"]
    assert tmp_path not in Path(where).parents
    assert sorted(p.name for p in out.iterdir()) == ["a", VERDICT]
    assert not Path(where).exists()
