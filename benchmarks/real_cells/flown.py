"""A multirotor that flew a pack from full to empty: all there is to calibrate from is the flight.

Log: ArduPilot's LogAnalyzer examples (GPL-3), 3 cells, 4 Ah, 1 Hz.
"""

from pathlib import Path

from analyze.pipeline import Flight, Source, read_flight
from analyze.start import pack_of
from proof.recorded.measured import RealCell, RealTest, recording, wide

LOG = "flights/1002victor__ardupilot/underpowered.log"


def flight(folder: Path) -> Flight:
    """The log as `analyze` reads it."""
    return read_flight(Source(log=recording(folder, LOG), sensor=None, pack=None, battery=None))


def cell(folder: Path) -> RealCell:
    """The pack with its flight to fit, and none to judge by; baseline: what `analyze` takes."""
    read = flight(folder)
    r = read.recording
    test = RealTest(
        name="flight",
        time_s=r.time_s - r.time_s[0],
        current_A=r.current_A,
        voltage_V=r.voltage_V,
        temperature_K=r.temperature_K,
    )
    baseline = pack_of(read.use, wide(read.cell))
    return RealCell(
        name=f"flown pack {r.series}S {read.use.capacity_C / 3600:.1f} Ah",
        fit=(test,),
        held_out=(),
        baseline=baseline,
        source=f"built-in {read.cell.name}, capacity: {read.use.origins['capacity_C']}",
        published=False,
    )
