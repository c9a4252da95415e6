"""Life of a pack: a flight, a rest, a charge, a rest, again and again.

`age` yields one `Aged` a cycle, whose row is small and whose state is all that the next cycle
needs; nothing else is kept, so a life of any length takes the memory of one cycle.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.health import Examiner, Health
from twin.load import Load
from twin.pack import Pack
from twin.protocol import (
    FollowLoad,
    ProtocolError,
    ProtocolResult,
    Rest,
    Settings,
    Step,
    StepResult,
    charge_cc_cv,
    run,
)
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

EMPTY = (Status.LOWER_CUT_OFF, Status.ELECTRODE_EMPTY)
"""How a repeated flight ends: a weak cell may be empty before the pack is at its cut-off."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Regime:
    """What is done to a pack in each cycle; ProtocolError if it cannot be.

    Attributes:
        load: a flight; its surroundings are those of the whole cycle.
        repeat: the load is repeated until the pack is empty, instead of flown once: up to the lower
            cut-off, or to where an electrode of one of its cells is empty.
        rest_s: before the charge, and after it; 0 for none.
        charge_rate: of the constant current, in 1/h of the capacity when new.
        until_rate: at which the constant voltage ends, likewise.
        full_V: of the constant voltage, of a mean cell; None for its upper cut-off.
    """

    load: Load
    repeat: bool = False
    rest_s: float = 1800.0
    charge_rate: float = 1.0
    until_rate: float = 0.05
    full_V: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.rest_s < np.inf:
            raise ProtocolError(f"rest_s = {self.rest_s}: expected 0 or more")
        if not 0 < self.until_rate <= self.charge_rate < np.inf:
            raise ProtocolError(
                f"until_rate = {self.until_rate}, charge_rate = {self.charge_rate}: "
                "expected positive numbers, the first no more than the second"
            )
        if self.full_V is not None and not 0 < self.full_V < np.inf:
            raise ProtocolError(f"full_V = {self.full_V}: expected a positive number")
        if (charge_C := self.load.charge_C()) <= 0:
            raise ProtocolError(
                f"the load draws {charge_C:.3g} C, but a flight discharges the pack "
                "(discharge current is positive)"
            )

    def check(self, pack: Pack) -> None:
        """ProtocolError if a cell of that pack cannot be charged to `full_V`."""
        low, high = pack.cell.lower_cut_off_V, pack.cell.upper_cut_off_V
        if self.full_V is not None and not low <= self.full_V <= high:
            raise ProtocolError(
                f"charge to {self.full_V} V a cell: expected {low} to {high}, its cut-offs"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One cycle in numbers, of the pack.

    Attributes:
        number: from 1; 0 is the first charge, before any flight.
        status: DONE for a whole cycle, else why it ended, and with it the life under this regime.
        stopped_in: what was being done then: "flight", "rest" or "charge"; "" for a whole cycle.
        time_s: since the start of life, at the end of the cycle.
        flown_s: how long the flight, or its repetition, lasted.
        drawn_C: charge drawn in flight.
        energy_J: drawn in flight.
        end_V: voltage at the last sample in flight; NaN without one.
        min_V: least voltage in flight.
        max_K: highest temperature in the cycle.
        charged_C: charge put back.
        health: at the end of the cycle.
    """

    number: int
    status: Status
    stopped_in: str
    time_s: float
    flown_s: float
    drawn_C: float
    energy_J: float
    end_V: float
    min_V: float
    max_K: float
    charged_C: float
    health: Health


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Aged:
    """A pack after a cycle; `age(..., after=)` continues from it.

    Attributes:
        cycle: the numbers.
        state: the kernel's state of each kind of cell.
        net_charge_C: drawn from the pack since the start of life, charges subtracted.
    """

    cycle: Cycle
    state: FloatArray
    net_charge_C: float


def age(pack: Pack, regime: Regime, *, after: Aged | None = None) -> Iterator[Aged]:
    """The cycles of a life, without end unless one cannot be completed: that is then the last.

    Cycle 0 is the first charge: it brings the pack from the start it was given to where every
    flight begins, and shows it as new. The cycles after `after` are the same, to the last bit,
    whether they are reached in one call or continued from what an earlier one yielded.
    """
    examiner = Examiner(pack)
    if after is None:
        yield (after := first_charge(pack, regime, examiner))
    while after.cycle.status is Status.DONE:
        yield (after := one_cycle(pack, regime, examiner, after))


def first_charge(pack: Pack, regime: Regime, examiner: Examiner) -> Aged:
    """Cycle 0."""
    first = _Running(pack, regime, examiner.new, 0.0, 0.0)
    first.charge()
    return first.end(0, examiner)


def one_cycle(pack: Pack, regime: Regime, examiner: Examiner, after: Aged) -> Aged:
    """The cycle that follows."""
    going = _Running(pack, regime, after.state, after.cycle.time_s, after.net_charge_C)
    going.fly()
    going.rest()
    going.charge()
    return going.end(after.cycle.number + 1, examiner)


class _Running:
    """One cycle while it goes on; what follows a step that met a limit is not done."""

    def __init__(
        self, pack: Pack, regime: Regime, state: FloatArray, time_s: float, net_charge_C: float
    ) -> None:
        self._pack, self._regime = pack, regime
        self._settings = Settings(ambient_K=regime.load.ambient_K)
        self._state, self._time_s, self._net_C = state, time_s, net_charge_C
        self._current_A = 0.0
        self._status, self._stopped_in = Status.DONE, ""
        self._drawn_C = self._energy_J = self._flown_s = self._charged_C = 0.0
        self._end_V, self._min_V, self._max_K = np.nan, np.inf, -np.inf

    def fly(self) -> None:
        """The load once, or again and again until the pack is empty."""
        while self._status is Status.DONE:
            (flown,) = self._do("flight", FollowLoad(load=self._regime.load)).steps
            self._count_flight(flown)
            if not self._regime.repeat:
                return
            if flown.status in EMPTY:
                self._status, self._stopped_in = Status.DONE, ""
                return

    def rest(self) -> None:
        """No current."""
        if self._status is Status.DONE and self._regime.rest_s:
            self._do("rest", Rest(duration_s=self._regime.rest_s))

    def charge(self) -> None:
        """Constant current, constant voltage, and a rest."""
        if self._status is Status.DONE:
            regime = self._regime
            whole_V = None if regime.full_V is None else regime.full_V * self._pack.series
            steps = charge_cc_cv(
                self._pack, rate=regime.charge_rate, until_rate=regime.until_rate, voltage_V=whole_V
            )
            self._charged_C = -sum(s.charge_C for s in self._do("charge", *steps).steps)
        self.rest()

    def end(self, number: int, examiner: Examiner) -> Aged:
        """What came of it."""
        cycle = Cycle(
            number=number,
            status=self._status,
            stopped_in=self._stopped_in,
            time_s=self._time_s,
            flown_s=self._flown_s,
            drawn_C=self._drawn_C,
            energy_J=self._energy_J,
            end_V=self._end_V,
            min_V=self._min_V if np.isfinite(self._min_V) else np.nan,
            max_K=self._max_K if np.isfinite(self._max_K) else np.nan,
            charged_C=self._charged_C,
            health=examiner.examine(self._state, self._net_C),
        )
        return Aged(cycle=cycle, state=self._state, net_charge_C=self._net_C)

    def _do(self, what: str, *steps: Step) -> ProtocolResult:
        result = run(
            self._pack,
            steps,
            settings=self._settings,
            state=self._state,
            current_A=self._current_A,
        )
        self._state = result.end_state
        last_A = result.steps[-1].current_A
        self._current_A = float(last_A[-1]) if last_A.size else self._current_A
        self._time_s += result.steps[-1].stopped_s
        self._net_C += sum(s.charge_C for s in result.steps)
        warmest = [s.temperature_K.max() for s in result.steps if s.temperature_K.size]
        self._max_K = max([self._max_K, *map(float, warmest)])
        if result.status is not Status.DONE:
            self._status, self._stopped_in = result.status, what
        return result

    def _count_flight(self, flown: StepResult) -> None:
        self._flown_s += flown.stopped_s
        self._drawn_C += flown.charge_C
        self._energy_J += flown.energy_J
        if flown.time_s.size:
            self._end_V = float(flown.voltage_V[-1])
            self._min_V = min(self._min_V, float(flown.voltage_V.min()))
