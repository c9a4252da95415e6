"""Random parameters, random flights: `python -m benchmarks.fuzz [RUNS] [SEED]`.

RUNS flights (2000 unless told) with the seeds SEED, SEED + 1, ... (from 0), and a tenth as many
protocols with the same seeds; see `fuzz_cases`. Prints how they ended, the worst errors of the
lithium audit and of the charge, the slowest run, and every fault with the seed that replays it.
Exit 1 if there is a fault; what did not converge is listed, not a fault.
"""

import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchmarks.fuzz_cases import Cycling, Flight, cycling, flight
from twin.kernel import Backend
from twin.kinetics import SALT_FLOOR_mol_m3
from twin.limits import DEPLETED
from twin.protocol import FollowLoad, ProtocolResult, run
from twin.simulate import Run, solution_of
from twin.solution import Solution, Status
from twin.step import StepModel

FloatArray = npt.NDArray[np.float64]

LIMIT_S = 60.0  # a run that takes longer hangs
AGAIN_S = 1.0  # after which it is told so again
WRONG = 1e-9  # relative error of lithium or charge that is a fault
LITTLE = 1e-9  # below 0 (or above 1) by no more than this is rounding
BOUNDED = {"left_n": 1.0, "left_p": 1.0, "trapped_n": 1.0, "trapped_p": 1.0, "porosity": 1.0}
LEAST = {"salt": -DEPLETED * SALT_FLOOR_mol_m3}  # where there is none (`kinetics.log_salt`)
NOT_NEGATIVE = ("salt", "film", "crack_film", "plated", "dead", "crack_m", *BOUNDED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How one case ended.

    Attributes:
        seed: that makes the case.
        status: of the solution; None if there is none.
        audit: relative error of the lithium.
        charge: error of the charge over the cell's capacity and what went through it.
        seconds: it took.
        faults: what must not be.
    """

    seed: int
    status: Status | None = None
    audit: float = 0.0
    charge: float = 0.0
    seconds: float = 0.0
    faults: tuple[str, ...] = ()


def fly(case: Flight) -> Outcome:
    """Simulate and judge."""
    pack, load = case.pack, case.load
    one = Run(pack, load, None, Backend.AUTO, None)
    one.change(case.numbers)
    one.run()
    got = solution_of(one, pack, load)
    faults = list(_not_finite(got, ("voltage_V", "temperature_K", "soc", "heat_W", "end_state")))
    faults += _impossible(one.model.cell, got.end_state)
    through_C = float(
        np.dot(np.diff(load.time_s), np.abs(load.current_A[1:]) + np.abs(load.current_A[:-1]))
    )
    done = got.status is Status.DONE
    missing_C = got.charge_C - load.charge_C() if done else 0.0
    if done and got.time_s.size != load.time_s.size:
        faults.append(f"done with {got.time_s.size} of {load.time_s.size} samples")
    if not load.time_s[0] <= got.stopped_s <= load.time_s[-1] + 1e-6:
        faults.append(f"stopped at {got.stopped_s} s, outside the load")
    errors = missing_C / pack.parallel, got.audit.charge_error_C
    return _judged(case, got, errors, through_C, faults)


def cycle(case: Cycling) -> Outcome:
    """Run the protocol and judge."""
    got = run(case.pack, case.steps, settings=case.settings)
    faults = list(_not_finite(got, ("end_state",)))
    through_C = 0.0
    for k, step in enumerate(got.steps):
        names = ("voltage_V", "temperature_K", "soc", "current_A", "stopped_s", "charge_C")
        faults += [f"step {k}: {f}" for f in _not_finite(step, names)]
        through_C += abs(step.charge_C)
        if np.any(np.diff(step.time_s) < 0):
            faults.append(f"step {k}: time runs back")
        if not isinstance(step.step, FollowLoad) and step.time_s.size > 1:
            own_C = float(np.trapezoid(step.current_A, step.time_s))
            if abs(own_C - step.charge_C) > WRONG * (abs(own_C) + 1):
                faults.append(f"step {k}: charge {step.charge_C} C, of its current {own_C} C")
    errors = (got.audit.charge_error_C,)
    return _judged(case, got, errors, through_C, faults)


def _judged(
    case: Flight | Cycling,
    got: Solution | ProtocolResult,
    errors_C: tuple[float, ...],
    through_C: float,
    faults: list[str],
) -> Outcome:
    """With the errors of lithium and charge; `through_C` went through the pack, in and out."""
    pack, lithium = case.pack, abs(got.audit.relative_error)
    capacity_C = pack.rated_C / pack.parallel
    charge = max(map(abs, errors_C)) / (capacity_C + through_C / pack.parallel)
    for name, error in (("lithium", lithium), ("charge", charge)):
        if not error <= WRONG:
            faults.append(f"{name} wrong by {error:.1e}")
    return Outcome(
        seed=case.seed, status=got.status, audit=lithium, charge=charge, faults=tuple(faults)
    )


def _not_finite(owner: object, names: tuple[str, ...]) -> Iterator[str]:
    for name in names:
        if not np.all(np.isfinite(getattr(owner, name))):
            yield f"{name} is not finite"


def _impossible(model: StepModel, state: FloatArray) -> Iterator[str]:
    """Amounts below nothing, shares above one."""
    layout = model.layout
    names = [name for name in NOT_NEGATIVE if name in layout.sizes()]
    for name in names:
        values = state[layout.slice_of(name)]
        if (
            values.min() < LEAST.get(name, -LITTLE)
            or values.max() > BOUNDED.get(name, np.inf) + LITTLE
        ):
            yield f"{name} from {values.min():.3g} to {values.max():.3g}"


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """TimeoutError if the body takes longer; again every AGAIN_S, should a callback swallow it."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"not done after {seconds:.0f} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds, AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def outcome(kind: str, seed: int) -> Outcome:
    """Of the `flight` or `protocol` of `seed`; whatever it raises is a fault."""
    judge: Callable[[], Outcome] = (
        (lambda: fly(flight(seed))) if kind == "flight" else (lambda: cycle(cycling(seed)))
    )
    start = time.perf_counter()
    try:
        with time_limit(LIMIT_S), warnings.catch_warnings():
            warnings.simplefilter("error")
            got = judge()
    except Exception as e:  # a fuzz goes on and says what it met
        got = Outcome(seed=seed, faults=(f"{type(e).__name__}: {e}",))
    seconds = time.perf_counter() - start
    return replace(got, seconds=seconds)


def table(kind: str, outcomes: list[Outcome]) -> str:
    """What is told of them."""
    count = Counter(o.status.name if o.status else "NO SOLUTION" for o in outcomes)
    slowest = max(outcomes, key=lambda o: o.seconds)
    lines = [f"{len(outcomes)} of {kind}, {sum(o.seconds for o in outcomes):.0f} s"]
    lines += [f"  {name}: {n}" for name, n in count.most_common()]
    for name in ("audit", "charge"):
        worst = max(outcomes, key=lambda o: getattr(o, name))
        lines.append(f"  worst {name} error {getattr(worst, name):.1e} (seed {worst.seed})")
    lines.append(f"  slowest {slowest.seconds:.1f} s (seed {slowest.seed})")
    stuck = [str(o.seed) for o in outcomes if o.status is Status.NOT_CONVERGED]
    lines.append(f"  not converged, by seed: {', '.join(stuck) or 'none'}")
    lines += [f"  FAULT seed {o.seed}: {f}" for o in outcomes for f in o.faults]
    return "\n".join(lines)


def main(runs: int, seed: int) -> int:
    """Print the tables; the number of faults."""
    faults = 0
    for kind, number in (("flight", runs), ("protocol", runs // 10)):
        if number:
            outcomes = [outcome(kind, s) for s in range(seed, seed + number)]
            print(table(kind, outcomes), flush=True)
            faults += sum(bool(o.faults) for o in outcomes)
    return faults


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(given + [2000, 0][len(given) :])) > 0)
