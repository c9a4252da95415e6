"""`Error`: a standard deviation that few observations tell, and the interval that follows from it.

Of n observations a standard deviation is known with n - 1 degrees of freedom only, and the interval
is that of Student's t: of three it reaches 4.3 standard deviations, not 1.96. Where independent
errors add up, the degrees of freedom are those of B. L. Welch, Biometrika 34, 28 (1947),
doi:10.1093/biomet/34.1-2.28, and F. E. Satterthwaite, Biometrics Bulletin 2, 110 (1946),
doi:10.2307/3002019.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit


@dataclass(frozen=True, slots=True, kw_only=True)
class Error:
    """Of an estimate.

    Attributes:
        std: one standard deviation; NaN if nothing is known of it.
        freedom: degrees of freedom it is known with; inf where it is known exactly.
    """

    std: float
    freedom: float = float("inf")

    @property
    def half_95(self) -> float:
        """The truth is nearer than that in 95 % of cases; NaN if not known."""
        return self.half(0.95)

    def half(self, share: float) -> float:
        """Likewise in a share of the cases."""
        return float(stdtrit(self.freedom, (1 + share) / 2)) * self.std

    def __mul__(self, factor: float) -> "Error":
        return replace(self, std=abs(factor) * self.std)


UNKNOWN_ERROR = Error(std=float("nan"))


def together(*errors: Error) -> Error:
    """Of a sum of what errs independently."""
    variance = np.array([e.std**2 for e in errors])
    whole = float(variance.sum())
    if not whole > 0:
        return Error(std=whole)
    uncertain = float(np.sum(variance**2 / [e.freedom for e in errors]))
    return Error(
        std=float(np.sqrt(whole)), freedom=whole**2 / uncertain if uncertain else float("inf")
    )
