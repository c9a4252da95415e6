"""Steps of the kernel whose length is chosen by their error, up to an event.

Every step is made once whole and once in two halves. The difference is the error of the whole: that
of salt diffusion (backward Euler) as much as that of the reactions (straight over a step). The
halves are kept, what is of first order in them extrapolated (2 halves - whole, which is of second),
and a step of length 0 makes potentials and reactions fit it. Source: Hairer, Norsett, Wanner,
Solving Ordinary Differential Equations I (Springer 1993), section II.4.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from twin.carried import carried
from twin.cell_mesh import fine_mesh_of
from twin.inventory import Lithium
from twin.kernel import Backend
from twin.limits import COLUMN, limits_of
from twin.mesh import Mesh
from twin.newton import CONVERGED_V
from twin.pack import Pack
from twin.pack_model import pack_model
from twin.simulate import little_salt_mol_m3, surroundings
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

FIRST_S = 0.1  # after a jump of the current
SHORTEST_S = 1e-7  # a step not solved although this short ends the protocol; fresh cracks need 1e-4
MOST_DOUBTFUL = 100  # steps of a stretch that may exceed the tolerance, see `Stepper._step`
LONGEST_S = 300.0
EVENT_V = 2e-6  # an event is located when it is missed by no more than this,
EVENT_S = 1e-3  # or known to within this
HELD_V = 2e-7  # a voltage is held to this
SMALLEST_JUMP = 1e-3  # of a whole one that cannot be solved
MAX_TRIES = 100  # of a jump by full electrodes, whose potential is steep, in small parts
SAFETY, SHRINK, GROW = 0.9, 0.2, 3.0

WEIGHT_V = {"salt": 0.05, "modes_n": 1.0, "modes_p": 1.0, "temperature_K": 5e-3}
"""What an error of the state is worth as a voltage. Salt, relative to the first: 2 R T / F, of
diffusion potential and kinetics. Stoichiometry: slopes of open-circuit potentials are 1 V and less
but at their ends. Temperature: 0.1 V of overpotential that changes by 5 % per kelvin."""


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A pack at a moment.

    Attributes:
        state: the kernel's.
        out: (outputs,) there.
        current_A: of each cell, discharge positive.
    """

    state: FloatArray
    out: FloatArray
    current_A: float

    @property
    def voltage_V(self) -> float:
        """Of the mean cell."""
        return float(self.out[COLUMN["voltage_V"]])


FIRST_ORDER = ("salt", "plated", "dead", "left_n", "left_p", "trapped_n", "trapped_p")
"""What of the state a step changes only to first order in its length (active material: where stress
follows the current at once). Films are exact."""

KEPT = {
    "salt": ("electrolyte",),
    "modes_n": ("negative", "trapped_negative", "plated", "dead"),
    "modes_p": ("positive", "trapped_positive"),
}
"""Of the state: amounts whose sum an extrapolation keeps, the first of them held there."""

Move = Callable[[Point, float, float], Point]
"""(where, for how long [s], about which current it ends at [A]) -> where that leads; not solved if
`correction_V` says so."""

