"""How fine a simulation must be for its own error not to be taken for the cell.

Of two simulated voltages a fit needs the difference to hundredths of the noise: a systematic 0.2 mV
in a thousand samples moves what they determine by several standard errors and shows in no residual.
A fit takes coarse steps and the mesh of everyday use, and adds what these miss (`Problem.refined`).
"""

from dataclasses import replace

import numpy as np

from twin.load import Between, Load

PARTS = 8
"""Of a step. With these the twin is 0.03 to 0.08 mV rms from PyBaMM's limit of fine meshes at 2C of
an LG M50, without 0.2 to 2.4 (tests/reference/calibration)."""


def refined(load: Load) -> Load:
    """The same current in steps PARTS times shorter; every PARTS-th sample is one of `load`."""
    share = np.arange(PARTS) / PARTS
    steps_s = load.time_s[:-1, None] + share * np.diff(load.time_s)[:, None]
    time_s = np.append(steps_s.ravel(), load.time_s[-1])
    if load.between is Between.HOLD:
        current_A = np.append(np.repeat(load.current_A[:-1], PARTS), load.current_A[-1])
    else:
        current_A = np.interp(time_s, load.time_s, load.current_A)
    return replace(load, time_s=time_s, current_A=current_A)
