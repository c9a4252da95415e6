"""`twin replay`: files in, files out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.builtin import load_cell
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating, chosen
from twin.load import Between
from twin.load_csv import read_load_csv
from twin.pack import Pack
from twin.pack_file import PackFile, cell_reference, effect_ids, parse_pack_file
from twin.replay import Replay
from twin.replay_files import replay_csv, replay_svg
from twin.simulate import simulate
from twin.solution import Status
from twin.whole_file import write_whole

ROOM_C = 25.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """The command line of `twin replay`."""

    load: Path
    pack: Path
    out: Path
    between: str


def run(request: Request) -> tuple[str, bool]:
    """Simulate and write; what to tell, and whether the whole load was simulated."""
    file = parse_pack_file(request.pack.read_text(encoding="utf-8"), name=str(request.pack))
    with request.load.open(encoding="utf-8-sig", newline="") as stream:
        table = read_load_csv(stream, name=str(request.load))
    load = table.load(between=Between(request.between), ambient_K=_ambient_K(file))
    pack = _pack(file, request.pack.resolve().parent)
    recorded = np.full(load.time_s.shape, np.nan) if table.voltage_V is None else table.voltage_V
    replay = Replay(
        load=load,
        recorded_V=recorded,
        judged=np.ones(load.time_s.shape, dtype=bool),
        solution=simulate(pack, load),
    )
    request.out.mkdir(parents=True, exist_ok=True)
    write_whole(request.out / "replay.csv", replay_csv(replay))
    write_whole(request.out / "replay.svg", replay_svg(replay))
    return _in_words(replay), replay.solution.status is Status.DONE


def _pack(file: PackFile, folder: Path) -> Pack:
    """The pack of the file; full and at the temperature of the air where it is silent."""
    start_c = file.start.temperature_c
    transfer = file.environment.heat_transfer_W_m2_K
    if transfer is None:
        transfer = SelfHeating.parameters[0].value
    ah = file.pack.capacity_ah
    return Pack(
        cell=load_cell(cell_reference(file, folder)),
        series=file.pack.series,
        parallel=file.pack.parallel,
        capacity_C=None if ah is None else 3600 * ah,
        initial_soc=1.0 if file.start.soc is None else file.start.soc,
        initial_K=_ambient_K(file) if start_c is None else start_c + ZERO_CELSIUS_K,
        effects=chosen(effect_ids(file), heat_transfer_W_m2_K=transfer),
    )


def _ambient_K(file: PackFile) -> float:
    ambient_c = file.environment.ambient_c
    return (ROOM_C if ambient_c is None else ambient_c) + ZERO_CELSIUS_K


def _in_words(replay: Replay) -> str:
    solution, rmse = replay.solution, replay.rmse_V
    lines = [
        f"simulated to {solution.stopped_s:.1f} s of {replay.load.time_s[-1]:.1f} s: "
        f"{solution.status.value}"
    ]
    if solution.time_s.size:
        celsius = solution.temperature_K[-1] - ZERO_CELSIUS_K
        lines.append(
            f"at the end {solution.voltage_V[-1]:.3f} V, charge {100 * solution.soc[-1]:.1f} %, "
            f"{celsius:.1f} °C"
        )
    if rmse is not None:
        lines.append(f"voltage error {1000 * rmse:.1f} mV RMS")
    return "\n".join(lines)
