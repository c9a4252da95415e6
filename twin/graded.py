"""Steps for a sparsely sampled load: short near a change of the current, longer far from one.

Particles are exact for any step, salt is first order in time (`MAX_STEP_S`). What a change of the
current sets off in the salt fades: a step of a tenth of the time since then errs by less than one
of a second errs at once. Under a steady current it is the state of charge that a step may not move
far. Hours of a pulse test take hundreds of steps instead of thousands (tests/twin/test_graded.py).
"""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from twin.load import Load

FloatArray = npt.NDArray[np.float64]

SHARE_OF_TIME = 0.1
"""Of the time to the nearest change, before or after: a clock that is off moves it a little."""
SHARE_OF_CHARGE = 1e-3  # of the capacity
CHANGED = 0.02  # of 1C, from sample to sample: less is a sensor's noise, or a slow ramp


def graded(load: Load, rated_C: float) -> Load:
    """The same current over the same time, with samples added where such a step would be longer.

    Args:
        load: no step gets shorter than its `longest_step_s`.
        rated_C: capacity of what it is drawn from.
    """
    rated_A = rated_C / 3600
    current_A = np.abs(load.current_A)
    larger_A = np.maximum(current_A[:-1], current_A[1:])
    by_charge_s = SHARE_OF_CHARGE * rated_C / np.maximum(larger_A, CHANGED * rated_A)
    by_time_s = SHARE_OF_TIME * _from_a_change_s(load, CHANGED * rated_A)
    longest_s = np.maximum(load.longest_step_s, np.minimum(by_time_s, by_charge_s))
    return replace(
        load.refined(longest_s),
        longest_step_s=float(longest_s.max(initial=load.longest_step_s)),
    )


def _from_a_change_s(load: Load, least_A: float) -> FloatArray:
    """(n - 1,) time from each interval to the nearest in which the current changes; 0 in those."""
    t = load.time_s
    changes = np.flatnonzero(np.abs(np.diff(load.current_A)) > least_A)
    next_one = np.searchsorted(changes, np.arange(t.size - 1))
    since_s = t[:-1] - np.append(t[0], t[changes + 1])[next_one]  # it begins with one
    until_s = np.append(t[changes], np.inf)[next_one] - t[1:]
    return np.asarray(np.maximum(np.minimum(since_s, until_s), 0.0))
