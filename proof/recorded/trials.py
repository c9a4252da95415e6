"""All trials on real recordings, in the order of what is concealed."""

from pathlib import Path

from proof.recorded.trials_ageing import ageing_trials
from proof.recorded.trials_fault import fault_trials
from proof.recorded.trials_heat import heat_trials
from proof.recorded.trials_weak import weak_trials
from proof.trial import Trial


def recorded(folder: Path, cache: Path) -> tuple[Trial, ...]:
    """Of the recordings in `folder`; calibrated base twins are kept in `cache`."""
    return tuple(
        trial
        for trials in (heat_trials, ageing_trials, weak_trials, fault_trials)
        for trial in trials(folder, cache)
    )
