"""From what instruments without noise would show to what was recorded."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from proof.simulated.flown import Flown
from proof.simulated.instruments import USUAL, Instruments

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """One flight as it was recorded.

    Attributes:
        time_s: (n,) samples.
        current_A: (n,) discharge positive, of the pack.
        voltage_V: (n,) of the pack.
    """

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Concealed:
    """What nobody recorded, at the times of the recording.

    Attributes:
        temperature_K: (n,) of the cells (all but the weak one, where there is one).
        cells_V: (series, n) of each cell.
    """

    temperature_K: FloatArray
    cells_V: FloatArray


def record(
    flown: Flown,
    rng: np.random.Generator,
    instruments: Instruments = USUAL,
    before: float = 0.0,
) -> tuple[Recording, Concealed]:
    """With noise; every random number from `rng`. It begins when that share was drawn `before`."""
    seen = flown.recorded
    n = seen.time_s.size
    voltage_V = seen.voltage_V + instruments.noise_V * rng.standard_normal(n)
    current_A = seen.current_A + instruments.noise_A * rng.standard_normal(n)
    after = np.arange(n) - int(np.searchsorted(seen.drawn, before))
    kept = (after >= 0) & (after % instruments.every == 0)
    recording = Recording(
        time_s=seen.time_s[kept] - seen.time_s[kept][0],
        current_A=current_A[kept],
        voltage_V=voltage_V[kept],
    )
    concealed = Concealed(temperature_K=flown.temperature_K[kept], cells_V=flown.cells_V[:, kept])
    return recording, concealed
