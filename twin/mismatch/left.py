"""What a twin leaves of a recording: recorded minus simulated, its cut-offs out of the way."""

from dataclasses import replace

from twin.cell import BEYOND_V
from twin.mismatch.flight import Flight, FloatArray
from twin.pack import Pack
from twin.solution import Solution, Status


def beyond_cut_offs(pack: Pack) -> Pack:
    """Its cells go on a while where they should stop: who is empty too early can be compared."""
    return replace(pack, cell=pack.cell.beyond())


def within_cut_offs(pack: Pack) -> Pack:
    """Inverse of `beyond_cut_offs`."""
    return replace(pack, cell=pack.cell.beyond(-BEYOND_V, -BEYOND_V))


def never_full(pack: Pack) -> Pack:
    """A full pack goes on where the noise of an idle current charges it."""
    return replace(pack, cell=pack.cell.beyond(lower_V=0.0))


def left_V(flight: Flight, pack: Pack, solution: Solution | None) -> FloatArray:
    """(n,) recorded minus simulated; from where the twin has ended, as if it stood at its cut-off.

    Args:
        flight: the recording.
        pack: that was simulated, as `beyond_cut_offs` gives it.
        solution: None if no cell can be so.
    """
    full = solution is not None and solution.status is Status.UPPER_CUT_OFF
    end_V = pack.cell.upper_cut_off_V if full else pack.cell.lower_cut_off_V
    out = flight.voltage_V - pack.series * end_V
    if solution is not None:
        n = solution.voltage_V.size
        out[:n] = flight.voltage_V[:n] - solution.voltage_V
    return out
