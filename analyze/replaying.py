"""A recording as a load, and the twin's answer to it."""

import numpy as np
import numpy.typing as npt

from analyze.start import pack_of
from flightlogs.held import measured_anew
from flightlogs.holes import longest_step_s
from flightlogs.recording import Recording
from reports.flight import Gaps, PackUse
from twin.cell import Cell
from twin.load import Between, Load
from twin.replay import Replay
from twin.simulate import simulate


def gap_steps(time_s: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """(n - 1,) which steps are so long that samples are missing in them, as warnings count them."""
    return np.asarray(np.diff(time_s) > longest_step_s(time_s))


def gaps_of(recording: Recording) -> Gaps:
    """Where the current is not known; the load runs straight across."""
    dt, i = np.diff(recording.time_s), recording.current_A
    missing = gap_steps(recording.time_s)
    charge = dt * (i[:-1] + i[1:]) / 2
    return Gaps(
        count=int(np.count_nonzero(missing)),
        total_s=float(dt[missing].sum()),
        longest_s=float(dt[missing].max(initial=0.0)),
        charge_C=float(charge[missing].sum()),
    )


def load_of(recording: Recording, use: PackUse) -> Load:
    """The recorded current in the surroundings of the pack."""
    return Load(
        time_s=recording.time_s,
        current_A=recording.current_A,
        between=Between.LINEAR,
        ambient_K=use.ambient_K,
    )


def in_flight(recording: Recording) -> npt.NDArray[np.bool_]:
    """(n,) the samples between take-off and landing."""
    t, flight = recording.time_s, recording.flight
    return np.asarray((t >= flight.start_s) & (t <= flight.stop_s))


def judged_of(recording: Recording) -> npt.NDArray[np.bool_]:
    """(n,) those of them with a voltage that does not repeat one before, see `measured_anew`."""
    judged = in_flight(recording) & np.isfinite(recording.voltage_V)
    judged[judged] = measured_anew(recording.voltage_V[judged], recording.current_A[judged])
    return judged


def measured_V(recording: Recording) -> npt.NDArray[np.float64]:
    """(n,) the voltage, NaN where in flight it repeats one before."""
    repeats = in_flight(recording) & ~judged_of(recording)
    return np.where(repeats, np.nan, recording.voltage_V)


def replay(recording: Recording, use: PackUse, cell: Cell) -> Replay:
    """Draw the recorded current from the pack; judged in flight, as `judged_of` says."""
    load = load_of(recording, use)
    return Replay(
        load=load,
        recorded_V=recording.voltage_V,
        judged=judged_of(recording),
        solution=simulate(pack_of(use, cell), load),
    )
