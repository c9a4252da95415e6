"""Samples of a test by what they tell, not by the clock.

A test is cut into phases of constant current. In each, samples are kept close together after the
change of the current and ever further apart later, or where the voltage moves; each kept sample
carries the mean of those around it. So 10 h at 0.1C become some hundred samples, 10 s of a pulse
some twenty, each with the noise that is left in it: neither drowns the other.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.calibrate.phases import phases, steady_A
from twin.calibrate.reference import ReferenceTest
from twin.load import Between, Load

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

GROWTH = 0.15  # distance of kept samples over the time since the current changed
CHARGE_SHARE = 2e-3  # of the capacity: most between kept samples
LONGEST_S = 60.0  # at rest too
APART_V = 0.01  # most between kept samples: what is bent between them stays below 0.5 mV
FIRST_STEP_S, STEP_GROWTH = 0.25, 0.3  # of the simulation, after a change of the current
FLOOR_V = 1e-3
"""What the model may miss in each kept sample, beside noise: without it a mean over a minute would
outweigh all else."""
LEAST_NOISE_V = 1e-4
READ_K = 1.0
"""By what a surface is not as warm as the cell is on the whole, and a lump of heat not the cell."""
START_SAMPLES = 5  # of a rest: their mean is the voltage at the start
STEEP = 0.3
"""Of the charge, that a model may miss where it may miss a volt: 0.15 % beside 5 mV.

