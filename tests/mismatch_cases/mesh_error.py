"""What PyBaMM's own mesh and tolerance cost: `python -m tests.mismatch_cases.mesh_error [NAME...]`.

The first seconds of a flight on the mesh of the cases and on one twice as fine in every direction
at a hundredth of the tolerance, whose own error is a quarter (second order). Minutes a row.
"""

import sys
import time
from collections.abc import Mapping
from itertools import chain

import numpy as np

from proof.simulated.configured import Configured
from proof.simulated.dfn import TOLERANCE, solve
from proof.simulated.effects import LIBRARY
from proof.simulated.flights import true_flight
from proof.simulated.pack_truth import PackTruth
from tests.mismatch_cases.catalogue import END_SOC, FIRST_SEED, LIPO, M50

SPAN_S = 60.0
ROWS: Mapping[str, tuple[Configured, str | None, float]] = {
    "lipo": (LIPO[0], None, 0.0),
    "lipo-cold_pack": (LIPO[0], "cold_pack", 8.0),
    "lipo-solid_diffusion_negative": (LIPO[0], "solid_diffusion_negative", 2.0),
    "lipo-solid_diffusion_positive": (LIPO[0], "solid_diffusion_positive", 1.0),
    "lipo-electrolyte_transport": (LIPO[0], "electrolyte_transport", 0.6),
    "lipo-ocv_hysteresis": (LIPO[0], "ocv_hysteresis", 0.03),
    "lipo-plating_stripping": (LIPO[0], "plating_stripping", 3000.0),
    "m50": (M50, None, 0.0),
    "m50-solid_diffusion_positive": (M50, "solid_diffusion_positive", 0.3),
}


def row(name: str) -> str:
    """One line: rms and largest error of the pack."""
    told, effect, size = ROWS[name]
    pack = PackTruth.of(told)
    if effect is not None:
        pack = LIBRARY[effect].make(pack, size, 0)
    low, high = END_SOC[told.cell]
    drawn = told.start_soc - high, told.start_soc - low
    flight = true_flight("vertical", FIRST_SEED["tune"], full_C=told.full_C, drawn=drawn)
    span = slice(0, int(np.searchsorted(flight.time_s, SPAN_S)))
    time_s, current_A = flight.time_s[span], flight.current_A[span]
    answers, seconds = [], []
    for finer, tolerance in ((1, TOLERANCE), (2, TOLERANCE / 100)):
        start = time.perf_counter()
        cell_A = current_A / told.parallel
        answers.append(solve(pack.cells, time_s, cell_A, finer=finer, tolerance=tolerance)[0])
        seconds.append(time.perf_counter() - start)
    error_mV = 1e3 * told.series * (answers[0] - answers[1])
    twin_mV = 1e3 * (told.voltage_V(time_s, current_A) - told.series * answers[1])
    parts = [f"{np.sqrt(np.mean(error_mV**2)):.2f} / {np.abs(error_mV).max():.2f}"]
    parts.append("-" if effect else f"{np.sqrt(np.mean(twin_mV**2)):.2f}")
    return " | ".join(chain([name], parts, (f"{s:.0f}" for s in seconds)))


def main() -> None:
    """Print the table."""
    sys.stdout.write("case | pack rms / max mV | our twin, rms mV | s | s of the finer\n")
    for name in sys.argv[1:] or ROWS:
        sys.stdout.write(row(name) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
