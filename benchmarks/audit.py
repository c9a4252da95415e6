"""Lithium over many cycles with every effect: `python -m benchmarks.audit [CYCLES]` (1000).

Each built-in cell from 70 %: the first minute of its reference flight at 10 Hz, a minute of rest,
what was drawn back at 1C, a minute of rest. Missing lithium is relative to all there is, missing
charge to what moved, and salt to the salt at the start: side reactions neither make nor use it up.
"""

import sys
import time

from tests.reference.loads import LOADS
from twin.builtin import builtin_names, load_cell
from twin.effects import EFFECTS, chosen
from twin.load import Load
from twin.pack import Pack
from twin.protocol import ConstantCurrent, FollowLoad, Rest, run

FLIGHT_S, REST_S = 60.0, 60.0


def row(name: str, count: int) -> str:
    """Of the table, for one cell."""
    cell, flight = load_cell(name), LOADS[name, "flight"]
    pack = Pack(cell=cell, initial_soc=0.7, effects=chosen(EFFECTS, heat_transfer_W_m2_K=10.0))
    part = flight.time_s <= FLIGHT_S
    load = Load(time_s=flight.time_s[part], current_A=flight.current_A[part])
    rate_A, rest = cell.nominal_capacity_C / 3600, Rest(duration_s=REST_S)
    charge = ConstantCurrent(current_A=-rate_A, duration_s=load.charge_C() / rate_A)
    start = time.perf_counter()
    result = run(pack, (FollowLoad(load=load), rest, charge, rest) * count).require()
    seconds = time.perf_counter() - start
    audit, moved_C = result.audit, 2 * count * load.charge_C()
    lost_mol = sum(end - start for start, end in audit.lost_mol.values())
    before, after = audit.electrolyte_mol
    return (
        f"| {name} | {count} | {1e6 * lost_mol:.0f} | {audit.relative_error:.0e} "
        f"| {audit.charge_error_C / moved_C:.0e} | {after / before - 1:.0e} | {seconds:.0f} |"
    )


if __name__ == "__main__":
    print("| cell | cycles | lost umol | lithium missing | charge missing | salt missing | s |")
    print("|---|---|---|---|---|---|---|")
    for cell_name in builtin_names():
        print(row(cell_name, int(sys.argv[1]) if len(sys.argv) > 1 else 1000), flush=True)
