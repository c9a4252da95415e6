"""A stationary process that wanders about zero: `Wander`.

That of Ornstein and Uhlenbeck, white noise through a low-pass of the first order; or, where a
damping is given, of the second: an oscillator driven by white noise, whose state is its value and
its rate, in units in which both have one variance.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

LEAST = 1e-12  # of a variance that is new: of hardly any time rounding is more
NOT_CRITICAL = 1e-4  # a damping of exactly 1 has a form of its own, which this is near enough


@dataclass(frozen=True, slots=True, kw_only=True)
class Wander:
    """Of a voltage.

    Attributes:
        size_V: standard deviation.
        forgets_s: integral of its correlation over all later times.
        damping: of the oscillator, of what is critical; None: of first order.
    """

    size_V: float
    forgets_s: float
    damping: float | None = None

    def follows(self, later_s: FloatArray) -> FloatArray:
        """(m,) its correlation over times (m,)."""
        return self.keep(later_s)[:, 0, 0]

    def drawn(self, dt: FloatArray, random: np.random.Generator) -> FloatArray:
        """(m + 1,) at times that are (m,) apart, by chance."""
        keep = self.keep(dt)
        size = keep.shape[-1]
        spread = np.linalg.cholesky((1.0 + LEAST) * np.eye(size) - keep @ keep.transpose(0, 2, 1))
        new = np.einsum("nij,nj->ni", spread, random.standard_normal((dt.size, size)))
        states = np.empty((dt.size + 1, size))
        states[0] = random.standard_normal(size)
        for k in range(dt.size):
            states[k + 1] = keep[k] @ states[k] + new[k]
        return np.asarray(self.size_V * states[:, 0])

    def keep(self, dt: FloatArray) -> FloatArray:
        """(m, s, s) of a state, after times (m,), that is expected to be left of it."""
        if self.damping is None:
            return np.asarray(np.exp(-dt / self.forgets_s)[:, None, None])
        x = 2.0 * self.damping / self.forgets_s * dt
        root = np.sqrt(complex(self.damping**2 - 1.0))
        root = root if abs(root) > NOT_CRITICAL else NOT_CRITICAL
        slow, fast = (np.exp((sign * root - self.damping) * x) for sign in (1.0, -1.0))
        both, apart = ((slow + fast) / 2).real, ((slow - fast) / (2 * root)).real
        turned = np.array([[self.damping, 1.0], [-1.0, -self.damping]])
        return np.asarray(both[:, None, None] * np.eye(2) + apart[:, None, None] * turned)
