"""Raw stamps of a whole file -> one clock; stray stamps and steps back are mended and counted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray
from flightlogs.table import Index

STRAY_WINDOW = 9  # records: up to four damaged stamps in a row stand out against their neighbours
STRAY_S = 10.0  # beyond any disorder between records written within one cycle of a logger
STEP_BACK_S = 1.0  # smaller ones are the disorder of records that were buffered


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FileClock:
    """Time as a function of the place in the file.

    Attributes:
        offset: (n,) places of the stamped records in the file, increasing.
        time_s: (n,) their repaired time; NaN for a stray one.
        strays: stamps that fit nothing around them.
        steps_back: places where the clock went back; what follows was shifted to go on from there.
        reconstructed_from: the evidence for a clock the log itself does not have, else "".
    """

    offset: Index
    time_s: FloatArray
    strays: int
    steps_back: int
    reconstructed_from: str = ""

    def at(self, offset: Index) -> FloatArray:
        """(m,) time of the last stamped record at or before each place."""
        good = np.isfinite(self.time_s)
        place = np.searchsorted(self.offset[good], offset, side="right") - 1
        return self.time_s[good][np.maximum(place, 0)]

    def between(self, offset: Index) -> FloatArray:
        """(m,) time interpolated between the stamped records around each place."""
        good = np.isfinite(self.time_s)
        return np.interp(offset, self.offset[good], self.time_s[good])

    def of(self, offset: Index) -> FloatArray:
        """(m,) repaired time of records that carry a stamp themselves."""
        return self.time_s[np.searchsorted(self.offset, offset)]

    def warnings(self) -> tuple[LogWarning, ...]:
        """What was repaired."""
        said = (
            ("stray_stamps", self.strays, "stamps fit nothing around them and were left out"),
            ("clock_stepped_back", self.steps_back, "steps back of the clock were closed up"),
        )
        mended = tuple(LogWarning(code, f"{n} {text}", "time") for code, n, text in said if n)
        if not self.reconstructed_from:
            return mended
        message = f"the log has no time on its rows: taken from {self.reconstructed_from}"
        return (LogWarning("time_base_reconstructed", message, "time"), *mended)


def file_clock(
    stamps: Mapping[str, tuple[Index, FloatArray]], *, reconstructed_from: str = ""
) -> FileClock:
    """Repair the stamps of a file.

    Args:
        stamps: message type -> ((n,) places in the file, (n,) raw stamps [s]).
        reconstructed_from: the evidence, where the stamps are not the log's own.

    Returns:
        The clock; of no stamps at all, an empty one.
    """
    offset = np.concatenate([np.zeros(0, dtype=np.int64), *(o for o, _ in stamps.values())])
    raw = np.concatenate([np.zeros(0), *(t for _, t in stamps.values())])
    order = np.argsort(offset, kind="stable")
    offset, raw = offset[order], raw[order]
    stray = ~np.isfinite(raw)
    stray[~stray] = is_stray(raw[~stray]) | is_spike(raw[~stray])
    time_s = np.where(stray, np.nan, raw)
    time_s[~stray], steps = without_steps(raw[~stray])
    return FileClock(
        offset=offset,
        time_s=time_s,
        strays=int(stray.sum()),
        steps_back=steps,
        reconstructed_from=reconstructed_from,
    )


def is_stray(time_s: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,) stamps far from the median of those around them; a gap or a lasting step is not."""
    if time_s.size < STRAY_WINDOW:
        return np.zeros(time_s.size, dtype=bool)
    return np.abs(time_s - median_filter(time_s, STRAY_WINDOW, mode="mirror")) > STRAY_S


def is_spike(time_s: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,) stamps that break the order of those on both sides by more than buffering does.

    A running median leaves any sequence in order as it is, so that what it moves is out of order.
    """
    if time_s.size < STRAY_WINDOW:
        return np.zeros(time_s.size, dtype=bool)
    return np.abs(time_s - median_filter(time_s, STRAY_WINDOW, mode="nearest")) > STEP_BACK_S


def without_steps(time_s: FloatArray) -> tuple[FloatArray, int]:
    """(n,) times with every lasting step back closed up, and how many there were."""
    jump = np.diff(time_s, prepend=time_s[:1])
    steps = jump < -STEP_BACK_S
    return time_s + np.cumsum(np.where(steps, -jump, 0.0)), int(steps.sum())


def increasing(time_s: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,) rows whose time is finite and later than that of every row kept before."""
    known = np.nan_to_num(time_s, nan=-np.inf)
    before = np.concatenate([[-np.inf], np.maximum.accumulate(known)[:-1]])
    return known > before
