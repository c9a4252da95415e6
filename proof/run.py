"""All trials: first every truth is sealed, then every question judged, then every truth opened."""

import json
import multiprocessing
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from analyze.interrupt import ignored
from analyze.version import OF_A_REPORT, code_now
from proof.baselines import baselines
from proof.capacity import predicted_capacity_C
from proof.compare import adopted, opened
from proof.judge import Verdict, judge
from proof.judged import judged_trial
from proof.ledger import BEGUN, LEFT, Entry, Ledger, left_out, sha256_of, sha256_of_folder
from proof.out import compared_json
from proof.outcome import Judged, NotMade
from proof.places import (
    ASKED,
    COMPARED,
    JUDGED,
    LEDGER,
    PAGE,
    PROOF,
    QUESTION,
    SEALED,
    TRIALS,
    TRUTH,
    WRITTEN,
)
from proof.question import Question
from proof.seal import seal, truth_text, unseal
from proof.trial import NoTrial, Trial
from proof.truth import Truth
from twin.finite import finite
from twin.whole_file import write_whole

A = TypeVar("A")


@dataclass(frozen=True, slots=True, kw_only=True)
class Watch:
    """Who looks on.

    Attributes:
        tell: told the phase, how many of how many are done, and the name of the last.
        stop: whether no further trial is to be begun.
    """

    tell: Callable[[str, int, int, str], None]
    stop: Callable[[], bool]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sealed:
    """A trial whose truth is sealed under `key`; `entry` is of the ledger."""

    trial: Trial
    question: Question
    key: str
    entry: Entry


def prove(
    trials: Sequence[Trial],
    out: Path,
    *,
    jobs: int,
    watch: Watch,
    asked: Mapping[str, Any] | None = None,
) -> tuple[tuple[Judged, ...], tuple[NotMade, ...], Ledger]:
    """Judged and not made, in the order of `trials`, and the ledger.

    Args:
        trials: with names that are folders of `out`/trials.
        out: a folder that can be written.
        jobs: so many at once.
        watch: who looks on.
        asked: seed, command, versions and code, for the first entry.
    """
    run = _Run(out, jobs, watch)
    run.begin({**(asked or {}), "sources": {t.name: t.source for t in trials}})
    sealed = run.seal(trials)
    verdicts = run.judge(sealed)
    done = run.open(sealed, verdicts)
    left = tuple(
        NotMade(name=t.name, source=t.source, reason=run.reasons.get(t.name, "stopped before"))
        for t in trials
        if t.name not in done
    )
    if left:
        run.ledger.append(LEFT, "", left_out(left))
    return tuple(done.values()), left, run.ledger


