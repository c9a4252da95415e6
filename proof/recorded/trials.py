"""All trials on real recordings, in the order of what is concealed."""

from dataclasses import replace
from functools import partial
from pathlib import Path

from proof.question import Question
from proof.recorded.trials_ageing import ageing_trials
from proof.recorded.trials_fault import fault_trials
from proof.recorded.trials_heat import heat_trials
from proof.recorded.trials_weak import weak_trials
from proof.trial import Trial
from proof.truth import Truth

LISTED = "in its list"  # of `Truth.details`


def recorded(folder: Path, cache: Path) -> tuple[Trial, ...]:
    """Of the recordings in `folder`; calibrated base twins are kept in `cache`.

    The truth of each says what it is called in its list: a proof has names of its own.
    """
    return tuple(
        replace(trial, make=partial(_listed, trial))
        for trials in (heat_trials, ageing_trials, weak_trials, fault_trials)
        for trial in trials(folder, cache)
    )


def _listed(trial: Trial) -> tuple[Question, Truth]:
    question, truth = trial.make()
    return question, replace(truth, details={**(truth.details or {}), LISTED: trial.name})
