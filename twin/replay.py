"""`Replay`: a solution beside the voltage that was recorded under the same load."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from twin.load import Load, LoadError
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Replay:
    """What the twin answered to a recorded load, and what was measured; LoadError if they differ.

    Attributes:
        load: the recorded current at the terminals of the pack.
        recorded_V: (n,) at the times of the load; NaN where the voltage was not measured.
        judged: (n,) bool, the samples that count in the errors (a flight, without the rest
            before it, where the start value alone decides).
        solution: the twin's answer, m <= n samples if it ended early.
    """

    load: Load
    recorded_V: FloatArray
    judged: npt.NDArray[np.bool_]
    solution: Solution

    def __post_init__(self) -> None:
        for name in ("recorded_V", "judged"):
            shape = getattr(self, name).shape
            if shape != self.load.time_s.shape:
                raise LoadError(f"{name}: {shape}, load: {self.load.time_s.shape}")
        m = self.solution.time_s.size
        if not np.array_equal(self.solution.time_s, self.load.time_s[:m]):
            raise LoadError("the solution is not on the times of the load")

    @cached_property
    def residual_V(self) -> FloatArray:
        """(m,) recorded minus simulated, as far as simulated; NaN where not measured."""
        m = self.solution.time_s.size
        return self.recorded_V[:m] - self.solution.voltage_V

    @cached_property
    def judged_residual_V(self) -> FloatArray:
        """(k,) finite residuals of the judged samples."""
        m = self.solution.time_s.size
        chosen = self.residual_V[self.judged[:m]]
        return chosen[np.isfinite(chosen)]

    @property
    def rmse_V(self) -> float | None:
        """Root mean square of the judged residuals; None if there are none."""
        if not self.judged_residual_V.size:
            return None
        return float(np.sqrt(np.mean(self.judged_residual_V**2)))

    @property
    def max_error_V(self) -> float | None:
        """Largest absolute judged residual; None if there are none."""
        if not self.judged_residual_V.size:
            return None
        return float(np.max(np.abs(self.judged_residual_V)))
