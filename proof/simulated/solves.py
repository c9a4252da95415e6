"""Answers of PyBaMM, kept in a folder: the same cell under the same current is solved once."""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybamm

from proof.simulated.cell_truth import CellTruth
from proof.simulated.dfn import EQUATIONS, POINTS, TOLERANCE, solve
from twin.builtin import builtin_text

FloatArray = npt.NDArray[np.float64]


class OutOfReachError(ValueError):
    """The cell cannot give this current, or be in this state."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solves:
    """Solutions by the content of the question; None keeps none."""

    folder: Path | None = None

    def answer(
        self, truth: CellTruth, time_s: FloatArray, current_A: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Voltage and temperature (n,) of one cell; OutOfReachError if there is none."""
        if self.folder is None:
            return _solve(truth, time_s, current_A)
        numerics = f"{POINTS[truth.cell]} {TOLERANCE} {EQUATIONS} {pybamm.__version__}"
        what = f"{truth!r} {numerics} {builtin_text(truth.cell)}".encode()
        key = hashlib.sha256(what + time_s.tobytes() + current_A.tobytes()).hexdigest()[:24]
        path = self.folder / f"{key}.npz"
        if not path.exists():
            voltage_V, temperature_K = _solve(truth, time_s, current_A)
            write_npz(path, {"voltage_V": voltage_V, "temperature_K": temperature_K})
        with np.load(path) as stored:
            return stored["voltage_V"], stored["temperature_K"]


def _solve(
    truth: CellTruth, time_s: FloatArray, current_A: FloatArray
) -> tuple[FloatArray, FloatArray]:
    try:
        voltage_V, temperature_K = solve(truth, time_s, current_A)
    except (pybamm.SolverError, pybamm.ModelError, ValueError) as e:
        raise OutOfReachError(f"{truth}: {e}") from e
    if voltage_V.shape != time_s.shape or not np.isfinite(voltage_V).all():
        raise OutOfReachError(f"{truth}: {voltage_V.size} of {time_s.size} samples")
    return voltage_V, temperature_K


def write_npz(path: Path, arrays: dict[str, npt.NDArray[np.generic]]) -> None:
    """Whole or not at all, whoever else writes the same."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.stem}.{os.getpid()}.npz")
    np.savez_compressed(beside, allow_pickle=False, **arrays)
    beside.replace(path)
