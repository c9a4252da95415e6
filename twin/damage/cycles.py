"""A waveform flown from full to the cut-off, recharged, again and again: damage per flight."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.ageing import EMPTY
from twin.damage.loss import NOTHING, Ledger, Loss
from twin.damage.waveform import Waveform
from twin.effects import ColdPack
from twin.health import Examiner
from twin.load import Load
from twin.pack import Pack
from twin.protocol import FollowLoad, Rest, Settings, Step, StepResult, charge_cc_cv, run
from twin.simulate import flowed
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

MORE_THAN_ALL = 1.5  # of the capacity: the cut-off comes before
LONGEST_s = 86400.0  # of a flight: what draws less has not been measured, or is not one


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """What is done with the pack; the same for every waveform.

    Attributes:
        ambient_K: around it; the pack starts at that temperature.
        cycles: that count.
        formed: cycles before them, which do not: the film on fresh cracks grows a hundredfold.
        charge_rate: of the constant current, in 1/h of the capacity.
        until_rate: at which the constant voltage ends, likewise.
        rest_s: before the charge, and after it.
        tolerance_V: of the charge's steps; from those with 0.2 mV the losses differ by 0.25 %, the
            same for every waveform: ratios by 0.1 %.
    """

    ambient_K: float = 298.15
    cycles: int = 8
    formed: int = 1
    charge_rate: float = 1.0
    until_rate: float = 0.05
    rest_s: float = 0.0
    tolerance_V: float = 5e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class Extremes:
    """Over the counted cycles.

    Attributes:
        max_K: highest temperature.
        anode_V: least potential of the negative electrode against lithium, which plates below 0.
        negative_stress_Pa: (least, greatest) hydrostatic stress in it, tension positive.
        positive_stress_Pa: likewise.
    """

    max_K: float
    anode_V: float
    negative_stress_Pa: tuple[float, float]
    positive_stress_Pa: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cycled:
    """A waveform's damage, mean of the counted flights.

    Attributes:
        waveform: what was flown.
        flown_s: from full to the cut-off.
        drawn_C: on the way.
        energy_J: on the way.
        whole: lost by a flight and the charge after it.
        in_flight: the part of it that was lost in flight.
        capacity_C: of the pack, that a flight and its charge cost.
        flight: extremes in flight.
        charge: extremes in the charge.
        end_state: of the kernel, after the last charge.
    """

    waveform: Waveform
    flown_s: float
    drawn_C: float
    energy_J: float
    whole: Loss
    in_flight: Loss
    capacity_C: float
    flight: Extremes
    charge: Extremes
    end_state: FloatArray


class CannotCycle(RuntimeError):
    """The pack cannot fly the waveform, be charged after it, or be brought to where it begins.

    The text says why.
    """


def cycle(
    pack: Pack, waveform: Waveform, protocol: Protocol, state: FloatArray | None = None
) -> Cycled:
    """Fly `waveform` from full to the cut-off and recharge, as `protocol` says.

    From `state`, charged, of the kernel; None: from a new pack.

    Raises:
        CannotCycle: the cut-off comes before one period is over or not within a day, or the charge
            fails.
    """
    resting = (
        replace(e, start_offset_K=e.ambient_offset_K) if isinstance(e, ColdPack) else e
        for e in pack.effects
    )
    rested = replace(pack, initial_K=protocol.ambient_K, effects=tuple(resting))
    return _Cycling(rested.charged(), waveform, protocol, state).all()


def from_full(pack: Pack, waveform: Waveform, ambient_K: float) -> Load:
    """`waveform`, repeated for longer than a full pack lasts, by the current that flows.

    That is what `pack` has of a current that was recorded (gain, offset, leakage).

    Raises:
        CannotCycle: no pack would be empty in LONGEST_s.
    """
    once = waveform.load(waveform.mean_A * waveform.period_s, ambient_K)
    share = flowed(pack, once).charge_C() / once.charge_C()
    recorded_C = MORE_THAN_ALL * pack.rated_C / share if share > 0 else np.inf
    if recorded_C > LONGEST_s * waveform.mean_A:
        raise CannotCycle(
            f"at a mean of {share * waveform.mean_A:.3g} A, {pack.rated_C / 3600:.3g} Ah are not "
            f"drawn in a day"
        )
    return waveform.load(recorded_C, ambient_K)


class _Cycling:
    """One waveform while it is cycled."""

    def __init__(
        self, pack: Pack, waveform: Waveform, protocol: Protocol, state: FloatArray | None
    ) -> None:
        self._pack, self._waveform, self._protocol = pack, waveform, protocol
        self._settings = Settings(ambient_K=protocol.ambient_K, tolerance_V=protocol.tolerance_V)
        self._ledger, self._examiner = Ledger(pack), Examiner(pack)
        self._load = from_full(pack, waveform, protocol.ambient_K)
        self._state, self._net_C = self._ledger.new if state is None else state, 0.0

    def all(self) -> Cycled:
        for _ in range(self._protocol.formed):
            self._charge(self._fly())
        first, capacity_C = self._ledger.loss(self._state), self._capacity_C()
        in_flight = NOTHING
        flights: list[StepResult] = []
        charges: list[StepResult] = []
        for _ in range(self._protocol.cycles):
            before = self._ledger.loss(self._state)
            flights.append(flown := self._fly())
            in_flight += self._ledger.loss(self._state) - before
            charges += self._charge(flown)
        each = 1 / self._protocol.cycles
        return Cycled(
            waveform=self._waveform,
            flown_s=each * sum(f.stopped_s for f in flights),
            drawn_C=each * sum(f.charge_C for f in flights),
            energy_J=each * sum(f.energy_J for f in flights),
            whole=(self._ledger.loss(self._state) - first) * each,
            in_flight=in_flight * each,
            capacity_C=each * (capacity_C - self._capacity_C()),
            flight=_extremes(flights),
            charge=_extremes(charges),
            end_state=self._state,
        )

    def _fly(self) -> StepResult:
        (flown,) = self._do(FollowLoad(load=self._load))
        if flown.status not in EMPTY or flown.stopped_s < self._waveform.period_s:
            raise CannotCycle(
                f"the pack flies this for {flown.stopped_s:.1f} s only: {flown.status.value}"
            )
        return flown

    def _charge(self, flown: StepResult) -> tuple[StepResult, ...]:
        p = self._protocol
        rest = (Rest(duration_s=p.rest_s),) if p.rest_s else ()
        steps = (
            *rest, *charge_cc_cv(self._pack, rate=p.charge_rate, until_rate=p.until_rate), *rest,
        )  # fmt: skip
        done = self._do(*steps, current_A=float(flown.current_A[-1]))
        if (status := done[-1].status) is not Status.DONE:
            raise CannotCycle(f"the pack cannot be charged after it: {status.value}")
        return done

    def _do(self, *steps: Step, current_A: float = 0.0) -> tuple[StepResult, ...]:
        result = run(
            self._pack, steps, settings=self._settings, state=self._state, current_A=current_A
        )
        self._state = result.end_state
        self._net_C += sum(s.charge_C for s in result.steps)
        return result.steps

    def _capacity_C(self) -> float:
        return self._examiner.examine(self._state, self._net_C).capacity_C


def _extremes(steps: list[StepResult]) -> Extremes:
    def ends(name: str) -> tuple[float, float]:
        both = [getattr(s.inside, name) for s in steps]
        return min(float(b[0].min()) for b in both), max(float(b[1].max()) for b in both)

    return Extremes(
        max_K=max(float(s.temperature_K.max()) for s in steps),
        anode_V=min(float(s.inside.anode_V.min()) for s in steps),
        negative_stress_Pa=ends("negative_stress_Pa"),
        positive_stress_Pa=ends("positive_stress_Pa"),
    )
