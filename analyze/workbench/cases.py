"""The simulations that one call of `twin replay` asks for, and what came of each."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from analyze.columns import Columns, measured, replay_columns
from analyze.workbench.drawn import Drawn, in_air
from reports.quantity import fixed, significant
from twin.constants import ZERO_CELSIUS_K
from twin.load import Between, Load
from twin.pack import Pack
from twin.replay import Replay
from twin.simulate import flowed, simulate
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

SAMPLES_PER_HOUR = 3600.0  # of a 1C discharge; at other rates as many over the whole
HOURS = 2.0  # of a 1C discharge: twice what the pack is said to hold, so that the cut-off ends it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """One simulation.

    Attributes:
        name: what sets it apart from the others.
        load: what is drawn.
        recorded_V: (n,) at the times of the load, NaN where it was not recorded.
        judged: (n,) bool, the samples that count in the error.
        pack: as it starts.
        rate: of a discharge at constant current, in C; None for a load.
        scale: factor on the current of a load.
    """

    name: str
    load: Load
    recorded_V: FloatArray
    judged: npt.NDArray[np.bool_]
    pack: Pack
    rate: float | None = None
    scale: float = 1.0

    @property
    def end(self) -> Status:
        """How it ends if all is well: a discharge at its cut-off."""
        return Status.DONE if self.rate is None else Status.LOWER_CUT_OFF

    @property
    def end_in_words(self) -> str:
        """The same, for the terminal."""
        return "whole load" if self.rate is None else "cut-off"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answer:
    """A case and the twin's answer to it."""

    case: Case
    replay: Replay

    @property
    def complete(self) -> bool:
        """It ended as it should."""
        return self.replay.solution.status is self.case.end


def answers(cases: Sequence[Case]) -> Iterator[Answer]:
    """Simulate each."""
    for case in cases:
        solution = simulate(case.pack, case.load)
        yield Answer(
            case=case,
            replay=Replay(
                load=case.load,
                recorded_V=case.recorded_V,
                judged=case.judged,
                solution=solution,
            ),
        )


def load_cases(
    drawn: Drawn, ambient_C: Sequence[float], scales: Sequence[float]
) -> tuple[Case, ...]:
    """The load at each temperature with each factor; as it is where a sweep is empty.

    What was recorded belongs to the current as it was: a scaled one is compared with nothing.
    """
    out = []
    for celsius, scale in product(ambient_C or (None,), scales or (1.0,)):
        pack, load = in_air(celsius, drawn.pack, drawn.load)
        out.append(
            Case(
                name=_name(celsius, f"x {scale:g}" if scales else "") or drawn.name,
                load=replace(load, current_A=scale * load.current_A),
                recorded_V=np.where(scale == 1.0, drawn.recorded_V, np.nan),
                judged=drawn.judged,
                pack=pack,
                scale=scale,
            )
        )
    return tuple(out)


def rate_cases(
    pack: Pack, ambient_K: float, ambient_C: Sequence[float], rates: Sequence[float]
) -> tuple[Case, ...]:
    """A discharge at each rate and temperature, from the start of `pack` to its cut-off."""
    whole_A = pack.rated_C / 3600
    hours = np.arange(0.0, HOURS + 0.5 / SAMPLES_PER_HOUR, 1 / SAMPLES_PER_HOUR)
    out = []
    for celsius, rate in product(ambient_C or (None,), rates):
        load = Load(
            time_s=3600 / rate * hours,
            current_A=np.full(hours.size, rate * whole_A),
            between=Between.HOLD,
            ambient_K=ambient_K,
        )
        at, load = in_air(celsius, pack, load)
        out.append(
            Case(
                name=_name(celsius, f"{rate:g}C"),
                load=load,
                recorded_V=np.full(hours.size, np.nan),
                judged=np.zeros(hours.size, dtype=bool),
                pack=at,
                rate=rate,
            )
        )
    return tuple(out)


def _name(celsius: float | None, other: str) -> str:
    return ", ".join(([] if celsius is None else [f"{celsius:g} °C"]) + ([other] if other else []))


def sample_columns(done: Sequence[Answer]) -> Columns:
    """One row a sample and case, as far as simulated."""
    tables = []
    for answer in done:
        own = dict(replay_columns(answer.replay))
        m = len(own["time_s"])
        case = {
            "case": pa.array([answer.case.name] * m, type=pa.string()),
            "ambient_K": pa.array(np.full(m, answer.case.load.ambient_K)),
        }
        own["charge_Ah"] = measured(flowed(answer.case.pack, answer.case.load).drawn_C()[:m] / 3600)
        tables.append(pa.table(case | own))
    whole = pa.concat_tables(tables).combine_chunks()
    return dict(zip(whole.column_names, whole.columns, strict=True))


def summary_columns(done: Sequence[Answer]) -> Columns:
    """One row a case."""
    rows = [_summary(a) for a in done]
    return {name: pa.array([row[name] for row in rows]) for name in rows[0]}


def _summary(answer: Answer) -> Mapping[str, object]:
    case, replay, s = answer.case, answer.replay, answer.replay.solution
    voltage = s.voltage_V if s.voltage_V.size else np.full(1, np.nan)
    warmest_K = s.temperature_K.max() if s.temperature_K.size else np.nan
    row = {
        "ambient_c": case.load.ambient_K - ZERO_CELSIUS_K,
        "c_rate": case.rate,
        "scale": None if case.rate else case.scale,
        "simulated_s": s.stopped_s - case.load.time_s[0],
        "charge_ah": s.charge_C / 3600,
        "energy_wh": s.energy_J / 3600,
        "end_v": voltage[-1],
        "min_v": voltage.min(),
        "end_soc": s.soc[-1] if s.soc.size else None,
        "max_temperature_c": warmest_K - ZERO_CELSIUS_K,
        "voltage_rmse_mv": _milli(replay.rmse_V),
        "max_error_mv": _milli(replay.max_error_V),
        "lithium_audit": s.audit.relative_error,
    }
    finite = {k: v if v is not None and np.isfinite(v) else None for k, v in row.items()}
    numbers = {k: v if v is None else float(v) for k, v in finite.items()}
    return {"case": case.name, "status": s.status.name.lower(), **numbers}


def _milli(value_V: float | None) -> float | None:
    return None if value_V is None else 1000 * value_V


HEADER = ("case", "ended", "s", "Ah", "Wh", "end V", "min V", "charge %", "max °C", "error mV")


def summary_rows(done: Sequence[Answer]) -> Iterator[tuple[str, ...]]:
    """For the terminal, in the order of HEADER."""
    for answer in done:
        row = _summary(answer)

        def number(name: str, decimals: int, row: Mapping[str, object] = row) -> str:
            value = row[name]
            return fixed(value if isinstance(value, float) else None, decimals)

        soc = row["end_soc"]
        yield (
            answer.case.name,
            answer.case.end_in_words if answer.complete else str(row["status"]).replace("_", " "),
            significant(float(str(row["simulated_s"])), 4),
            number("charge_ah", 3),
            number("energy_wh", 2),
            number("end_v", 3),
            number("min_v", 3),
            fixed(100 * soc if isinstance(soc, float) else None, 1),
            number("max_temperature_c", 1),
            number("voltage_rmse_mv", 1),
        )
