"""By how much a twin answers to the noise of a recorded current: `answer_ohm`."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.load import Load
from twin.mismatch.flight import FloatArray
from twin.mismatch.white import NORMAL, OF_NOISE, STEP
from twin.pack import Pack
from twin.simulate import flowed

SMALL_A = 0.01  # of noise that is put in, so that instruments pass it as they are


def answer_ohm(
    pack: Pack, load: Load, simulated_V: FloatArray, mean: Callable[[FloatArray], FloatArray]
) -> float:
    """Of noise of the samples that `mean` (n,) -> (m,) compares.

    What the instruments of `pack` make of noise in `load`, times what its cells make of a current.
    """
    had = flowed(pack, load)
    return _passed(pack, load, had, mean) * _cells_ohm(mean(simulated_V), mean(had.current_A))


def _passed(pack: Pack, load: Load, had: Load, mean: Callable[[FloatArray], FloatArray]) -> float:
    """Of noise in a recorded current, so much is in the one that flowed."""
    if had is load:
        return 1.0
    noise_A = SMALL_A * np.random.default_rng(0).standard_normal(load.time_s.size)
    moved = flowed(pack, replace(load, current_A=load.current_A + noise_A))
    size_A, passed_A = (float(mean(x).std()) for x in (noise_A, moved.current_A - had.current_A))
    return passed_A / size_A


def _cells_ohm(simulated_V: FloatArray, current_A: FloatArray) -> float:
    """Root of the ratio of the powers of third differences (m,), beside switches of the current.

    1 where that never changes.
    """
    drive, answer = np.diff(current_A, n=3), np.diff(simulated_V, n=3)
    usual = np.abs(drive) <= STEP * np.median(np.abs(drive)) / NORMAL
    for k in range(1, OF_NOISE.size):
        usual = usual & np.roll(usual, k) & np.roll(usual, -k)
    power, answered = (float(x[usual] @ x[usual]) for x in (drive, answer))
    return float(np.sqrt(answered / power)) if power > 0.0 else 1.0
