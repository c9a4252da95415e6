"""Protocols: discharge, charge, hold and rest, one after the other, as a cycler runs them.

The whole state of the cells goes from step to step. Currents and voltages are the pack's, discharge
positive. A recorded load takes one implicit step a sample (`simulate`); all else takes steps whose
length is chosen by their error (`adaptive`), events located.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.adaptive import EVENT_V, Move, Point, Stepper, Steppers, Stretch
from twin.inside import inside
from twin.kernel import Backend
from twin.limits import COLUMN, LOWER_TOLERANCE_V, UPPER_TOLERANCE_V
from twin.load import Load
from twin.mesh import Mesh
from twin.pack import Pack
from twin.pack_model import of_places
from twin.simulate import flowed, simulate
from twin.solution import Inside, LithiumAudit, SimulationStopped, Status

FloatArray = npt.NDArray[np.float64]

TOLERANCE_V = 2e-4
DAY_S = 86400.0
EVENT_SHARE = 1e-4  # the current that ends a hold is located to this share of it


class ProtocolError(ValueError):
    """A step that cannot be; the text says which number and what it may be."""


def _positive(name: str, value: float) -> None:
    if not value > 0:
        raise ProtocolError(f"{name} = {value}: expected a positive number")


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowLoad:
    """A load as recorded, its current and its surroundings."""

    load: Load


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantCurrent:
    """A current until a voltage or for a duration, whichever is first; at least one is given.

    Attributes:
        current_A: of the pack, discharge positive, not 0.
        until_V: of the pack. None: the cut-off voltage ends it too, but as a limit.
        duration_s: at most.
    """

    current_A: float
    until_V: float | None = None
    duration_s: float = np.inf

    def __post_init__(self) -> None:
        if not np.isfinite(self.current_A) or self.current_A == 0:
            raise ProtocolError(f"current_A = {self.current_A}: expected a current; 0 is a Rest")
        if self.until_V is not None:
            _positive("until_V", self.until_V)
        if self.until_V is None and not np.isfinite(self.duration_s):
            raise ProtocolError("a constant current needs until_V or duration_s")
        _positive("duration_s", self.duration_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantVoltage:
    """A voltage until the current, of either sign, is no more than `until_A`.

    Attributes:
        voltage_V: of the pack, within its cut-offs.
        until_A: of the pack.
        duration_s: at most.
    """

    voltage_V: float
    until_A: float
    duration_s: float = DAY_S

    def __post_init__(self) -> None:
        for name in ("voltage_V", "until_A", "duration_s"):
            _positive(name, getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class Rest:
    """No current."""

    duration_s: float

    def __post_init__(self) -> None:
        _positive("duration_s", self.duration_s)
        if not np.isfinite(self.duration_s):
            raise ProtocolError(f"duration_s = {self.duration_s}: expected an end")


Step = FollowLoad | ConstantCurrent | ConstantVoltage | Rest


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How a protocol is run.

    Attributes:
        ambient_K: around the pack, but in a FollowLoad, which has its own.
        tolerance_V: error of an adaptive step, as a voltage of one cell.
        mesh: of the cells.
        backend: what runs the kernel.
    """

    ambient_K: float = 298.15
    tolerance_V: float = TOLERANCE_V
    mesh: Mesh | None = None
    backend: Backend = Backend.AUTO

    def __post_init__(self) -> None:
        _positive("ambient_K", self.ambient_K)
        _positive("tolerance_V", self.tolerance_V)


AS_USUAL = Settings()


