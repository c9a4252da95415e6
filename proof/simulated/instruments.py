"""What records a simulated flight."""

from dataclasses import dataclass

NOISE_V = 0.008  # rms, of the pack's voltage


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruments:
    """What records a flight.

    Attributes:
        noise_V: rms, of the pack's voltage.
        noise_A: rms, of its current.
        every: one of so many samples at 10 Hz is recorded.
    """

    noise_V: float = NOISE_V
    noise_A: float = 0.08
    every: int = 1


USUAL = Instruments()
