"""One run of `twin age`: what was asked for, how far it came, and its files."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

from analyze.checks import WrongUse
from analyze.columns import Columns, as_csv, as_parquet
from analyze.workbench.ageing_table import ageing_columns, cell_columns
from analyze.workbench.checkpoint import Checkpoint, to_text
from analyze.workbench.drawn import Ask, Drawn
from analyze.workbench.plots import ageing_svg
from twin.ageing import Aged, Cycle, Regime
from twin.pack import CellKind
from twin.solution import Status
from twin.whole_file import write_whole

CHECKPOINT = "ageing.checkpoint.json"
SAVED_EVERY_S = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Request(Ask):
    """The command line."""

    cycles: int
    repeat: bool
    rest_s: float
    charge_rate: float
    until_rate: float
    charge_to: float | None
    stop_at_capacity: float | None
    resume: bool
    ambient_c: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.stop_at_capacity is not None and math.isnan(self.stop_at_capacity):
            raise WrongUse("--stop-at-capacity nan: expected a share, e.g. 0.8")


@dataclass(slots=True)
class Life:
    """A run so far.

    Attributes:
        request: what was asked for, with the folder of its files.
        drawn: load and pack.
        regime: of each cycle.
        identity: what run it is.
        cycles: that were done, the last of them perhaps in part.
        last: the pack after the last whole one.
        saved_s: when it was written, on a clock of its own.
    """

    request: Request
    drawn: Drawn
    regime: Regime
    identity: Mapping[str, str]
    cycles: list[Cycle]
    last: Aged | None
    saved_s: float = 0.0

    @property
    def done(self) -> int:
        """Whole cycles."""
        return self.last.cycle.number if self.last else 0

    @property
    def unlike(self) -> tuple[CellKind, ...]:
        """The kinds of cells if there is something to say of each; else none."""
        kinds = self.drawn.pack.cells()
        return kinds if len(kinds) > 1 else ()

    def faded(self) -> bool:
        """The capacity has fallen below what was asked for."""
        if self.request.stop_at_capacity is None or not self.cycles:
            return False
        first, last = (self.cycles[k].health.capacity_C for k in (0, -1))
        return last < self.request.stop_at_capacity * first

    def add(self, aged: Aged) -> None:
        """One more cycle; written if the last time was a while ago."""
        self.cycles.append(aged.cycle)
        if aged.cycle.status is Status.DONE:
            self.last = aged
        if time.monotonic() - self.saved_s > SAVED_EVERY_S:
            self.save()

    def save(self) -> None:
        """Tables, then the checkpoint; each whole."""
        self._write("ageing", ageing_columns(self.cycles))
        if self.unlike:
            self._write("cells", cell_columns(self.cycles, self.unlike))
        if self.last is not None:
            whole = tuple(c for c in self.cycles if c.status is Status.DONE)
            checkpoint = Checkpoint(identity=self.identity, cycles=whole, last=self.last)
            write_whole(self.request.out / CHECKPOINT, to_text(checkpoint))
        self.saved_s = time.monotonic()

    def _write(self, name: str, columns: Columns) -> None:
        write_whole(self.request.out / f"{name}.csv", as_csv(columns))
        write_whole(self.request.out / f"{name}.parquet", as_parquet(columns))

    def draw(self) -> None:
        """The picture."""
        names = [kind.name for kind in self.unlike]
        picture = ageing_svg(self.cycles, names, repeated=self.request.repeat)
        write_whole(self.request.out / "ageing.svg", picture)
