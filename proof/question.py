"""`Question`: all that the judge gets of a trial, as the files that a user would have."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from twin.bpx_out import write_bpx
from twin.calibrate.out import toml_text
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating
from twin.load import Between, Load
from twin.mismatch import Flight
from twin.pack import Pack
from twin.whole_file import write_whole

FloatArray = npt.NDArray[np.float64]

PACK, CELL = "pack.toml", "cell.bpx.json"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """What was recorded of a pack.

    Attributes:
        name: of its file, without ending; says nothing of what is in it.
        time_s: (n,) increasing.
        current_A: (n,) of the pack, discharge positive.
        voltage_V: (n,) of the pack.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Question:
    """A twin, and recordings that it is to be compared with.

    Attributes:
        pack: the twin as configured, as it starts every recording.
        ambient_K: of the air.
        fitted: recordings that effects are fitted to.
        held_out: recordings on which they are judged.
        builtin: name of the pack's cell if it is a built-in one, else "".
        floor_V: the twin's own error, rms of the pack's voltage in tests it was not fitted to; None
            where it is exact but for its numerics.
        between: how the current runs between samples.
    """

    pack: Pack
    ambient_K: float
    fitted: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    builtin: str = ""
    floor_V: float | None = None
    between: Between = Between.LINEAR

    def write(self, folder: Path) -> None:
        """Files of a pack and a CSV a recording, in a folder that exists."""
        if not self.builtin:
            write_whole(folder / CELL, write_bpx(self.pack.cell, description="the twin as given"))
        write_whole(folder / PACK, self._pack_text())
        for r in (*self.fitted, *self.held_out):
            write_whole(folder / f"{r.name}.csv", csv_text(r))

    def options(self) -> tuple[str, ...]:
        """Of `twin explain`, beside the folder that `write` filled; paths are relative to it."""
        floor = () if self.floor_V is None else ("--floor-mv", repr(1e3 * self.floor_V))
        ahead = [part for r in self.held_out for part in ("--holdout", f"{r.name}.csv")]
        files = [f"{r.name}.csv" for r in self.fitted]
        return (*files, *ahead, "--pack", PACK, "--between", self.between.value, *floor)

    def flights(self, recordings: Sequence[Recording]) -> list[Flight]:
        """Some of the recordings, as the engine takes them."""
        return [
            Flight(
                name=r.name,
                pack=self.pack,
                load=self.load(r),
                voltage_V=r.voltage_V,
                judged=np.isfinite(r.voltage_V),
                motion=np.full(r.time_s.size, ""),
            )
            for r in recordings
        ]

    def load(self, recording: Recording) -> Load:
        """What was drawn."""
        return Load(
            time_s=recording.time_s,
            current_A=recording.current_A,
            between=self.between,
            ambient_K=self.ambient_K,
        )

    def _pack_text(self) -> str:
        pack = self.pack
        heating = [e for e in pack.effects if isinstance(e, SelfHeating)]
        others = [e for e in pack.effects if not isinstance(e, SelfHeating)]
        transfer = heating[0].heat_transfer_W_m2_K if heating else pack.heat_transfer_W_m2_K
        cooling = {} if transfer is None else {"heat_transfer_W_m2_K": transfer}
        if pack.heat_transfer_std_W_m2_K is not None:
            cooling["heat_transfer_std_W_m2_K"] = pack.heat_transfer_std_W_m2_K
        return toml_text(
            {
                "pack": {
                    "name": "pack",
                    "cell": self.builtin or CELL,
                    "capacity_ah": pack.rated_C / 3600,
                    "series": pack.series,
                    "parallel": pack.parallel,
                },
                "start": ({} if pack.soc_by_rest else {"soc": pack.initial_soc})
                | {"temperature_c": pack.initial_K - ZERO_CELSIUS_K},
                "environment": {"ambient_c": self.ambient_K - ZERO_CELSIUS_K} | cooling,
                "twin": {"physics": [e.id for e in pack.effects]},
                "standard_errors": pack.standard_errors,
                "effects": {e.id: asdict(e) for e in others},
            }
        )


def csv_text(r: Recording) -> str:
    """Columns as `twin explain` reads them; a voltage that was not recorded is left empty."""
    volts = ["" if np.isnan(v) else repr(v) for v in r.voltage_V.tolist()]
    rows = zip(r.time_s.tolist(), r.current_A.tolist(), volts, strict=True)
    lines = [f"{t!r},{i!r},{v}" for t, i, v in rows]
    return "\n".join(["time_s,current_a,voltage_v", *lines, ""])
