"""Raw stamps of a log -> seconds since its first sample: what cannot be is repaired and counted.

What real logs do: a logger repeats the last value of a topic when it starts, so first samples are
old; single stamps are damaged; the clock steps back, or is set to the UNIX epoch; one topic
runs on another clock; a converter writes topic after topic, so that file order is no time order.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

OTHER_CLOCK_S = 1e7  # 4 months: no autopilot runs that long, and the epoch is 50 years away
NEIGHBOURS = 25  # records: no topic alone makes up half of them for long
LEAP_S = 86400.0  # no pause inside one file is longer: the clock was set
STEP_BACK_S = 1.0  # smaller ones are the disorder of records that were buffered
LASTING = 3  # records that go together are no damaged stamps
JUDGES = 7  # of a topic on either side of a jump, by their median: three damaged ones do no harm
STRAY_S = 10.0  # before the first and after the last of many records nothing single is so far off
HELD_S = 0.3  # a first sample this old is from before the log; a slow topic's is one period old


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repair:
    """Times of all records, in file order.

    Attributes:
        time_s: (n,) since the first sample; within each topic strictly increasing; NaN where the
            record is to be left out. A held value stands at 0, or is left out where its topic's
            next sample replaces it there.
        held: (n,) values from before the log, repeated by the logger when it started.
        strays: records left out because their stamp does not fit those around it.
        jumps: places where the clock stepped back, or ahead by more than a day; closed up.
        shifted_topics: topics on a clock of their own, put beside their neighbours in the file.
    """

    time_s: FloatArray
    held: BoolArray
    strays: int
    jumps: int
    shifted_topics: int

    def warnings(self) -> tuple[LogWarning, ...]:
        """What was repaired, with the counts."""
        said = (
            ("stray_stamps", self.strays, "records left out: their stamps fit nothing around them"),
            ("clock_jumped", self.jumps, "jumps of the clock (back, or ahead by days) closed up"),
            ("other_clock", self.shifted_topics, "topics shifted that ran on a clock of their own"),
        )
        return tuple(LogWarning(code, f"{n} {text}", "time") for code, n, text in said if n)


def repair(stamp_s: FloatArray, topic: IntArray) -> Repair:
    """Make one clock of the stamps of a file.

    Args:
        stamp_s: (n,) raw stamps in file order, any zero.
        topic: (n,) which topic each record belongs to.
    """
    time_s, shifted = _beside_neighbours(stamp_s, topic)
    members = [np.flatnonzero(topic == k) for k in np.unique(topic)]
    time_s, jumps = _closed_up(time_s, members)
    first = np.zeros(topic.shape, dtype=bool)
    first[[m[0] for m in members]] = True
    stray = _disordered(time_s, members, _isolated(time_s, first))
    running = time_s[~first & ~stray] if (~first & ~stray).any() else time_s[~stray]
    earliest = float(np.min(running, initial=np.inf))
    held = first & ~stray & (time_s < earliest - HELD_S) & (len(members) > 1)
    zero = float(np.min(time_s[~held & ~stray], initial=earliest))
    time_s = np.where(held, 0.0, time_s - zero)
    stray = _disordered(time_s, members, stray | held) & ~held  # the shift may round two to one
    left_out = stray.copy()
    for m in members:  # a held value that the topic's own first sample replaces at once
        left_out[m[0]] |= held[m[0]] and bool(np.any(time_s[m[1:]][~stray[m[1:]]] <= 0))
    return Repair(
        time_s=np.where(left_out, np.nan, time_s),
        held=held & ~left_out,
        strays=int(stray.sum()),
        jumps=jumps,
        shifted_topics=shifted,
    )


def longest_increase(values: Sequence[float]) -> list[int]:
    """Indices of a longest strictly increasing subsequence: the fewest records are left out.

    Source: M. L. Fredman, Discrete Math. 11, 29 (1975), doi:10.1016/0012-365X(75)90103-X.
    """
    if all(a < b for a, b in pairwise(values)):
        return list(range(len(values)))
    tails: list[float] = []
    tail_at: list[int] = []
    before = [-1] * len(values)
    for i, value in enumerate(values):
        k = bisect_left(tails, value)
        before[i] = tail_at[k - 1] if k else -1
        tails[k : k + 1], tail_at[k : k + 1] = [value], [i]
    chain, i = [], tail_at[-1] if tail_at else -1
    while i >= 0:
        chain.append(i)
        i = before[i]
    return chain[::-1]


def _disordered(time_s: FloatArray, members: Sequence[IntArray], stray: BoolArray) -> BoolArray:
    """(n,) `stray` and the fewest records that keep the rest of each topic from increasing."""
    out = stray.copy()
    for m in members:
        sound = m[~stray[m]]
        out[np.delete(sound, longest_increase(time_s[sound].tolist()))] = True
    return out


def _beside_neighbours(stamp_s: FloatArray, topic: IntArray) -> tuple[FloatArray, int]:
    """(n,) stamps with every topic that is years off its neighbours in the file moved to them."""
    if stamp_s.size < NEIGHBOURS:
        return stamp_s, 0
    off = stamp_s - median_filter(stamp_s, NEIGHBOURS, mode="mirror")
    moved, shifted = stamp_s.copy(), 0
    for k in np.unique(topic[np.abs(off) > OTHER_CLOCK_S]):
        mine = topic == k
        shift = float(np.median(off[mine]))
        if abs(shift) > OTHER_CLOCK_S and mine.sum() > LASTING:
            moved[mine] -= shift
            shifted += 1
    return moved, shifted


def _closed_up(time_s: FloatArray, members: Sequence[IntArray]) -> tuple[FloatArray, int]:
    """(n,) times without the clock's lasting jumps, and how many there were.

    A jump shows between two records of each topic that runs across it; the places in the file that
    all these pairs enclose are the jump's.
    """
    pairs = sorted((int(m[i]), int(m[i - 1])) for m in members for i in _lasting_jumps(time_s[m]))
    places: list[int] = []
    for after, before in pairs:
        if not places or before >= places[-1]:
            places.append(after)
    closed = time_s.copy()
    for place in places:
        across = np.array([(a, b) for a, b in pairs if b < place <= a])
        closed[place:] += closed[across[:, 1]].max() - closed[across[:, 0]].min()
    return closed, len(places)


def _lasting_jumps(time_s: FloatArray) -> list[int]:
    jump = np.diff(time_s)
    found = np.flatnonzero((jump < -STEP_BACK_S) | (jump > LEAP_S)) + 1
    lasting = []
    for i in found.tolist():
        before, after = time_s[max(1, i - JUDGES) : i], time_s[i : i + JUDGES]
        if min(before.size, after.size) >= LASTING:
            size = float(np.median(after) - np.median(before))
            if size < -STEP_BACK_S or size > LEAP_S:
                lasting.append(i)
    return lasting


def _isolated(time_s: FloatArray, first: BoolArray) -> BoolArray:
    """(n,) the few records far before or after all the others, and any a day off most of them."""
    out = np.zeros(time_s.shape, dtype=bool)
    order = np.argsort(time_s, kind="stable")
    order = order[~first[order]]
    if order.size <= 2 * LASTING + 1:
        return out
    clusters = np.split(order, np.flatnonzero(np.diff(time_s[order]) > LEAP_S) + 1)
    most = max(clusters, key=len)
    out[np.setdiff1d(order, most)] = True
    pauses = np.flatnonzero(np.diff(time_s[most]) > STRAY_S) + 1
    early, late = pauses[pauses <= LASTING], pauses[pauses >= most.size - LASTING]
    out[most[: int(early[-1]) if early.size else 0]] = True
    out[most[int(late[0]) if late.size else most.size :]] = True
    return out | first & (time_s > np.max(time_s[~out & ~first], initial=-np.inf) + STRAY_S)