Where a voltage dives, a charge that is off by little is much voltage, and both count: the
"effective variance" of J. Orear, Am. J. Phys. 50, 912 (1982). Else the knee of a discharge
outweighs all before it."""
SEEN_OVER = 5e-3  # of the capacity: over so much it is seen how fast a voltage falls
RESTED_V = 5e-3  # how well the first samples of a rest tell the open-circuit voltage
LOADED_V = 0.1  # about what a cell loses at once at 1C: as much is unknown where a test starts so


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sampled:
    """A test as it is simulated and compared.

    Attributes:
        name: of the test.
        load: of one cell; its samples are the steps of the simulation.
        at: (m,) samples of the load that are compared.
        voltage_V: (m,) measured there.
        count: (m,) samples whose mean that is.
        sigma_V: (m,) standard deviation of what is measured minus simulated, as expected.
        drawn_C: (m,) charge drawn since the start.
        noise_V: of one sample of the test.
        start_V: about the open-circuit voltage at the start,
        start_sigma_V: and how well that is known.
        temperature_K: (m,) measured on the cell there, NaN where it was not; None if nowhere.
        sigma_K: standard deviation of that minus simulated, as expected.
        mount: of the test.
        missed_V: (m,) what coarse steps and mesh miss there, added to what is simulated.
        model_V: what the model may miss in each sample, beside noise and FLOOR_V; in `sigma_V`.
        shape: (m,) what the model may miss there over `model_V`: more where the voltage dives.
    """

    name: str
    load: Load
    at: IntArray
    voltage_V: FloatArray
    count: FloatArray
    sigma_V: FloatArray
    drawn_C: FloatArray
    noise_V: float
    start_V: float
    start_sigma_V: float
    temperature_K: FloatArray | None = None
    sigma_K: float = READ_K
    mount: str = ""
    missed_V: FloatArray | float = 0.0
    model_V: float = 0.0
    shape: FloatArray | float = 1.0

    @property
    def rested(self) -> bool:
        """Whether it starts at rest, so that its voltage tells the state."""
        return self.start_sigma_V <= RESTED_V

    def shape_at(self, time_s: FloatArray) -> FloatArray:
        """(n,) `shape` at other times (n,) of the test."""
        own = np.broadcast_to(self.shape, self.at.size)
        return np.asarray(np.interp(time_s, self.load.time_s[self.at], own), dtype=float)

    def as_expected(self) -> "Sampled":
        """The same before anything was fitted to it."""
        sigma_V = np.hypot(expected_V(self.noise_V, self.count), self.model_V * self.shape)
        return replace(self, sigma_V=sigma_V, missed_V=0.0)

    def of_a_model(self, missed_V: float, alike: float) -> "Sampled":
        """Expected to be missed by `missed_V`, in so many stretches of samples that err alike.

        Its temperatures by READ_K, in as many.
        """
        share = float(np.sqrt(max(1.0, self.at.size / alike)))
        return replace(self, model_V=missed_V * share, sigma_K=READ_K * share).as_expected()


def sampled(test: ReferenceTest, capacity_C: float) -> Sampled:
    """`test` of a cell of about `capacity_C` with few samples that tell as much."""
    noise_V = max(noise_of(test), LEAST_NOISE_V)
    held = test.between is Between.HOLD
    cuts = cuts_of(test)
    bounds = [*cuts.tolist(), test.time_s.size - 1]
    drawn_C = test.drawn_C()
    nodes: list[IntArray] = []
    times: list[FloatArray] = []
    currents: list[FloatArray] = []
    for a, b in pairwise(bounds):
        if held:
            mean_A = (drawn_C[b] - drawn_C[a]) / (test.time_s[b] - test.time_s[a])
            kept = kept_samples(test, a, b, capacity_C, mean_A)
            fine_s = with_steps(test.time_s[kept], test.time_s[b])
            nodes.append(kept)
            times.append(fine_s)
            currents.append(np.full(fine_s.size, mean_A))
        else:
            nodes.append(np.arange(a, b))
            times.append(test.time_s[a:b])
            currents.append(test.current_A[a:b])
    last = bounds[-1]
    time_s = np.append(np.concatenate(times), test.time_s[last])
    current_A = np.append(np.concatenate(currents), test.current_A[last])
    index = np.append(np.concatenate(nodes), last)
    voltage_V, count = local_means(test, index, cuts)
    told = ~test.mixed()[index]
    starts = np.searchsorted(index, cuts)
    steep = dive(voltage_V, drawn_C[index] / capacity_C, starts) if held else np.zeros(index.size)
    start_V, start_sigma_V = _start(test, capacity_C)
    return Sampled(
        name=test.name,
        load=Load(
            time_s=time_s, current_A=current_A, between=test.between, ambient_K=test.ambient_K,
            longest_step_s=LONGEST_S if held else 1.0,
        ),
        at=np.searchsorted(time_s, test.time_s[index[told]]),
        voltage_V=voltage_V[told],
        count=count[told],
        sigma_V=expected_V(noise_V, count[told]),
        drawn_C=drawn_C[index[told]],
        noise_V=noise_V,
        start_V=start_V,
        start_sigma_V=start_sigma_V,
        temperature_K=None if test.temperature_K is None else test.temperature_K[index[told]],
        mount=test.mount,
        shape=np.hypot(1.0, STEEP * steep[told]),
    )  # fmt: skip


def dive(voltage_V: FloatArray, drawn: FloatArray, starts: IntArray) -> FloatArray:
    """(m,) by how much faster the voltage falls than it did before in its phase [V per charge].

    `drawn` (m,) in capacities; phases begin at `starts`. What follows a change of the current at
    once is no dive: there a voltage falls ever more slowly.
    """
    out = np.zeros(voltage_V.size)
    for a, b in pairwise([*starts.tolist(), voltage_V.size]):
        moved, v = np.maximum.accumulate(np.abs(drawn[a:b] - drawn[a])), voltage_V[a:b]
        if moved[-1] < SEEN_OVER:
            continue
        first = np.searchsorted(moved, moved - SEEN_OVER / 2, side="right") - 1
        last = np.searchsorted(moved, moved + SEEN_OVER / 2)
        first, last = np.maximum(first, 0), np.minimum(last, b - a - 1)
        falls = np.abs(v[last] - v[first]) / (moved[last] - moved[first])
        out[a:b] = falls - np.minimum.accumulate(falls)
    return out


def cuts_of(test: ReferenceTest) -> IntArray:
    """First sample of each stretch of constant current; of a current that runs, the first alone."""
    if test.between is not Between.HOLD:
        return np.array([0])
    return phases(test.current_A, test.voltage_V, felt_V=FLOOR_V)


def expected_V(noise_V: float, count: FloatArray) -> FloatArray:
    """(m,) standard deviation of measured minus simulated, of means of `count` (m,) samples."""
    return np.asarray(np.sqrt(noise_V**2 / count + FLOOR_V**2))


def kept_samples(
    test: ReferenceTest, first: int, stop: int, capacity_C: float, mean_A: float
) -> IntArray:
    """Those of the phase [first, stop) that tell something new."""
    time_s, voltage_V = test.time_s, test.voltage_V
    most_s = min(LONGEST_S, CHARGE_SHARE * capacity_C / max(abs(mean_A), 1e-12))
    out, k = [first], first
    while k + 1 < stop:
        reach_s = min(GROWTH * (time_s[k] - time_s[first]), most_s)
        end = int(np.searchsorted(time_s, time_s[k] + reach_s, side="right"))
        end = min(max(end - 1, k + 1), stop - 1)
        moved = np.abs(voltage_V[k + 1 : end + 1] - voltage_V[k]) > APART_V
        k = k + 1 + int(np.argmax(moved)) if moved.any() else end
        out.append(k)
    return np.array(out)


def with_steps(kept_s: FloatArray, stop_s: float) -> FloatArray:
    """(m,) `kept_s` with steps between, short after a change of the current; before `stop_s`."""
    return np.concatenate(
        [
            _steps(float(a), float(b), float(kept_s[0]))
            for a, b in zip(kept_s, np.append(kept_s[1:], stop_s), strict=True)
        ]
    )


def _steps(start_s: float, stop_s: float, changed_s: float) -> FloatArray:
    """Times from `start_s`, included, to `stop_s`, not included."""
    return np.array(list(_growing(start_s, stop_s, changed_s)))


def _growing(start_s: float, stop_s: float, changed_s: float) -> Iterator[float]:
    now_s = start_s
    while now_s < stop_s:
        yield now_s
        step_s = max(FIRST_STEP_S, STEP_GROWTH * (now_s - changed_s))
        left_s = stop_s - now_s
        now_s = stop_s if left_s < 1.5 * step_s else now_s + step_s


def local_means(
    test: ReferenceTest, index: IntArray, cuts: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(m,) voltage at the samples `index`, a mean of those around each, and how many they were.

    As many on either side, half way to the next kept one and within the phase, none beside a row
    with another current's voltage; a slope that uneven times leave in the mean is taken out.
    """
    before = np.diff(index, prepend=index[0])
    after = np.diff(index, append=index[-1])
    half = np.minimum(before, after) // 2
    mixed = np.flatnonzero(test.mixed())
    half[np.isin(index, np.concatenate([cuts, mixed - 1, mixed, mixed + 1]))] = 0
    value, time_s = np.empty(index.size), test.time_s
    for k, (i, h) in enumerate(zip(index.tolist(), half.tolist(), strict=True)):
        span = slice(i - h, i + h + 1)
        value[k] = test.voltage_V[span].mean()
        if h:
            rise = test.voltage_V[index[k + 1]] - test.voltage_V[index[k - 1]]
            slope = rise / (time_s[index[k + 1]] - time_s[index[k - 1]])
            value[k] -= slope * (time_s[span].mean() - time_s[i])
    return value, 2.0 * half + 1.0


def noise_of(test: ReferenceTest) -> float:
    """Standard deviation of the noise of a sample [V], from third differences at steady current.

    Their median, which a few jumps do not move; what is smooth cancels.
    """
    least_A = steady_A(test.current_A, test.voltage_V, felt_V=FLOOR_V)
    steady = np.abs(np.diff(test.current_A)) <= least_A
    quiet = steady[:-2] & steady[1:-1] & steady[2:]
    third = np.abs(np.diff(test.voltage_V, n=3))[quiet]
    if third.size == 0:
        return LEAST_NOISE_V
    return float(np.median(third) / 0.6745 / np.sqrt(20.0))  # 1 + 9 + 9 + 1


def _start(test: ReferenceTest, capacity_C: float) -> tuple[float, float]:
    """About the open-circuit voltage at the start, and its standard deviation."""
    lost_V = LOADED_V * test.current_A * 3600 / capacity_C
    flows = np.abs(lost_V) > 0.01 * LOADED_V
    if flows[0]:
        return float(test.voltage_V[0] + lost_V[0]), RESTED_V + abs(float(lost_V[0]))
    rests = ~np.logical_or.accumulate(flows) & ~test.mixed()
    return float(test.voltage_V[rests][:START_SAMPLES].mean()), RESTED_V
