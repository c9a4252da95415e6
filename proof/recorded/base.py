"""`Base`: what stands for a real cell in a trial, calibrated to tests that are not concealed.

Least squares (`twin.calibrate.run`) to the voltage, the cell heated by its own losses, and to how
it warms. The error that a base states is of tests that were not fitted: each that is as fast as the
trial is predicted by a fit to all others, as `twin calibrate` does; if the trial is the fastest,
those nearest to it by slower ones.
A calibration is kept as BPX and JSON under a hash of all that went into it, and always taken from
there: a second run is the first.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from proof.recorded.cooling import WHOLE, cooled, of_mounts
from proof.recorded.measured import RealTest, recorded_parts, rms_A, wide
from twin.at_rest import soc_at_rest
from twin.bpx_out import write_bpx
from twin.builtin import load_cell
from twin.calibrate.answer import answer
from twin.calibrate.checks import fitted, predicted
from twin.calibrate.out import cell_of, fit_text
from twin.calibrate.parameters import WARMING
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import Progress, conclusions, fit_from_everywhere, problem_of
from twin.cell import Cell
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating, SeriesResistance
from twin.load import Between, Load
from twin.mismatch.tested import Tested, by_tests
from twin.pack import Pack
from twin.simulate import simulate
from twin.whole_file import write_whole

FloatArray = npt.NDArray[np.float64]

VERSION = 21  # of what is kept: raise it where the same inputs give another calibration
ALIKE = 0.8  # of a current: more is about as fast
LEAST_TESTS = 2  # whole ones: one alone tells no losses
RESTS = 0.02  # of the largest current: less is a rest, whose voltage is that of the open circuit
ROOM_K = ZERO_CELSIUS_K + 25.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """What warms and cools.

    Attributes:
        heat_capacity_J_K: of the whole cell.
        cooling_area_m2: its outer surface.
    """

    heat_capacity_J_K: float
    cooling_area_m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Given:
    """What a base is calibrated from.

    Attributes:
        start: the cell to start from, with the capacity of this one.
        tests: to fit; full at the start of the first.
        unseen: tests that are not fitted at all.
        asked_A: rms current of the fastest recording of the trial; 0 if it is of another make.
        body: of the cell.
        driven: tests to fit besides, whose current is straight from sample to sample; it holds in
            the others.
        only: parameters that are free; None all.
        mount: that the trial is in, as its tests name it; a calibration does not depend on it.
    """

    start: Pack
    tests: tuple[RealTest, ...]
    body: Body
    driven: tuple[RealTest, ...] = ()
    unseen: tuple[RealTest, ...] = ()
    asked_A: float = 0.0
    only: tuple[str, ...] | None = None
    mount: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Base:
    """Calibrated.

    Attributes:
        pack: isothermal, full, at ROOM_K; it states how it cools in the mount of the trial.
        series_resistance_ohm: that it has.
        cooling: mount -> heat transfer from its surface there, and its standard error [W/(m2 K)];
            "" is one that no test was in. Empty where no warming was measured.
        warming_K: rms by which it misses these temperatures; 0 without any.
        full_soc: state of charge after the charge before its first test.
        errors_V: rms of what was not fitted, by name.
        fitted_V: rms of each fitted test; where its voltage dives, as much of what is missed as a
            twin may miss elsewhere.
    """

    pack: Pack
    series_resistance_ohm: float
    cooling: Mapping[str, tuple[float, float]]
    warming_K: float
    full_soc: float
    errors_V: dict[str, float]
    fitted_V: dict[str, float]

    @property
    def error_V(self) -> float:
        """That it states: the largest, of fitted tests too: others are known no better."""
        return max((*self.errors_V.values(), *self.fitted_V.values()))

    def heated(self, transfer_W_m2_K: float | None = None) -> Pack:
        """With its own losses, cooled as it states if nothing else is said."""
        transfer_W_m2_K = transfer_W_m2_K or self.pack.heat_transfer_W_m2_K
        assert transfer_W_m2_K is not None
        return _heated(self.pack, transfer_W_m2_K)


def base_of(given: Given, cache: Path) -> Base:
    """Calibrated, or from `cache` (a folder, made if it is not there) if it was before.

    With or without tests faster than the trial (`without_faster`): what states the least error.
    """
    ways = [(_kept(g, cache), g) for g in (given, *without_faster(given))]
    base, own = min(ways, key=lambda way: way[0].error_V)
    return replace(base, pack=replace(base.pack, standard_errors=_tested(own, base, cache)))


def without_faster(given: Given) -> Iterator[Given]:
    """Without the fastest of its whole tests, without those next to it too, and so on.

    Fast ones are needed where nothing else is as fast as the trial: as long as something is, those
    beyond it may do harm. A cell at 2C is warmer inside than a lump of heat. Two whole tests stay.
    """
    while given.asked_A > 0.0:
        flows_A = np.array([rms_A(t) for t in given.tests])
        drawn_C = np.array([np.ptp(t.drawn_C) for t in given.tests])
        whole = drawn_C > WHOLE * drawn_C.max()
        fastest_A = flows_A.max(where=whole, initial=0.0)
        fastest = whole & (flows_A > ALIKE * fastest_A)
        left = whole & ~fastest
        as_fast = left & (flows_A > ALIKE * given.asked_A)
        if fastest_A <= given.asked_A / ALIKE or not as_fast.any() or left.sum() < LEAST_TESTS:
            return
        tests = tuple(t for t, gone in zip(given.tests, fastest, strict=True) if not gone)
        yield (given := replace(given, tests=tests))


def _kept(given: Given, cache: Path) -> Base:
    place = _place(given, cache)
    if not (place / "base.json").exists():
        place.mkdir(parents=True, exist_ok=True)
        _calibrate(given, place)
    cell = load_cell(place / "cell.bpx.json")
    told = json.loads((place / "base.json").read_text())
    transfer, std = in_mount(told["cooling"], given.mount)
    pack = Pack(
        cell=cell, initial_K=ROOM_K, heat_transfer_W_m2_K=transfer, heat_transfer_std_W_m2_K=std,
        effects=(SeriesResistance(resistance_ohm=told["series_resistance_ohm"]),),
    )  # fmt: skip
    return Base(pack=pack, **told)


def in_mount(
    cooling: Mapping[str, tuple[float, float]], mount: str
) -> tuple[float, float] | tuple[None, None]:
    """Of `Base.cooling` in a mount; none where there is none."""
    return cooling.get(mount, cooling[""]) if cooling else (None, None)


def _heated(pack: Pack, transfer_W_m2_K: float | None) -> Pack:
    """With its own losses; as it is where no cooling is known."""
    if transfer_W_m2_K is None:
        return pack
    heating = SelfHeating(heat_transfer_W_m2_K=transfer_W_m2_K)
    return replace(pack, effects=(*pack.effects, heating))


def start_soc(cell: Cell, test: RealTest, full_soc: float) -> float:
    """By the first voltage of a test, if no current flows yet; else `full_soc`."""
    if abs(test.current_A[0]) > RESTS * np.abs(test.current_A).max():
        return full_soc
    return soc_at_rest(cell, float(test.voltage_V[0]))


def _calibrate(given: Given, place: Path) -> None:
    pack, tests = _to_fit(given)
    only = None if given.only is None else (*given.only, *WARMING)
    *_, best = fit_from_everywhere(problem_of(pack, tests, only=only))
    numbers = best.problem.numbers(best.q)
    names = ", ".join(t.name for t in tests)
    text = write_bpx(cell_of(best.problem, best.q), description=f"calibrated to {names}")
    write_whole(place / "cell.bpx.json", text)
    write_whole(place / "cell.fit.json", fit_text(next(conclusions(best.problem, best.q, tests))))
    full_soc = min(float(numbers["initial_soc"]), 1.0)
    ohm = SeriesResistance(resistance_ohm=numbers["series_resistance_ohm"])
    cooling = of_mounts(best.problem, best.q, answer(best.problem, best.q))
    errors_V = {}
    if given.unseen:
        own = Pack(cell=load_cell(place / "cell.bpx.json"), effects=(ohm,))
        errors_V["tests that were not fitted"] = _missed_V(own, cooling, full_soc, given.unseen)
    if near := nearest(given, tests):
        empty_V = pack.cell.lower_cut_off_V
        squares = []
        for group in apart(given, tests, near):
            *_, found = predicted(best.problem, best.q, tests, group)
            squares += [
                _rms_V(t.voltage_V[~t.mixed()], voltage_V, empty_V) ** 2
                for t, voltage_V in zip((tests[k] for k in group), found, strict=True)
            ]
        named = ", ".join(tests[k].name for k in near)
        errors_V[f"{named}, by a fit to the others"] = float(np.sqrt(np.mean(squares)))
    told = {
        "series_resistance_ohm": ohm.resistance_ohm,
        "cooling": cooling,
        "warming_K": _warming_K(best),
        "full_soc": full_soc,
        "errors_V": errors_V,
        "fitted_V": {f.name: f.even_rms_V for f in fitted(best.problem, best.q, tests)},
    }
    write_whole(place / "base.json", json.dumps(told, indent=1) + "\n")


def _tested(given: Given, base: Base, cache: Path) -> Tested:
    """What the tests that a base was fitted to say of effects of its make; kept beside it."""
    file = _place(given, cache) / "tested.json"
    if not file.exists():
        write_whole(file, json.dumps(_by_tests(given, base), indent=1) + "\n")
    found: Tested = json.loads(file.read_text())
    return found


def _by_tests(given: Given, base: Base) -> Tested:
    """Each of the tests from its own start, cooled as in its own mount."""

    def start(test: RealTest, own: ReferenceTest) -> Pack:
        transfer, _ = in_mount(base.cooling, test.mount)
        pack = _heated(base.pack, transfer)
        soc = start_soc(pack.cell, test, base.full_soc)
        return replace(pack, initial_soc=soc, initial_K=own.ambient_K)

    own = [(reference, start(test, reference)) for test, reference in _as_fitted(given, ROOM_K)]
    return by_tests(own, base.error_V, only=given.only)


def nearest(given: Given, tests: Sequence[ReferenceTest]) -> tuple[int, ...]:
    """Positions of the whole tests whose rate is nearest to `asked_A`, and not higher.

    None if no whole test is left without them, or if one that is not fitted at all is faster.
    """
    flows_A = np.array([rms_A(t) for t in tests])
    drawn_C = np.array([np.ptp(t.drawn_C()) for t in tests])
    whole = drawn_C > WHOLE * drawn_C.max()
    slower = whole & (flows_A <= given.asked_A / ALIKE)
    nearest_A = flows_A.max(where=slower, initial=0.0)
    near = slower & (flows_A > ALIKE * nearest_A)
    unseen_A = max((rms_A(t) for t in given.unseen), default=0.0)
    if unseen_A > nearest_A / ALIKE or not (whole & ~near).any():
        return ()
    return tuple(np.flatnonzero(near).tolist())


def apart(
    given: Given, tests: Sequence[ReferenceTest], near: tuple[int, ...]
) -> tuple[tuple[int, ...], ...]:
    """Of `nearest`, those that are predicted by one fit without them.

    Each alone if they are as fast as the trial, whose base keeps them; else all of them, as its
    base knows nothing so fast as the trial.
    """
    as_fast = max(rms_A(tests[k]) for k in near) > ALIKE * given.asked_A
    return tuple((k,) for k in near) if as_fast else (near,)


def _warming_K(best: Progress) -> float:
    """Rms by which the temperatures of all tests are missed; 0 without any."""
    tests = [t for k, t in enumerate(best.problem.tests) if best.problem.warming(k)]
    if not tests:
        return 0.0
    sigma_K = np.concatenate([np.full(t.at.size, t.sigma_K) for t in tests])
    missed_K = best.problem.residuals(best.q)[-sigma_K.size :] * sigma_K
    return float(np.sqrt(np.mean(missed_K**2)))


def charged_to(cell: Cell, full_V: float, empty_V: float) -> Cell:
    """With other cut-offs, and the window of the positive electrode that goes with them when full.

    The negative window stays: a maker who charges higher takes more graphite.
    """
    n, p = cell.negative, cell.positive
    graphite_V = float(ca.evalf(n.ocp_V(ca.SX(n.stoichiometry_max))))

    def above_V(y: float) -> float:
        return float(ca.evalf(p.ocp_V(ca.SX(y)))) - graphite_V - full_V

    full = float(brentq(above_V, 0.01, p.stoichiometry_max))
    return replace(
        cell,
        positive=replace(p, stoichiometry_min=full),
        lower_cut_off_V=empty_V,
        upper_cut_off_V=full_V,
    )


def _missed_V(
    pack: Pack,
    cooling: Mapping[str, tuple[float, float]],
    full_soc: float,
    unseen: Sequence[RealTest],
) -> float:
    """Rms over tests that nothing was fitted to, each counting alike and cooled as in its mount.

    A cell goes on below its cut-off, since it may be empty a little early.
    """
    squares = []
    for test in unseen:
        start_K = test.start_K(ROOM_K)
        soc = start_soc(pack.cell, test, full_soc)
        transfer, _ = in_mount(cooling, test.mount)
        own = replace(
            _heated(pack, transfer), cell=wide(pack.cell), initial_K=start_K, initial_soc=soc
        )
        load = Load(
            time_s=test.time_s, current_A=test.current_A, between=Between.LINEAR, ambient_K=start_K
        )
        got_V = np.full(test.time_s.size, np.nan)
        done_V = simulate(own, load).voltage_V
        got_V[: done_V.size] = done_V
        squares.append(_rms_V(test.voltage_V, got_V, pack.cell.lower_cut_off_V) ** 2)
    return float(np.sqrt(np.mean(squares)))


def _rms_V(measured_V: FloatArray, got_V: FloatArray, empty_V: float) -> float:
    """Of a test; a simulation that ended (NaN) stands at the cut-off from there."""
    error_V = measured_V - np.where(np.isnan(got_V), empty_V, got_V)
    return float(np.sqrt(np.nanmean(error_V**2)))


def _to_fit(given: Given) -> tuple[Pack, list[ReferenceTest]]:
    """The pack to start from, with its body and cooling, and the tests as a calibration has them.

    A test with gaps in its voltage is as many tests, each from its own start.
    """
    parts = [part for t in given.tests for part in recorded_parts(t)]
    cell, scale = given.start.cell, given.start.scale
    body = replace(
        cell,
        heat_capacity_J_K=given.body.heat_capacity_J_K / scale,
        cooling_area_m2=given.body.cooling_area_m2 / scale ** (2 / 3),
    )
    pack = replace(given.start, cell=body)
    starts_K = [float(t.temperature_K[0]) for t in parts if t.temperature_K is not None]
    if starts_K:
        pack = cooled(replace(pack, initial_K=float(np.mean(starts_K))), (*parts, *given.unseen))
    return pack, [own for _, own in _as_fitted(given, pack.initial_K)]


def _as_fitted(given: Given, otherwise_K: float) -> list[tuple[RealTest, ReferenceTest]]:
    """Each test, or part of one, and how a calibration has it."""
    parts = [part for t in given.tests for part in recorded_parts(t)]
    ways = [*((t, Between.HOLD) for t in parts), *((t, Between.LINEAR) for t in given.driven)]
    return [
        (t, t.reference(ambient_K=t.start_K(otherwise_K), between=between)) for t, between in ways
    ]


def _place(given: Given, cache: Path) -> Path:
    """Folder of what is kept of it."""
    return cache / f"base-{_key(given)}"


def _key(given: Given) -> str:
    """Hash of the inputs."""
    told = sha256(write_bpx(given.start.cell, description="").encode())
    start = given.start.capacity_C, given.start.initial_soc, given.start.initial_K
    told.update(repr((VERSION, start, given.asked_A, given.body, given.only)).encode())
    for group in (given.tests, given.driven, given.unseen):
        told.update(f"{len(group)} tests".encode())
        for test in group:
            told.update(f"{test.name} {test.mount}".encode())
            for values in (test.time_s, test.current_A, test.voltage_V, test.temperature_K):
                told.update(b"-" if values is None else np.ascontiguousarray(values).tobytes())
    return told.hexdigest()[:16]
