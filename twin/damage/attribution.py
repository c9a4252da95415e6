"""The flight as it was flown, once: what each of its spans cost the battery, to the last atom.

The other view, `assess`, repeats a motion from full to empty; this one sees it where it was flown:
at that charge, in a pack as warm as it was by then. So that the two can be compared, each motion is
also flown from full to the cut-off once from the state this flight begins with. How much of it is
owed to the order in which the motions came is told by other orders.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.damage.cost import Cost, cost_of, drawn, total
from twin.damage.cycles import CannotCycle, from_full
from twin.damage.error import UNKNOWN_ERROR, Error
from twin.damage.loss import Ledger
from twin.damage.measures import MEASURES
from twin.damage.orders import reordered
from twin.damage.waveform import Waveform
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.pack_model import pack_model
from twin.protocol import ConstantCurrent, Rest, Settings, run
from twin.simulate import as_flowed, surroundings
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

PROBE_S = 60.0
LEVEL_S = 3600.0  # a rest that levels out concentrations and temperature


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A stretch [start_s, stop_s) of the load under a name; spans are in order and disjoint.

    Attributes:
        name: of its motion.
        start_s: on the clock of the load.
        stop_s: likewise.
        movable: it could have been flown at another moment; a take-off could not.
    """

    name: str
    start_s: float
    stop_s: float
    movable: bool = True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Attribution:
    """A flight's damage, span by span.

    Attributes:
        spans: as given.
        costs: of each, as far as the simulation came; fewer than the spans if it ended early.
        whole: of all of the load, what lies between the spans included.
        repeated: name -> the motion flown from full to the cut-off, from the same state.
        status: how the simulation ended.
        orders: what each span would have cost, for some other orders of the movable ones; none if
            the flight was not simulated to its end.
    """

    spans: tuple[Span, ...]
    costs: tuple[Cost, ...]
    whole: Cost
    repeated: Mapping[str, Cost]
    status: Status
    orders: tuple[tuple[Cost, ...], ...] = ()

    def by_name(self) -> dict[str, Cost]:
        """All spans of a name together, if the simulation came to the end of them."""
        ended = len(self.costs) - (self.status is not Status.DONE)
        part = {s.name for s in self.spans[ended:]}
        names = dict.fromkeys(s.name for s in self.spans if s.name not in part)
        return {name: total(self.of(name)) for name in names}

    def of(self, name: str) -> tuple[Cost, ...]:
        """Of each span of that name."""
        both = zip(self.spans, self.costs, strict=False)
        return tuple(cost for span, cost in both if span.name == name)

    def order_error(self, name: str, measure: str) -> Error:
        """By how much another order of the spans changes a motion's damage per charge.

        Over the damage per charge. It is the root mean square of the changes in `orders`: the
        difference of two orders, not the distance of one from their mean, which is less by the
        root of two. Not known without other orders, or where there is no damage.
        """
        own = [k for k, span in enumerate(self.spans) if span.name == name]
        if not self.orders or not own:
            return UNKNOWN_ERROR
        per_C = np.array(
            [_per_C([costs[k] for k in own], measure) for costs in (self.costs, *self.orders)]
        )
        if not per_C[0]:
            return UNKNOWN_ERROR
        changes = per_C[1:] / per_C[0] - 1
        return Error(std=float(np.sqrt(np.mean(changes**2))), freedom=len(self.orders))


def _per_C(costs: Sequence[Cost], measure: str) -> float:
    whole = total(costs)
    return MEASURES[measure](whole.loss) / whole.drawn_C if whole.drawn_C > 0 else 0.0


def attribute(
    pack: Pack,
    load: Load,
    spans: Sequence[Span],
    *,
    formed: FloatArray,
    waveforms: Mapping[str, Waveform],
) -> Attribution:
    """One replay of `load`.

    Args:
        pack: that ages; its start is that of the flight.
        load: the flight's.
        spans: of it.
        formed: a state of the pack, charged, whose first films are grown.
        waveforms: name -> motion, to be flown from full for comparison.

    Raises:
        CannotCycle: the pack cannot be brought to the charge that the flight begins with.
    """
    ledger = Ledger(pack)
    state = started(pack, formed, load.ambient_K)
    edges = _edges(load, spans)
    inside, flows = as_flowed(pack, load)  # here: a clock is late across the edges too
    loads = [between(flows, *ends) for ends in pairwise(edges)]
    pieces, status = drawn(inside, ledger, loads, state)
    at = {t: k for k, t in enumerate(edges[: len(pieces)])}
    places = [at[t] for s in spans if (t := max(s.start_s, edges[0])) in at]
    movable = [p for s, p in zip(spans, places, strict=False) if s.movable]
    others = reordered(inside, ledger, loads, movable, state) if status is Status.DONE else ()
    charged = _at_K(pack, formed, float(surroundings(pack, load.ambient_K)[0]))
    return Attribution(
        spans=tuple(spans),
        costs=tuple(pieces[p] for p in places),
        whole=total(pieces),
        repeated={n: _repeated(pack, ledger, w, charged, load) for n, w in waveforms.items()},
        status=status,
        orders=tuple(tuple(other[p] for p in places) for other in others),
    )


def started(pack: Pack, formed: FloatArray, ambient_K: float) -> FloatArray:
    """`formed`, discharged at 1C to the charge the pack starts with, rested, at its temperature.

    Raises:
        CannotCycle: the cut-off comes before that charge.
    """
    whole_A, cells = pack.rated_C / 3600, pack.cells()
    start = sum(c.count * c.initial_soc for c in cells) / pack.series  # `soc` below is a mean too
    settings = Settings(ambient_K=ambient_K)

    def discharged(seconds: float) -> tuple[FloatArray, FloatArray]:
        steps = ConstantCurrent(current_A=whole_A, duration_s=seconds), Rest(duration_s=LEVEL_S)
        result = run(pack, steps, settings=settings, state=formed)
        if result.status is not Status.DONE:
            raise CannotCycle(
                f"the flight begins at {100 * start:.1f} % of charge, and a discharge "
                f"at 1C ends before that: {result.status.value}"
            )
        return result.end_state, result.steps[0].soc

    probed = discharged(PROBE_S)[1]
    seconds = PROBE_S * (probed[0] - start) / (probed[0] - probed[-1])
    state = discharged(float(seconds))[0] if seconds > 1.0 else formed
    return _at_K(pack, state, cells[0].initial_K)


def _at_K(pack: Pack, state: FloatArray, temperature_K: float) -> FloatArray:
    """`state` with all cells at a temperature."""
    model, out = pack_model(pack, None, Backend.AUTO), state.copy()
    model.states(out)[:, model.cell.layout.slice_of("temperature_K")] = temperature_K
    return out


def between(load: Load, start_s: float, stop_s: float) -> Load:
    """The part of a load (straight between samples) from one time to another."""
    inside = (load.time_s > start_s) & (load.time_s < stop_s)
    times = np.concatenate([[start_s], load.time_s[inside], [stop_s]])
    return replace(load, time_s=times, current_A=np.interp(times, load.time_s, load.current_A))


def _edges(load: Load, spans: Sequence[Span]) -> list[float]:
    """All times at which a span, or the load, begins or ends."""
    first, last = float(load.time_s[0]), float(load.time_s[-1])
    ends = {t for s in spans for t in (s.start_s, s.stop_s) if first < t < last}
    return sorted(ends | {first, last})


def _repeated(
    pack: Pack, ledger: Ledger, waveform: Waveform, state: FloatArray, load: Load
) -> Cost:
    repeated = from_full(pack, waveform, load.ambient_K)
    return cost_of(pack, ledger, repeated, state)[0]
