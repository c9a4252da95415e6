"""Measured channels that had no part in a verdict, beside the twin's prediction of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import Any

import numpy as np

from twin.load import Load
from twin.mismatch.flight import FloatArray, MismatchError
from twin.mismatch.hidden_csv import HiddenTable
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate


class Hidden(Enum):
    """A channel; which cell is the weakest the terminals of a pack cannot tell: the lowest is."""

    TEMPERATURE = "temperature"
    WEAKEST_CELL = "weakest_cell_voltage"
    OTHER_CELLS = "other_cells_mean_voltage"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Revealed:
    """One channel of one recording, SI.

    Attributes:
        flight: name of the recording.
        channel: what was measured.
        time_s: (n,) where both are known.
        measured: (n,)
        before: (n,) by the twin as configured; NaN where it has come to its end.
        after: (n,) by the one that was adopted; None if none was.
    """

    flight: str
    channel: Hidden
    time_s: FloatArray
    measured: FloatArray
    before: FloatArray
    after: FloatArray | None

    @property
    def unit(self) -> str:
        """In which errors are given."""
        return "K" if self.channel is Hidden.TEMPERATURE else "mV"

    @property
    def factor(self) -> float:
        """To that from SI."""
        return 1.0 if self.channel is Hidden.TEMPERATURE else 1e3

    def rms(self, predicted: FloatArray) -> float:
        """Root mean square of predicted minus measured, where there is a prediction."""
        return _rms(predicted - self.measured)

    def change_rms(self, predicted: FloatArray) -> float:
        """The same of the changes since the first sample: where it starts is often only assumed."""
        error = predicted - self.measured
        return _rms(error - error[0])


def _rms(error: FloatArray) -> float:
    """NaN if there is none."""
    there = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(there**2))) if there.size else float("nan")


def reveal(
    table: HiddenTable, *, flight: str, load: Load, configured: Pack, adopted: Pack | None
) -> tuple[Revealed, ...]:
    """Each channel of `table`, which is of `flight`, beside two twins under its load.

    Raises:
        MismatchError: no sample lies within the recording, or there are more cells than in the
            pack.
    """
    cells = table.cell_voltage_V.shape[0]
    if cells > configured.series:
        raise MismatchError(
            f"{table.name}: {cells} columns of cells, the pack has {configured.series} in series"
        )
    before = dict(_predicted(configured, load, table))
    after = dict(_predicted(adopted, load, table)) if adopted else {}
    out = []
    for channel, measured in _measured(table, configured.series):
        best = after.get(channel, before[channel])
        if not np.isfinite(best).any():  # what was adopted cannot follow: its error is none
            best = before[channel]
        good = np.isfinite(measured) & np.isfinite(best)
        if good.any():
            out.append(
                Revealed(
                    flight=flight,
                    channel=channel,
                    time_s=table.time_s[good],
                    measured=measured[good],
                    before=before[channel][good],
                    after=after[channel][good] if after else None,
                )
            )
    if not out:
        raise MismatchError(
            f"{table.name}: no measurement within the {load.time_s[0]:.0f} to "
            f"{load.time_s[-1]:.0f} s of {flight}: give its times on the clock of the recording"
        )
    return tuple(out)


def _measured(table: HiddenTable, series: int) -> Iterator[tuple[Hidden, FloatArray]]:
    """Channels that the table holds; the other cells only if all are measured."""
    if table.temperature_K is not None:
        yield Hidden.TEMPERATURE, table.temperature_K
    cells = table.cell_voltage_V
    if cells.size:
        yield from _ranked(cells, all_there=cells.shape[0] == series)


def _predicted(pack: Pack, load: Load, table: HiddenTable) -> Iterator[tuple[Hidden, FloatArray]]:
    """(n,) at the times of the table; NaN outside what was simulated."""
    solution = simulate(beyond_cut_offs(pack), load)

    def at(values: FloatArray) -> FloatArray:
        return np.interp(table.time_s, solution.time_s, values, left=np.nan, right=np.nan)

    if not solution.time_s.size:
        yield from ((channel, np.full(table.time_s.size, np.nan)) for channel in Hidden)
        return
    yield Hidden.TEMPERATURE, at(solution.temperature_K)
    for channel, values in _ranked(solution.cell_voltage_V, all_there=True):
        yield channel, at(values)


def _ranked(cells: FloatArray, *, all_there: bool) -> Iterator[tuple[Hidden, FloatArray]]:
    """The lowest on average, and the mean of the others where each was measured."""
    told = [own[np.isfinite(own)] for own in cells]
    means_V = [own.mean() if own.size else np.inf for own in told]
    weakest = int(np.argmin(means_V))
    yield Hidden.WEAKEST_CELL, cells[weakest]
    if all_there and all(own.size for own in told) and cells.shape[0] > 1:
        yield Hidden.OTHER_CELLS, np.delete(cells, weakest, axis=0).mean(axis=0)


def reveal_json(found: Sequence[Revealed]) -> dict[str, Any]:
    """`reveal.json`: errors in K and mV."""
    return {"channels": [_channel(r) for r in found]}


def _channel(r: Revealed) -> dict[str, Any]:
    out: dict[str, Any] = {
        "flight": r.flight,
        "channel": r.channel.value,
        "unit": r.unit,
        "samples": int(r.time_s.size),
    }
    for when, predicted in (("before", r.before), ("after", r.after)):
        both = (None, None) if predicted is None else (r.rms(predicted), r.change_rms(predicted))
        for key, value in zip(("rmse", "change_rmse"), both, strict=True):
            out[f"{key}_{when}"] = (
                None if value is None or not isfinite(value) else r.factor * value
            )
    return out
