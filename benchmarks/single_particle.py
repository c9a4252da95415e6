"""What a single-particle model misses: `python -m benchmarks.single_particle`.

The single-particle limit is the twin itself with transport made ideal: salt and potentials are
uniform, so every particle of an electrode does the same. Prints its difference from the P2D model
for constant currents and the reference flights of the built-in cells, to the earlier of the two
ends, as it is and with the series resistance that mends most of it; and, where the recordings are
at hand, both models' errors against a measured LiPo pouch (`measured_lipo`).
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from benchmarks.measured_lipo import tables
from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.simulate import Run, changeable, simulate, solution_of
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

IDEAL = 1e5
"""Factor on conductivities and on the diffusivity of the salt; what gradients are left make 3 uV at
5C (LG M50)."""
RATES = (0.2, 0.5, 1.0, 2.0, 3.0, 5.0)
SAMPLES = 1000  # of a discharge


def without_transport(numbers: Mapping[str, float]) -> dict[str, float]:
    """`changeable` numbers with ideal conduction and salt diffusion: the single-particle limit."""
    ideal = {k for k in numbers if k.endswith(("conductivity_S_m", "conductivity_factor"))}
    ideal.add("electrolyte.diffusivity_factor")
    return {k: v * IDEAL if k in ideal else v for k, v in numbers.items()}


def single_particle(pack: Pack, load: Load, state: FloatArray | None = None) -> Solution:
    """`simulate` without transport in the electrolyte and in the solid."""
    run = Run(pack, load, None, Backend.AUTO, None)
    run.change(without_transport(changeable(pack, load)))
    if state is not None:
        run.initial = run.state = state
    run.run()
    return solution_of(run, pack, load)


def discharge(rate: float, capacity_C: float) -> Load:
    """Constant current for a little longer than the capacity lasts."""
    time_s = np.linspace(0.0, 1.15 * 3600 / rate, SAMPLES)
    return Load(time_s=time_s, current_A=np.full(SAMPLES, rate * capacity_C / 3600))


def row(pack: Pack, name: str, load: Load) -> str:
    """One line of the table: difference single particle - P2D."""
    full, single = simulate(pack, load), single_particle(pack, load)
    n = min(full.voltage_V.size, single.voltage_V.size)
    difference_mV = 1e3 * (single.voltage_V[:n] - full.voltage_V[:n])
    current_A = full.current_A[:n]
    ohm = float(current_A @ difference_mV / (current_A @ current_A))
    mended_mV = difference_mV - ohm * current_A
    ah = [f"{s.charge_C / 3600:.3f} ({s.status.name})" for s in (full, single)]
    return (
        f"{pack.cell.name[:12]} | {name} | {np.sqrt(np.mean(difference_mV**2)):.1f} "
        f"| {np.abs(difference_mV).max():.1f} | {np.mean(difference_mV):+.1f} "
        f"| {np.sqrt(np.mean(mended_mV**2)):.1f} | {ohm:.2f} | {' | '.join(ah)}"
    )


def main() -> None:
    """Print the tables."""
    print(
        "cell | load | rms mV | max mV | mean mV | rms mV with a resistance | of mOhm "
        "| P2D Ah (end) | single particle Ah (end)"
    )
    for name in ("lg_m50", "lipo_2200"):
        pack = Pack(cell=load_cell(name))
        for rate in RATES:
            print(row(pack, f"{rate:g}C", discharge(rate, pack.cell.nominal_capacity_C)))
        flown = LOADS[name, "flight"]
        print(row(pack, "flight", Load(time_s=flown.time_s, current_A=flown.current_A)))
    models = {"P2D": simulate_from, "single particle": single_particle}
    print(tables(models))


def simulate_from(pack: Pack, load: Load, state: FloatArray | None = None) -> Solution:
    """`simulate`."""
    return simulate(pack, load, state=state)


if __name__ == "__main__":
    main()
