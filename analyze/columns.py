"""Tables by column, as files."""

import io
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from twin.replay import Replay

Columns = Mapping[str, pa.Array]


def measured(values: npt.NDArray[np.float64]) -> pa.Array:
    """(n,) with nothing, rather than NaN, where there is no value."""
    return pa.array(values, mask=np.isnan(values))


def replay_columns(replay: Replay) -> Columns:
    """One row a sample, as far as simulated."""
    solution, m = replay.solution, replay.solution.time_s.size
    columns = {
        "time_s": solution.time_s,
        "current_A": solution.current_A,
        "recorded_V": replay.recorded_V[:m],
        "simulated_V": solution.voltage_V,
        "soc": solution.soc,
        "temperature_K": solution.temperature_K,
        "heat_W": solution.heat_W,
    }
    return {name: measured(values) for name, values in columns.items()}


def as_parquet(columns: Columns) -> bytes:
    """A whole file."""
    out = io.BytesIO()
    pq.write_table(pa.table(dict(columns)), out)
    return out.getvalue()


def as_csv(columns: Columns) -> bytes:
    """A whole file; numbers with all digits they have, empty where there is no value."""
    out = io.BytesIO()
    out.write(f"{','.join(columns)}\n".encode())
    options = pa_csv.WriteOptions(include_header=False, quoting_style="needed")
    pa_csv.write_csv(pa.table(dict(columns)), out, options)
    return out.getvalue()
