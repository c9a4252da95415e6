"""The flight as it was flown, once: what each of its spans cost the battery, to the last atom.

The other view, `assess`, repeats a motion from full to empty; this one sees it where it was flown:
at that charge, in a pack as warm as it was by then. So that the two can be compared, each motion is
also flown from full to the cut-off once from the state this flight begins with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.damage.cycles import MORE_THAN_ALL, energy_J
from twin.damage.loss import NOTHING, Ledger, Loss
from twin.damage.measures import MEASURES
from twin.damage.waveform import Waveform
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.pack_model import pack_model
from twin.protocol import ConstantCurrent, Rest, Settings, run
from twin.simulate import DEFAULT_MESH, simulate
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

PROBE_S = 60.0
LEVEL_S = 3600.0  # a rest that levels out concentrations and temperature


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A stretch [start_s, stop_s) of the load under a name; spans are in order and disjoint."""

    name: str
    start_s: float
    stop_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What a stretch cost.

    Attributes:
        loss: in it.
        drawn_C: likewise.
        energy_J: likewise.
        duration_s: of it, as far as it was simulated.
        mean_K: of the pack.
        mean_soc: of the cells.
    """

    loss: Loss
    drawn_C: float
    energy_J: float
    duration_s: float
    mean_K: float
    mean_soc: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Attribution:
    """A flight's damage, span by span.

    Attributes:
        spans: as given.
        costs: of each, as far as the simulation came; fewer than the spans if it ended early.
        whole: of all of the load, what lies between the spans included.
        repeated: name -> the motion flown from full to the cut-off, from the same state.
        status: how the simulation ended.
    """

    spans: tuple[Span, ...]
    costs: tuple[Cost, ...]
    whole: Cost
    repeated: Mapping[str, Cost]
    status: Status

    def by_name(self) -> dict[str, Cost]:
        """All spans of a name together."""
        return {name: total(self.of(name)) for name in dict.fromkeys(s.name for s in self.spans)}

    def of(self, name: str) -> tuple[Cost, ...]:
        """Of each span of that name."""
        both = zip(self.spans, self.costs, strict=False)
        return tuple(cost for span, cost in both if span.name == name)

    def relative_std(self, name: str, measure: str) -> float:
        """One standard deviation of a motion's damage per charge, by the spread of its spans.

        Over the damage per charge; NaN for fewer than two spans, or where there is no damage.
        """
        costs = [c for c in self.of(name) if c.drawn_C > 0]
        drawn = np.array([c.drawn_C for c in costs])
        damage = np.array([MEASURES[measure](c.loss) for c in costs])
        if len(costs) < 2 or not damage.any():
            return float("nan")
        away = (damage / drawn) / (damage.sum() / drawn.sum()) - 1
        weight = drawn / drawn.sum()
        return float(np.sqrt(weight**2 @ away**2 / (1 - weight @ weight)))


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
    """
    ledger = Ledger(pack)
    state = started(pack, formed, load.ambient_K)
    pieces: list[Cost] = []
    status = Status.DONE
    edges = _edges(load, spans)
    for start_s, stop_s in pairwise(edges):
        cost, solution = _flown(pack, ledger, between(load, start_s, stop_s), state)
        pieces.append(cost)
        state, status = solution.end_state, solution.status
        if status is not Status.DONE:
            break
    at = dict(zip(edges, pieces, strict=False))
    charged = _at_K(pack, formed, load.ambient_K)
    return Attribution(
        spans=tuple(spans),
        costs=tuple(at[t] for s in spans if (t := max(s.start_s, edges[0])) in at),
        whole=total(pieces),
        repeated={n: _repeated(pack, ledger, w, charged, load) for n, w in waveforms.items()},
        status=status,
    )


def started(pack: Pack, formed: FloatArray, ambient_K: float) -> FloatArray:
    """`formed`, discharged at 1C to the charge the pack starts with, rested, at its temperature."""
    whole_A = pack.scale * pack.cell.nominal_capacity_C * pack.parallel / 3600
    settings = Settings(ambient_K=ambient_K)

    def drawn(seconds: float) -> tuple[FloatArray, FloatArray]:
        steps = ConstantCurrent(current_A=whole_A, duration_s=seconds), Rest(duration_s=LEVEL_S)
        result = run(pack, steps, settings=settings, state=formed).require()
        return result.end_state, result.steps[0].soc

    probed = drawn(PROBE_S)[1]
    seconds = PROBE_S * (probed[0] - pack.initial_soc) / (probed[0] - probed[-1])
    state = drawn(float(seconds))[0] if seconds > 1.0 else formed
    return _at_K(pack, state, pack.initial_K)


def _at_K(pack: Pack, state: FloatArray, temperature_K: float) -> FloatArray:
    """`state` with all cells at a temperature."""
    model, out = pack_model(pack, DEFAULT_MESH, Backend.AUTO), state.copy()
    model.states(out)[:, model.cell.layout.slice_of("temperature_K")] = temperature_K
    return out


def between(load: Load, start_s: float, stop_s: float) -> Load:
    """The part of a load (straight between samples) from one time to another."""
    inside = (load.time_s > start_s) & (load.time_s < stop_s)
    times = np.concatenate([[start_s], load.time_s[inside], [stop_s]])
    return replace(load, time_s=times, current_A=np.interp(times, load.time_s, load.current_A))


def total(costs: Sequence[Cost]) -> Cost:
    """Of stretches together."""
    seconds = np.array([c.duration_s for c in costs])
    whole_s = float(seconds.sum())
    weight = seconds / whole_s if whole_s > 0 else np.full(seconds.size, np.nan)
    loss = NOTHING
    for c in costs:
        loss += c.loss
    return Cost(
        loss=loss,
        drawn_C=sum(c.drawn_C for c in costs),
        energy_J=sum(c.energy_J for c in costs),
        duration_s=whole_s,
        mean_K=float(weight @ [c.mean_K for c in costs]),
        mean_soc=float(weight @ [c.mean_soc for c in costs]),
    )


def _edges(load: Load, spans: Sequence[Span]) -> list[float]:
    """All times at which a span, or the load, begins or ends."""
    first, last = float(load.time_s[0]), float(load.time_s[-1])
    ends = {t for s in spans for t in (s.start_s, s.stop_s) if first < t < last}
    return sorted(ends | {first, last})


def _repeated(
    pack: Pack, ledger: Ledger, waveform: Waveform, state: FloatArray, load: Load
) -> Cost:
    whole_C = pack.scale * pack.cell.nominal_capacity_C * pack.parallel
    return _flown(pack, ledger, waveform.load(MORE_THAN_ALL * whole_C, load.ambient_K), state)[0]


def _flown(pack: Pack, ledger: Ledger, load: Load, state: FloatArray) -> tuple[Cost, Solution]:
    before = ledger.loss(state)
    solution = simulate(pack, load, state=state)
    known = bool(solution.time_s.size)
    cost = Cost(
        loss=ledger.loss(solution.end_state) - before,
        drawn_C=solution.charge_C,
        energy_J=energy_J(solution),
        duration_s=solution.stopped_s - float(load.time_s[0]),
        mean_K=float(solution.temperature_K.mean()) if known else np.nan,
        mean_soc=float(solution.soc.mean()) if known else np.nan,
    )
    return cost, solution