Goal = Callable[[Point], float]
"""How far an event is passed [V]; it has come at 0 and above."""


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """A step in two halves.

    `good`: all of it was solved, within `Limits` of salt and stoichiometry; `error_V` is infinite
    if not.
    """

    middle: Point
    end: Point
    error_V: float
    good: bool


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Accepted points, the first being the start; `length_s` (points - 1,) lies between them.

    `came`: the goal was reached.
    """

    points: list[Point]
    length_s: list[float]
    status: Status
    came: bool

    def charge_C(self) -> float:
        """Drawn from the cell: the current runs straight from point to point."""
        current = np.array([p.current_A for p in self.points])
        return float(np.dot(self.length_s, current[:-1] + current[1:]) / 2)


class Stepper:
    """The cells of a pack in given surroundings; counts its kernel steps."""

    def __init__(
        self,
        pack: Pack,
        ambient_K: float,
        tolerance_V: float,
        mesh: Mesh | None,
        backend: Backend,
    ) -> None:
        self.model, self.kinds = pack_model(pack, mesh, backend), pack.cells()
        self.limits = limits_of(pack)
        self.steps = 0
        self._p, self._tail = self.model.parameters(self.kinds), surroundings(pack, ambient_K)
        self._tolerance_V = tolerance_V
        self._lithium = [Lithium(self.model.cell.layout, kind.values) for kind in self.kinds]
        self._weight_V = self._weights_V()
        rate_A = pack.rated_C / pack.parallel / 3600
        self.slope_V_A = -0.05 / rate_A  # of voltage over current; corrected as voltages are held

    def move(self, state: FloatArray, step_s: float, current_A: float) -> Point:
        """One kernel step, the current running straight to `current_A`."""
        self.steps += 1
        drive = np.array([[step_s, current_A, *self._tail]])
        following, out = self.model.steps(state, drive, self._p)
        return Point(following[0].flatten(), out[0], current_A)

    def jump(self, state: FloatArray, from_A: float, to_A: float) -> Point:
        """The current changes at once; in smaller jumps where the whole one cannot be solved."""
        share, size = 0.0, 1.0
        while True:
            goal = min(share + size, 1.0)
            point = self.move(state, 0.0, from_A + goal * (to_A - from_A))
            if self._solved(point):
                state, share, size = point.state, goal, 2 * size
            else:
                size /= 2
            if share == 1.0 or size < SMALLEST_JUMP:
                return point

    def hold(self, start: Point, step_s: float, about_A: float, voltage_V: float) -> Point:
        """One step at whose end the voltage is `voltage_V`.

        Secants in the current, kept between currents that miss it on either side; in a jump, half
        as far from the last current that was solved where one is not.
        """
        current_A, last, state = about_A, None, start.state
        low_A, high_A, reach_A = -np.inf, np.inf, np.inf  # more current, less voltage
        for _ in range(MAX_TRIES):
            point = self.move(state, step_s, current_A)
            if not self._solved(point):
                if last is None or step_s > 0:  # a shorter step may be solved
                    return point
                reach_A = abs(current_A - last.current_A) / 2
                current_A = (current_A + last.current_A) / 2
                continue
            miss_V = point.voltage_V - voltage_V
            if abs(miss_V) <= HELD_V:
                return point
            low_A, high_A = (current_A, high_A) if miss_V > 0 else (low_A, current_A)
            if last is not None:
                if current_A == last.current_A:  # no current is left between those that miss it
                    break
                slope = (point.voltage_V - last.voltage_V) / (current_A - last.current_A)
                self.slope_V_A = slope if slope < 0 else self.slope_V_A
            last, state = point, point.state if step_s == 0 else start.state
            reach_A *= 2
            current_A -= min(max(miss_V / self.slope_V_A, -reach_A), reach_A)
            if not low_A < current_A < high_A:
                current_A = (low_A + high_A) / 2
        return Point(start.state, np.full(self.model.outputs, np.nan), current_A)

    def go(self, start: Point, duration_s: float, move: Move, goal: Goal) -> Stretch:
        """Steps from `start` until `goal` is reached, or for `duration_s`."""
        points, gone_s, step_s = [start], 0.0, FIRST_S
        lengths: list[float] = []
        if not self._good(start):
            return Stretch(points, lengths, self._reason(start, start), came=False)
        came, doubtful = goal(start) >= 0, 0
        while gone_s < duration_s and not came:
            step_s = min(step_s, LONGEST_S, duration_s - gone_s)
            step_s, attempt = self._step(points[-1], step_s, move)
            share = attempt.error_V / self._tolerance_V
            doubtful += share > 1
            if not attempt.good or doubtful > MOST_DOUBTFUL:
                reason = self._reason(attempt.end, points[-1])
                return Stretch(points, lengths, reason, came=False)
            if came := goal(attempt.end) >= 0:
                step_s, attempt = self._locate(points[-1], step_s, attempt, move, goal)
            points += [attempt.middle, attempt.end]
            lengths += [step_s / 2, step_s / 2]
            gone_s = duration_s if step_s == duration_s - gone_s else gone_s + step_s
            if share <= 1:
                step_s *= min(GROW, SAFETY / max(share, 1e-9) ** 0.5)
        return Stretch(points, lengths, Status.DONE, came=came)

    def _step(self, start: Point, step_s: float, move: Move) -> tuple[float, Attempt]:
        """A step of `step_s` or less within the tolerance, else the most accurate that was tried.

        What no step resolves is the first instant of a film on a fresh crack: the mean current of a
        step is the larger, the shorter the step (amounts are exact for any).
        """
        best_s, best = step_s, None
        while True:
            attempt = self._attempt(start, step_s, move)
            if best is None or attempt.error_V <= best.error_V:
                best_s, best = step_s, attempt
            share = attempt.error_V / self._tolerance_V
            step_s *= max(SHRINK, SAFETY / max(share, 1e-9) ** 0.5)
            if share <= 1 or step_s < SHORTEST_S:
                return best_s, best

    def _locate(
        self, start: Point, step_s: float, beyond: Attempt, move: Move, goal: Goal
    ) -> tuple[float, Attempt]:
        """The length of a step that just reaches `goal`: false position (Illinois)."""
        low_s, low, high_s, high = 0.0, goal(start), step_s, goal(beyond.end)
        best_s = step_s
        while high > EVENT_V and high_s - low_s > EVENT_S:
            trial_s = (low_s * high - high_s * low) / (high - low)
            trial = self._attempt(start, trial_s, move)
            miss = goal(trial.end) if trial.good else 1.0
            if abs(miss) <= EVENT_V:
                return trial_s, trial
            if miss < 0:
                low_s, low, high = trial_s, miss, high / 2
            else:
                high_s, high, low = trial_s, miss, low / 2
                best_s, beyond = trial_s, trial
        return best_s, beyond

    def _attempt(self, start: Point, step_s: float, move: Move) -> Attempt:
        whole = middle = end = move(start, step_s, start.current_A)
        if self._solved(whole):
            middle = end = move(start, step_s / 2, (start.current_A + whole.current_A) / 2)
        if self._solved(middle):
            end = move(middle, step_s / 2, whole.current_A)
        if not self._solved(end):
            return Attempt(middle, end, np.inf, good=False)
        settled = self.move(self._extrapolated(whole, end), 0.0, end.current_A)
        good = self._good(middle) and self._good(settled)
        error_V = self._error_V(whole, end) if good else np.inf
        return Attempt(middle, settled, error_V, good=good)

    def _extrapolated(self, whole: Point, end: Point) -> FloatArray:
        """The state at `end`, FIRST_ORDER of second; KEPT as they were, to rounding."""
        out = end.state.copy()
        states = (self.model.states(s) for s in (out, end.state, whole.state))
        for lithium, state, halves, one in zip(self._lithium, *states, strict=True):
            self._extrapolate(lithium, state, halves, one)
        return out

    def _extrapolate(
        self, lithium: Lithium, state: FloatArray, halves: FloatArray, whole: FloatArray
    ) -> None:
        """Of one cell: `state`, a copy of `halves`, is written to."""
        layout = self.model.cell.layout
        for name in FIRST_ORDER if layout.ageing else FIRST_ORDER[:1]:
            span = layout.slice_of(name)
            state[span] = 2 * halves[span] - whole[span]
        now, kept = lithium.mol(state), lithium.mol(halves)
        nodes = dict(zip(KEPT, (layout.nodes, *layout.electrodes), strict=True))
        for name, (held, *others) in KEPT.items():
            moved = sum(kept[k] - now[k] for k in others if k in kept)
            first = layout.slice_of(name).start
            state[first : first + nodes[name]] *= (kept[held] + moved) / now[held]

    def _weights_V(self) -> FloatArray:
        """(states,) of all kinds: WEIGHT_V, 0 for what is not in it."""
        layout = self.model.cell.layout
        weights = np.zeros((len(self.kinds), layout.size))
        for name, weight in WEIGHT_V.items():
            weights[:, layout.slice_of(name)] = weight
        for own, kind in zip(weights, self.kinds, strict=True):
            salt = kind.values["electrolyte.initial_concentration_mol_m3"]
            own[layout.slice_of("salt")] /= salt
        return weights.ravel()

    def _error_V(self, whole: Point, end: Point) -> float:
        """Of the cell that is worst off: none hides behind the mean."""
        of_state = np.abs((end.state - whole.state) * self._weight_V).max()
        voltages = self.model.of_kinds(end.out - whole.out)[:, COLUMN["voltage_V"]]
        of_current = abs((end.current_A - whole.current_A) * self.slope_V_A)
        return float(max(of_state, np.abs(voltages).max(), of_current))

    def _solved(self, point: Point) -> bool:
        finite = bool(np.isfinite(point.out).all())
        return finite and bool(point.out[COLUMN["correction_V"]] <= CONVERGED_V)

    def _good(self, point: Point) -> bool:
        """Solved, within limits of salt and lithium; cut-off voltages are goals, not failures."""
        beyond = self.limits.beyond(point.out[:, None], np.array([0.0]))
        return self._solved(point) and not beyond.any()

    def _reason(self, failed: Point, last: Point) -> Status:
        return self.limits.reached(failed.out, last.out, 0.0)


class Steppers:
    """On the mesh that is asked for; if none is, on the usual one, or the finer of little salt."""

    def __init__(self, pack: Pack, mesh: Mesh | None, on: Callable[[Mesh | None], Stepper]) -> None:
        self.usual, self._on, self._cell = on(mesh), on, pack.cell
        self._little_mol_m3 = little_salt_mol_m3(pack) if mesh is None else -np.inf

    @cached_property
    def finer(self) -> Stepper:
        """For where salt runs short."""
        return self._on(fine_mesh_of(self._cell))

    def of(self, state: FloatArray) -> Stepper:
        """On the mesh of `state`."""
        return self.usual if state.size == self.usual.model.size else self.finer

    def falls_short(self, stretch: Stretch) -> bool:
        """Whether there was less salt in it than the usual mesh follows."""
        least_mol_m3 = min(p.out[COLUMN["salt_min_mol_m3"]] for p in stretch.points)
        return bool(least_mol_m3 < self._little_mol_m3)

    def on_finer(self, state: FloatArray) -> FloatArray:
        """A state of the usual mesh."""
        return carried(state, self.usual.kinds, self.usual.model, self.finer.model)

    def on_usual(self, state: FloatArray) -> FloatArray:
        """A state of either."""
        return carried(state, self.usual.kinds, self.of(state).model, self.usual.model)
