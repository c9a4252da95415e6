"""What a residual may follow: quantities of the load and of the twin's answer, by name."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from twin.load import Load
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

MEMORIES_S = (3.0, 30.0, 300.0)


def quantities(load: Load, solution: Solution) -> Mapping[str, FloatArray]:
    """Name -> (n,) at the samples that were simulated.

    Memories are exponential, of the current or of its square, which is heat.
    """
    n = solution.time_s.size
    time_s, current_A = load.time_s[:n], load.current_A[:n]
    drawn = load.drawn_C()[:n]
    out = {
        "current": current_A,
        "current squared": current_A**2,
        "ramp": np.gradient(current_A, time_s) if n > 1 else np.zeros(n),
        "charge drawn": drawn,
        "time since the start": time_s - time_s[0] if n else time_s,
        "voltage": solution.voltage_V,
        "state of charge": solution.soc,
        "temperature rise": solution.temperature_K - solution.temperature_K[:1],
    }
    for memory_s in MEMORIES_S:
        out[f"current with a memory of {memory_s:g} s"] = remembered(time_s, current_A, memory_s)
    out["heating history"] = remembered(time_s, current_A**2, MEMORIES_S[-1])
    return {name: values for name, values in out.items() if n and np.ptp(values) > 0}


def remembered(time_s: FloatArray, values: FloatArray, memory_s: float) -> FloatArray:
    """(n,) exponential mean of what was so far, from zero; a sample holds since the one before."""
    out = np.zeros(values.size)
    kept = np.exp(-np.diff(time_s) / memory_s)
    for k, keep in enumerate(kept, start=1):
        out[k] = keep * out[k - 1] + (1.0 - keep) * values[k]
    return out
