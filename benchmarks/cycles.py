"""Ageing over cycles beside PyBaMM's converged amounts: `python -m benchmarks.cycles`.

The LG M50 of O'Kane 2022 through the stored cycles (tests/reference/README.md), by samples of at
most a second and by adaptive steps, default mesh and tolerance. Voltages at the stored samples
without the first. `negative`: without stress and loss in the positive electrode, diffusion without
stress on both sides; `stress_diffusion`: all, diffusion enhanced by stress on both sides.
"""

import sys

import numpy as np

from tests.reference.ageing import ReferenceAgeing, ageing_names
from tests.reference.cycling import Answer, How, answer, theirs

CYCLES = ("cycle", "ten", "fifty", "flown")


def rows(name: str) -> list[str]:
    """Of the table, for one stored case."""
    reference = ReferenceAgeing.read(name)
    by = {how: answer(reference, how) for how in How}
    case = name.removeprefix("ageing-").removesuffix("-isothermal")
    out = []
    for what, amount in theirs(reference).items():
        cells = (
            f"{a.amounts[what]:.6g} | {100 * (a.amounts[what] / amount - 1):+.2f}"
            for a in by.values()
        )
        out.append(f"| {case} | {what} | {amount:.6g} | {' | '.join(cells)} |")
    cells = (f"{rms_mV(reference, a):.2f} | " for a in by.values())
    out.append(f"| {case} | voltage, rms [mV] | | {' | '.join(cells)} |")
    cells = (f"{a.audit.relative_error:.0e} | {a.seconds:.1f} s" for a in by.values())
    out.append(f"| {case} | lithium missing, relative | | {' | '.join(cells)} |")
    return out


def rms_mV(reference: ReferenceAgeing, ours: Answer) -> float:
    """Of the voltage at the samples, the first left out."""
    error_V = (ours.voltage_V - reference.outputs.voltage_V)[1:]
    return float(1e3 * np.sqrt(np.mean(error_V**2)))


def main() -> None:
    """Print the table."""
    print("| case | what | PyBaMM | sampled | % | adaptive | % |\n|---|---|---|---|---|---|---|")
    for name in ageing_names():
        if name.split("-")[1] in CYCLES:
            print("\n".join(rows(name)))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
