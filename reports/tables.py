"""The CSV files of a flight, as text."""

import csv
import io
from collections.abc import Iterable, Sequence

from segment.profile import PeriodicProfile
from segment.segment import Segment

SEGMENT_HEADER = (
    "motion", "start_s", "stop_s", "basis", "charge_C", "energy_J", "mean_A", "rms_A", "p99_A",
    "ripple_A",
)  # fmt: skip


def segments_csv(segments: Sequence[Segment]) -> str:
    """One row a segment, SI; an energy without a voltage is empty."""
    return _csv(SEGMENT_HEADER, map(_segment_row, segments))


def profile_csv(profile: PeriodicProfile) -> str:
    """One period: what follows the last row is the first one again, at `period_s`."""
    rows = (
        (f"{t:.6g}", f"{i:.6g}") for t, i in zip(profile.time_s, profile.current_A, strict=True)
    )
    return _csv(("time_s", "current_A"), rows)


def _segment_row(segment: Segment) -> tuple[str, ...]:
    load = segment.load
    numbers = (
        load.charge_C, load.energy_J, load.mean_A, load.rms_A, load.p99_A, load.ripple_A,
    )  # fmt: skip
    times = (f"{segment.start_s:.3f}", f"{segment.stop_s:.3f}")
    texts = ("" if value != value else f"{value:.6g}" for value in numbers)  # NaN: not measured
    return (segment.motion.value, *times, segment.basis.value, *texts)


def _csv(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()
