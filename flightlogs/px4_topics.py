"""Topics of a PX4 log on the repaired clock."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flightlogs.clock import Repair, repair
from flightlogs.log import Channel, FloatArray
from flightlogs.ulog import Topic

MICRO = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """One topic and instance.

    Attributes:
        name: uORB name.
        instance: multi id.
        time_s: (n,) strictly increasing, n >= 1.
        held: the first sample is a value from before the log, repeated when it started.
        columns: field -> (n,) as logged.
    """

    name: str
    instance: int
    time_s: FloatArray
    held: bool
    columns: Mapping[str, npt.NDArray[np.generic]]

    def get(self, field: str, unknown: float | None = None) -> FloatArray | None:
        """(n,) of one field, NaN where it is `unknown`; None if the topic has no such field."""
        if field not in self.columns:
            return None
        with np.errstate(invalid="ignore"):  # damaged bytes can be a signalling NaN
            values = self.columns[field].astype(float)
        return values if unknown is None else np.where(values == unknown, np.nan, values)

    def matrix(self, fields: tuple[str, ...]) -> FloatArray | None:
        """(n, k) of several fields; None unless the topic has all of them."""
        columns = [self.get(field) for field in fields]
        known = [c for c in columns if c is not None]
        return np.column_stack(known) if len(known) == len(columns) else None

    def live(self) -> "Samples":
        """Without a held first sample: a measured quantity has no value before its first one."""
        if not self.held:
            return self
        columns = {k: v[1:] for k, v in self.columns.items()}
        return Samples(
            name=self.name,
            instance=self.instance,
            time_s=self.time_s[1:],
            held=False,
            columns=columns,
        )

    def channel(self, values: FloatArray, fields: str) -> Channel | None:
        """The values as a channel; None if none was measured."""
        if not np.isfinite(values).any():
            return None
        return Channel(time_s=self.time_s, values=values, source=f"{self.name}.{fields}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Px4Topics:
    """All topics that were read, and what their clock needed.

    Attributes:
        samples: by name and instance.
        clock: what was repaired.
        end_s: time of the last sample.
    """

    samples: Mapping[tuple[str, int], Samples]
    clock: Repair
    end_s: float

    def first(self, *names: str) -> Samples | None:
        """Instance 0 of the first of these topics that was logged."""
        found = (self.samples.get((name, 0)) for name in names)
        return next((s for s in found if s is not None), None)

    def logged(self, name: str) -> tuple[Samples, ...]:
        """All instances of a topic, by multi id, held values too."""
        return tuple(s for key, s in sorted(self.samples.items()) if key[0] == name)

    def measured(self, *names: str) -> Samples | None:
        """As `first`, without held values."""
        for name in names:
            samples = self.samples.get((name, 0))
            if samples is not None and samples.live().time_s.size:
                return samples.live()
        return None

    def instances(self, name: str) -> tuple[Samples, ...]:
        """All instances of a topic that has measured samples, by multi id."""
        found = (s.live() for s in self.logged(name))
        return tuple(s for s in found if s.time_s.size)


def on_one_clock(topics: tuple[Topic, ...]) -> Px4Topics:
    """Repair the stamps of all topics together."""
    place = np.concatenate([np.zeros(0, dtype=np.int64), *(t.place for t in topics)])
    raw = np.concatenate([np.zeros(0), *(t.stamp_us * MICRO for t in topics)])
    owner = np.repeat(np.arange(len(topics)), [t.place.size for t in topics])
    order = np.argsort(place, kind="stable")
    clock = repair(raw[order], owner[order])
    time_s, held = np.empty(raw.size), np.empty(raw.size, dtype=bool)
    time_s[order], held[order] = clock.time_s, clock.held
    samples = {}
    for k, topic in enumerate(topics):
        mine = time_s[owner == k]
        kept = np.isfinite(mine)
        if kept.any():
            samples[topic.name, topic.instance] = Samples(
                name=topic.name,
                instance=topic.instance,
                time_s=mine[kept],
                held=bool(held[owner == k][kept][0]),
                columns={f: v[kept] for f, v in topic.columns.items()},
            )
    end_s = float(np.nanmax(time_s, initial=0.0)) if raw.size else 0.0
    return Px4Topics(samples=samples, clock=clock, end_s=end_s)