def charge_cc_cv(
    pack: Pack, *, rate: float = 1.0, voltage_V: float | None = None, until_rate: float = 0.05
) -> tuple[ConstantCurrent, ConstantVoltage]:
    """Charge at `rate`, then hold `voltage_V` down to `until_rate` (both in 1/h of the capacity).

    None takes the upper cut-off of the cells.
    """
    whole_A = pack.rated_C / 3600
    full_V = voltage_V or pack.cell.upper_cut_off_V * pack.series
    return (
        ConstantCurrent(current_A=-rate * whole_A, until_V=full_V),
        ConstantVoltage(voltage_V=full_V, until_A=until_rate * whole_A),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepResult:
    """What one step of a protocol was answered with.

    Attributes:
        step: the step.
        time_s: (n,) since the start of the protocol; (0,) if the step failed at once.
        current_A: (n,) of the pack, what flows, straight between the times of an adaptive step.
        voltage_V: (n,) of the pack, whatever a sensor makes of it.
        temperature_K: (n,) mean over the cells.
        soc: (n,) state of charge from the negative electrode's mean stoichiometry, mean likewise.
        charge_C: drawn from the pack, exact: negative for a charge.
        energy_J: likewise, by the trapezoidal rule over the steps that were taken.
        stopped_s: when the step ended, since the start of the protocol.
        end_state: the kernel's state there, on the finer mesh if salt had run short and more steps
            followed.
        cell_voltage_V: (series, n) of each cell; read-only where all are equal.
        inside: at the same times.
        status: DONE if it ended as it says, else the limit that ended it.
        steps: kernel steps.
    """

    step: Step
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    temperature_K: FloatArray
    soc: FloatArray
    charge_C: float
    energy_J: float
    stopped_s: float
    end_state: FloatArray
    cell_voltage_V: FloatArray
    inside: Inside
    status: Status
    steps: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProtocolResult:
    """The steps up to where the protocol ended, and the lithium over all of them.

    Attributes:
        steps: one for each step begun.
        audit: from the start of the first step to the end of the last.
        status: that of the last step.
        start_state: the kernel's state before the first step.
    """

    steps: tuple[StepResult, ...]
    audit: LithiumAudit
    status: Status
    start_state: FloatArray

    @property
    def end_state(self) -> FloatArray:
        """Where it ended; `run(..., state=)` continues from it."""
        return self.steps[-1].end_state if self.steps else self.start_state

    def require(self) -> "ProtocolResult":
        """This result if every step was done, else SimulationStopped with the reason."""
        if self.status is not Status.DONE:
            last = self.steps[-1]
            raise SimulationStopped(
                f"step {len(self.steps)} stopped at {last.stopped_s:.1f} s: {self.status.value}"
            )
        return self


def run(
    pack: Pack,
    steps: tuple[Step, ...],
    *,
    settings: Settings = AS_USUAL,
    state: FloatArray | None = None,
    current_A: float = 0.0,
) -> ProtocolResult:
    """`steps` one after the other; the first that meets a limit is the last.

    Args:
        pack: which cells.
        steps: what is done with them.
        settings: surroundings and numerics.
        state: where another protocol, or solution, of this pack on this mesh ended; None starts as
            the pack says.
        current_A: of the pack, at `state`: a change from it is made in smaller ones where the whole
            one cannot be solved.

    Raises:
        ProtocolError: a voltage to be held beyond the cut-offs of the cells.
    """
    ambient_K, tolerance_V = settings.ambient_K, settings.tolerance_V

    def on(mesh: Mesh | None) -> Stepper:
        return Stepper(pack, ambient_K, tolerance_V, mesh, settings.backend)

    steppers = Steppers(pack, settings.mesh, on)
    usual, kinds = steppers.usual.model, steppers.usual.kinds
    start = usual.initial_state(kinds) if state is None else state
    done: list[StepResult] = []
    now = _Now(0.0, start, current_A / pack.parallel)
    for step in steps:
        if isinstance(step, FollowLoad):
            done.append(_follow(pack, step, now, settings))
        else:
            done.append(_adapt(pack, step, now, steppers))
        if (last := done[-1]).status is not Status.DONE:
            break
        now = _Now(last.stopped_s, last.end_state, float(last.current_A[-1]) / pack.parallel)
    start = steppers.on_usual(start)
    if done:
        done[-1] = replace(done[-1], end_state=steppers.on_usual(done[-1].end_state))
    charge_C = sum(s.charge_C for s in done) / pack.parallel
    return ProtocolResult(
        steps=tuple(done),
        audit=usual.lithium(kinds, (start, done[-1].end_state if done else start), charge_C),
        status=done[-1].status if done else Status.DONE,
        start_state=start,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Now:
    """Where a protocol stands: its time, the state, and a cell's current as far as known."""

    time_s: float
    state: FloatArray
    current_A: float


def _follow(pack: Pack, step: FollowLoad, now: _Now, settings: Settings) -> StepResult:
    solution = simulate(
        pack, step.load, mesh=settings.mesh, backend=settings.backend, state=now.state
    )
    shift_s = now.time_s - float(step.load.time_s[0])
    return StepResult(
        step=step,
        time_s=solution.time_s + shift_s,
        current_A=flowed(pack, step.load).current_A[: solution.time_s.size],
        voltage_V=solution.voltage_V * (pack.series / pack.terminals),
        temperature_K=solution.temperature_K,
        soc=solution.soc,
        charge_C=solution.charge_C,
        energy_J=solution.energy_J,
        stopped_s=solution.stopped_s + shift_s,
        end_state=solution.end_state,
        cell_voltage_V=solution.cell_voltage_V,
        inside=solution.inside,
        status=solution.status,
        steps=solution.steps,
    )


def _adapt(
    pack: Pack,
    step: ConstantCurrent | ConstantVoltage | Rest,
    now: _Now,
    steppers: Steppers,
) -> StepResult:
    stepper = steppers.of(now.state)
    before = stepper.steps
    stretch, status = _stretch(pack, step, now, stepper)
    if stepper is steppers.usual and steppers.falls_short(stretch):
        stepper, now = steppers.finer, replace(now, state=steppers.on_finer(now.state))
        before = stepper.steps
        stretch, status = _stretch(pack, step, now, stepper)
    failed_at_once = len(stretch.points) == 1 and stretch.status is not Status.DONE
    points = [] if failed_at_once else stretch.points
    out = np.array([p.out for p in points]).reshape(len(points), stepper.model.outputs).T
    time_s = now.time_s + np.concatenate([[0.0], np.cumsum(stretch.length_s)])
    current_A = np.array([p.current_A for p in points]) * pack.parallel
    voltage_V = out[COLUMN["voltage_V"]] * pack.series
    return StepResult(
        step=step,
        time_s=time_s[: len(points)],
        current_A=current_A,
        voltage_V=voltage_V,
        temperature_K=out[COLUMN["temperature_K"]],
        soc=stepper.kinds[0].soc(out[COLUMN["negative_mean"]]),
        charge_C=stretch.charge_C() * pack.parallel,
        energy_J=float(np.trapezoid(voltage_V * current_A, time_s[: len(points)])),
        stopped_s=float(time_s[-1]),
        end_state=points[-1].state if points else now.state,
        cell_voltage_V=of_places(pack, stepper.model.of_kinds(out)[:, COLUMN["voltage_V"]]),
        inside=inside(pack, out),
        status=status,
        steps=stepper.steps - before,
    )


def _stretch(
    pack: Pack, step: ConstantCurrent | ConstantVoltage | Rest, now: _Now, stepper: Stepper
) -> tuple[Stretch, Status]:
    if isinstance(step, ConstantCurrent):
        return _constant_current(pack, step, now, stepper)
    if isinstance(step, ConstantVoltage):
        return _constant_voltage(pack, step, now, stepper)
    start = stepper.jump(now.state, now.current_A, 0.0)
    stretch = stepper.go(start, step.duration_s, _current(stepper), never)
    return stretch, stretch.status


def never(_: Point) -> float:
    """The goal of a step that only its duration ends."""
    return -np.inf


def _current(stepper: Stepper) -> Move:
    """Go on with the current there is."""
    return lambda point, step_s, _: stepper.move(point.state, step_s, point.current_A)


def _constant_current(
    pack: Pack, step: ConstantCurrent, now: _Now, stepper: Stepper
) -> tuple[Stretch, Status]:
    sign = 1.0 if step.current_A > 0 else -1.0
    bounds = [
        (stepper.limits.lower_V - LOWER_TOLERANCE_V, Status.LOWER_CUT_OFF)
        if sign > 0
        else (stepper.limits.upper_V + UPPER_TOLERANCE_V, Status.UPPER_CUT_OFF)
    ]
    if step.until_V is not None:
        bounds.append((step.until_V / pack.series, Status.DONE))
    bound_V, reason = max(bounds, key=lambda bound: sign * bound[0])

    def passed_V(point: Point) -> float:
        return sign * (bound_V - point.voltage_V)

    start = stepper.jump(now.state, now.current_A, step.current_A / pack.parallel)
    stretch = stepper.go(start, step.duration_s, _current(stepper), passed_V)
    return stretch, reason if stretch.came else stretch.status


def _constant_voltage(
    pack: Pack, step: ConstantVoltage, now: _Now, stepper: Stepper
) -> tuple[Stretch, Status]:
    voltage_V, until_A = step.voltage_V / pack.series, step.until_A / pack.parallel
    low, high = stepper.limits.lower_V, stepper.limits.upper_V
    if min(voltage_V - low, high - voltage_V) < -1e-9:  # V: by more than rounding
        raise ProtocolError(f"voltage_V = {voltage_V:g} of a cell: expected {low:g} to {high:g}")

    def move(point: Point, step_s: float, about_A: float) -> Point:
        return stepper.hold(point, step_s, about_A, voltage_V)

    def passed_V(point: Point) -> float:
        return (1 - abs(point.current_A) / until_A) * EVENT_V / EVENT_SHARE

    before = stepper.jump(now.state, now.current_A, now.current_A)
    start = stepper.hold(before, 0.0, now.current_A, voltage_V)
    stretch = stepper.go(start, step.duration_s, move, passed_V)
    return stretch, stretch.status