class _Run:
    """Three phases, and why trials did not come through one: `reasons`."""

    def __init__(self, out: Path, jobs: int, watch: Watch) -> None:
        for file in (ASKED, PROOF, PAGE):  # of an earlier call, as are the trials below
            (out / file).unlink(missing_ok=True)
        self.ledger, self.reasons = Ledger(out / LEDGER), dict[str, str]()
        self._folder, self._jobs, self._watch = out / TRIALS, jobs, watch
        for old in self._folder.glob("trial-*"):
            if old.is_dir() and not old.is_symlink():
                shutil.rmtree(old)

    def begin(self, asked: Mapping[str, Any]) -> None:
        """What is to be done, by which code."""
        text = json.dumps(asked, indent=1) + "\n"
        write_whole(self._folder.parent / ASKED, text)
        self.ledger.append(BEGUN, "", {ASKED: sha256_of(text.encode())})

    def seal(self, trials: Sequence[Trial]) -> dict[str, Sealed]:
        """Every truth that can be made."""
        with _processes(self._jobs) as pool:
            made = self._gathered(
                "sealed",
                {t.name: partial(pool.submit, _sealed, t, self._folder / t.name) for t in trials},
            )
        return {
            t.name: Sealed(
                trial=t, question=question, key=key,
                entry=self.ledger.append("sealed", t.name, hashes),
            )
            for t in trials
            if t.name in made
            for question, key, hashes in (made[t.name],)
        }  # fmt: skip

    def judge(self, sealed: Mapping[str, Sealed]) -> dict[str, tuple[Verdict, Entry]]:
        """A verdict on each question, written."""

        def judged(name: str) -> tuple[Verdict, Entry]:
            own, options = self._folder / name, sealed[name].question.options()
            verdict = judge(options, own / QUESTION, own / WRITTEN)
            told = {"seconds": verdict.seconds, "code": code(), "options": options}
            write_whole(own / WRITTEN / JUDGED, json.dumps(told, indent=1) + "\n")
            written = {p.name: sha256_of(p.read_bytes()) for p in (own / WRITTEN).iterdir()}
            return verdict, self.ledger.append("judged", name, written)

        with ThreadPoolExecutor(self._jobs) as threads:
            asked = {n: partial(threads.submit, judged, n) for n in sealed}
            return self._gathered("judged", asked)

    def open(
        self, sealed: Mapping[str, Sealed], verdicts: Mapping[str, tuple[Verdict, Entry]]
    ) -> dict[str, Judged]:
        """Every truth on which there is a verdict, beside it."""
        truths: dict[str, tuple[Truth, Entry]] = {}
        for n in sealed:
            if n in verdicts:
                with self._counted("opened", n):
                    truths[n] = _opened(self.ledger, self._folder / n, sealed[n])
        with _processes(self._jobs) as pool:
            asked = {
                n: partial(
                    pool.submit, _compared, sealed[n].question, truth, verdicts[n][0].content
                )
                for n, (truth, _) in truths.items()
            }
            known = self._gathered("compared", asked)
        compared = {n: known.get(n) or _without(self.reasons[n]) for n in truths}
        for n, found in compared.items():
            text = json.dumps(finite(compared_json(**found)), indent=1) + "\n"
            write_whole(self._folder / n / COMPARED, text)
            self.ledger.append("compared", n, {COMPARED: sha256_of(text.encode())})
        return {n: _judged(sealed[n], truths[n], verdicts[n], compared[n]) for n in truths}

    def _gathered(self, phase: str, asked: Mapping[str, Callable[[], Future[A]]]) -> dict[str, A]:
        """Results by name; who looks on is told of each.

        So many as can be at work are handed over, no more: a pool takes some ahead, and those
        cannot be taken back when a person asks to stop.
        """
        waiting, working, out = list(asked), dict[Future[A], str](), dict[str, A]()
        count = 0
        while True:
            while waiting and len(working) < self._jobs and not self._stopped(phase):
                name = waiting.pop(0)
                with self._counted(phase, name):
                    working[asked[name]()] = name
            if not working:
                return out
            for future in wait(working, return_when=FIRST_COMPLETED).done:
                name, count = working.pop(future), count + 1
                with self._counted(phase, name):
                    out[name] = future.result()
                self._watch.tell(phase, count, len(asked), name)

    def _stopped(self, phase: str) -> bool:
        """What was judged is opened in any case."""
        return phase != "compared" and self._watch.stop()

    @contextmanager
    def _counted(self, phase: str, name: str) -> Iterator[None]:
        """A trial that fails costs no other."""
        try:
            yield
        except NoTrial as e:
            self.reasons[name] = f"not {phase}: {e}"
        except Exception as e:  # one that fails is counted and shown
            self.reasons[name] = f"not {phase}: {type(e).__name__}: {e}"


def code() -> str:
    """Hash of what seals, judges and compares, as it is now: a run may take an hour."""
    return code_now(*OF_A_REPORT, "proof")


def _sealed(trial: Trial, folder: Path) -> tuple[Question, str, dict[str, str]]:
    """Made and written: the question, the key of its truth, hashes of the files by name.

    NoTrial if it cannot be made.
    """
    question, truth = trial.make()
    files = folder / QUESTION
    files.mkdir(parents=True)
    question.write(files)
    token, key = seal(truth)
    write_whole(folder / SEALED, token)
    return question, key, {SEALED: sha256_of(token), QUESTION: sha256_of_folder(files)}


def _opened(ledger: Ledger, folder: Path, own: Sealed) -> tuple[Truth, Entry]:
    truth = unseal((folder / SEALED).read_bytes(), own.key)
    text = truth_text(truth)
    write_whole(folder / TRUTH, text)
    return truth, ledger.append(
        "opened", own.trial.name, {TRUTH: sha256_of(text.encode())}, key=own.key
    )


def _compared(question: Question, truth: Truth, verdict: Mapping[str, Any]) -> dict[str, Any]:
    """What takes time: fields of `Judged`."""
    better = adopted(question.pack, verdict)
    asked = truth.capacity_C is not None
    return {
        "baselines": tuple(baselines(question, verdict)),
        "channels": opened(question, truth, verdict),
        "capacity_C": predicted_capacity_C(better or question.pack, truth) if asked else None,
    }


def _without(reason: str) -> dict[str, Any]:
    """A comparison that failed: the verdict counts all the same."""
    return {"baselines": (), "channels": (), "capacity_C": None, "not_compared": reason}


def _judged(
    own: Sealed, truth: tuple[Truth, Entry], verdict: tuple[Verdict, Entry],
    compared: Mapping[str, Any],
) -> Judged:  # fmt: skip
    return judged_trial(
        truth[0],
        verdict[0].content,
        {entry.event: entry for entry in (own.entry, verdict[1], truth[1])},
        name=own.trial.name,
        source=own.trial.source,
        seconds=verdict[0].seconds,
        **compared,
    )


@contextmanager
def _processes(jobs: int) -> Iterator[Executor]:
    """Workers that leave Ctrl-C to the program they work for."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=ignored) as pool:
        yield pool
