"""From models to a verdict, with fits that are only numbers."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from twin.effects import SelfHeating
from twin.mismatch.choose import Model
from twin.mismatch.decide import decide, most_of_noise
from twin.mismatch.finding import Verdict
from twin.mismatch.fit import Fitted, excess_of
from twin.mismatch.hypothesis import PRIOR

NOISE_V = 0.0004


def problem(*names: str, numbers: int = 0, stated: Any = None, noise_V: float = NOISE_V) -> Any:
    """Of these effects, with so many numbers each, of which none is told."""
    none: dict[str, Any] = {name: {} for name in names}
    fitted = tuple(f"x{k}" for k in range(numbers))
    return SimpleNamespace(
        hypotheses=tuple(
            SimpleNamespace(id=n, kind=SelfHeating, parameters=(), fitted=fitted) for n in names
        ),
        heavy_tailed=False,
        flights=(SimpleNamespace(pack=SimpleNamespace(standard_errors=stated or {})),),
        told=lambda *_: none,
        values=lambda *_: none,
        stds=lambda *_: none,
        size=1,
        noise_V=noise_V,
        rms_V=lambda _: np.inf,
    )


@dataclass
class Fit:
    """As much of a fit as a verdict asks for that lists no effects."""

    ids: tuple[str, ...]
    fitted_V: float
    ahead_V: float
    excess: float = 1.0
    evidence: float = 0.0
    q: Any = field(default_factory=lambda: np.zeros(1))
    left_V: Any = None
    problem: Any = field(default_factory=problem)
    there: Any = field(default_factory=lambda: SimpleNamespace(residuals=np.zeros(1000)))
    ahead: Any = field(default_factory=lambda: SimpleNamespace(residuals=np.zeros(1000)))
    judge: Any = field(
        default_factory=lambda: SimpleNamespace(
            flights=[SimpleNamespace(pack=SimpleNamespace(series=1))],
            own_V=0.018,
            noise_V=NOISE_V,
            lasting_V=NOISE_V,
        )
    )

    @property
    def log_before(self) -> float:
        return len(self.ids) * np.log(PRIOR)

    def covariance(self, scale: float) -> Any:
        return scale * np.eye(self.q.size)

    def log_likelihood(self, scale: float) -> float:
        return self.evidence / scale - 100.0 * len(self.ids)

    def log_evidence(self, scale: float) -> float:
        return self.evidence / scale

    def rms_V(self) -> float:
        return self.fitted_V

    def held_out_rms_V(self) -> float:
        return self.ahead_V

    def within(self, most_V: float) -> bool:
        return Fitted.within(cast(Any, self), most_V)

    def started_V(self) -> Any:
        return np.full(1000, self.ahead_V) if self.left_V is None else self.left_V


def model(fit: Fit, log_evidence: float, probability: float) -> Model:
    return Model(fitted=cast(Any, fit), log_evidence=log_evidence, probability=probability)


def with_noise(noise_V: float, models: list[Model]) -> list[Model]:
    for own in models:
        for of in (own.fitted.problem, own.fitted.judge):
            cast(Any, of).noise_V = cast(Any, of).lasting_V = noise_V
    return models


@pytest.mark.parametrize(("excess", "verdict"), [(1.0, Verdict.NONE), (50.0, Verdict.UNKNOWN)])
def test_what_predicts_worse_than_nothing_is_not_named(excess: float, verdict: Verdict) -> None:
    null = model(Fit((), 0.0243, 0.0187, excess=excess), 0.0, 1e-9)
    misled = model(Fit(("ocv_hysteresis",), 0.0104, 0.0230), 20.0, 1.0)
    found = decide([misled, null], 1.0)
    assert found.verdict is verdict
    assert found.effects == ()


@pytest.mark.parametrize(("left_V", "verdict"), [(0.0008, Verdict.NONE), (0.0009, Verdict.UNKNOWN)])
def test_what_solvers_differ_by_is_nothing_however_long_it_is_seen(
    left_V: float, verdict: Verdict
) -> None:
    """Slow, it is no noise; beside noise of 0.4 mV, 0.75 mV of it make 0.85 mV."""
    null = model(Fit((), left_V, left_V, excess=50.0), 0.0, 1e-9)
    better = model(Fit(("ocv_hysteresis",), 0.0006, 0.0006), 20.0, 1.0)
    assert decide([better, null], 1.0).verdict is verdict


@pytest.mark.parametrize(("left_V", "named"), [(0.0008, True), (0.0009, False)])
def test_what_solvers_differ_by_does_not_spoil_a_name(left_V: float, *, named: bool) -> None:
    null = model(Fit((), 0.060, 0.060, excess=900.0), 0.0, 1e-9)
    better = model(Fit(("ocv_hysteresis",), left_V, left_V, excess=50.0), 20.0, 1.0)
    assert (decide([better, null], 1.0).verdict is Verdict.NAMED) == named


@pytest.mark.parametrize(
    ("worse_by", "lasts", "verdict"),
    [(1.0, 1.0, Verdict.NAMED), (3.0, 1.0, Verdict.NONE), (3.0, 2.0, Verdict.NAMED)],
)
def test_worse_by_chance_alone_spoils_no_effect(
    worse_by: float, lasts: float, verdict: Verdict
) -> None:
    """Held out it shows by a hundredth of the noise; deviations of what that makes by chance.

    Noise that follows itself makes more by chance than white noise does.
    """
    noise, aside = np.tile([1.0, -1.0], 500), np.tile([1.0, 1.0, -1.0, -1.0], 250)
    shown = aside + worse_by / np.sqrt(noise.size) * noise
    null = Fit((), 0.02, NOISE_V, left_V=NOISE_V * noise)
    right = Fit(("ocv_hysteresis",), NOISE_V, NOISE_V, left_V=NOISE_V * (noise + 0.01 * shown))
    right.judge.lasting_V = lasts * NOISE_V
    found = decide([model(right, 20.0, 1.0), model(null, 0.0, 1e-9)], 1.0)
    assert found.verdict is verdict


@pytest.mark.parametrize(
    ("stated_V", "fitted_V", "ahead_V", "verdict"),
    [
        (0.025, 0.024, 0.019, Verdict.NONE),
        (0.025, 0.024, 0.050, Verdict.UNKNOWN),  # of what was held out it explains more
        (0.025, 0.024, 0.060, Verdict.NAMED),  # than the twin may err by elsewhere
        (0.025, 0.090, 0.024, Verdict.UNKNOWN),  # what was fitted is no witness
        (0.025, 0.050, 0.024, Verdict.UNKNOWN),  # of what was fitted
        (0.025, 0.050, 0.050, Verdict.NAMED),
        (0.0, 0.024, 0.019, Verdict.NAMED),  # nobody stated one
    ],
)
def test_what_the_twin_is_stated_to_err_by_has_no_name(
    stated_V: float, fitted_V: float, ahead_V: float, verdict: Verdict
) -> None:
    null = model(Fit((), fitted_V, ahead_V, excess=50.0), 0.0, 1e-9)
    better = model(Fit(("self_heating",), 0.006, 0.010), 20.0, 1.0)
    found = decide([better, null], 1.0, stated_V=stated_V)
    assert found.verdict is verdict


@pytest.mark.parametrize(("as_configured_V", "verdict"), [(0.024, Verdict.NONE), (0.026, None)])
def test_a_start_that_is_fitted_takes_no_twin_beyond_its_stated_error(
    as_configured_V: float, verdict: Verdict | None
) -> None:
    """Its evidence asks for another start, though as configured it misses what it is stated to."""
    null = Fit((), 0.030, 0.019, excess=50.0)
    null.problem.rms_V = lambda _: as_configured_V
    better = model(Fit(("self_heating",), 0.006, 0.010), 20.0, 1.0)
    found = decide([better, model(null, 0.0, 1e-9)], 1.0, stated_V=0.025)
    assert (found.verdict is Verdict.NONE) == (verdict is Verdict.NONE)


@pytest.mark.parametrize(
    ("stated_V", "alone_V", "ids"),
    [
        (0.020, 0.035, ("self_heating",)),
        (0.015, 0.035, ("ocv_hysteresis", "self_heating")),  # more than twice of it is left
        (0.0, 0.035, ("ocv_hysteresis", "self_heating")),
    ],
)
def test_beside_an_effect_that_leaves_what_the_twin_may_err_by_no_other_is_named(
    stated_V: float, alone_V: float, ids: tuple[str, ...]
) -> None:
    null = model(Fit((), 0.1, 0.1, excess=500.0, evidence=-900.0), -900.0, 0.0)
    alone = model(Fit(("self_heating",), 0.03, alone_V, excess=9.0, evidence=-90.0), -90.0, 1e-9)
    worse = model(
        Fit(("film_resistance",), 0.03, alone_V, excess=20.0, evidence=-200.0), -200.0, 0.0
    )
    pair = model(Fit(("ocv_hysteresis", "self_heating"), 0.003, 0.003), 0.0, 1.0)
    found = decide([pair, alone, worse, null], 1.0, stated_V=stated_V)
    assert found.model.ids == ids


@pytest.mark.parametrize(("less", "ids"), [(1.0, ("heat",)), (-1.0, ("clock", "cold"))])
def test_more_effects_that_are_less_likely_replace_none(less: float, ids: tuple[str, ...]) -> None:
    """They leave what the twin may err by, and the likelier one a little more."""
    null = model(Fit((), 0.1, 0.1, excess=500.0, evidence=-900.0), -900.0, 0.0)
    alone = model(Fit(("heat",), 0.024, 0.024), 0.0, 0.9)
    pair = model(Fit(("clock", "cold"), 0.015, 0.015), -less, 0.1)
    for own in (alone, pair):
        cast(Any, own.fitted).problem = problem(*own.ids)
    assert decide([alone, pair, null], 1.0, stated_V=0.010).model.ids == ids


@pytest.mark.parametrize(
    ("left_V", "less", "alike"),
    [(0.022, 0.4, ("cold",)), (0.022, 3.4, ()), (0.022, -3.4, ()), (0.032, 0.4, ())],
)
def test_what_is_as_likely_and_leaves_a_little_more_looks_like_it(
    left_V: float, less: float, alike: tuple[str, ...]
) -> None:
    """The one leaves just less than twice what the twin is stated to err by."""
    null = model(Fit((), 0.1, 0.1, excess=500.0, evidence=-900.0), -900.0, 0.0)
    heat, cold = _with_effect("heat", 0.019, 1.0), _with_effect("cold", left_V, 1.0)
    heat.fitted_V, cold.fitted_V, cold.evidence = 0.019, left_V, -less
    found = decide([model(heat, 0.0, 0.6), model(cold, -less, 0.4), null], 1.0, stated_V=0.010)
    (effect,) = found.effects
    assert effect.equivalent == alike
    assert effect.id == ("cold" if less < 0.0 else "heat")


@pytest.mark.parametrize(("noise_V", "ids"), [(0.025, ("heat",)), (0.003, ("clock", "heat"))])
def test_a_recording_is_judged_by_its_own_noise(noise_V: float, ids: tuple[str, ...]) -> None:
    """What is fitted has more noise than what is held out, which is no want of an effect."""
    null = model(Fit((), 0.07, 0.06, excess=500.0), -900.0, 0.0)
    alone, pair = (_with_effect(name, 0.009) for name in ("heat", "clock"))
    alone.fitted_V, pair.fitted_V = 0.030, 0.015
    pair.ids, pair.problem = ("clock", "heat"), problem("clock", "heat")
    for own in (alone, pair):
        own.problem.noise_V = noise_V
    models = [model(pair, 0.0, 1.0), model(alone, -20.0, 1e-9), null]
    assert decide(models, 1.0, stated_V=0.010).model.ids == ids


@pytest.mark.parametrize(("noise_V", "verdict"), [(0.040, Verdict.NONE), (0.005, None)])
def test_a_twin_that_errs_as_stated_does_so_beside_the_noise_of_each_recording(
    noise_V: float, verdict: Verdict | None
) -> None:
    null = Fit((), 0.0405, 0.008, excess=50.0)
    null.problem.noise_V = noise_V
    found = decide([model(null, 0.0, 1.0)], 1.0, stated_V=0.008)
    assert (found.verdict is Verdict.NONE) == (verdict is Verdict.NONE)


@pytest.mark.parametrize(
    ("shift", "other_V", "ids"),
    [
        (1.3, 0.006, ("cold", "resistance")),
        (2.7, 0.006, ("clock", "cold")),  # more than is stated
        (1.3, 0.035, ("clock", "cold")),  # nothing else is enough
    ],
)
def test_what_a_pack_states_within_errors_is_not_left_out(
    shift: float, other_V: float, ids: tuple[str, ...]
) -> None:
    """A cold pack whose clocks are known within an error, as sharp as its evidence may be."""
    null = model(Fit((), 0.07, 0.06, excess=500.0), -900.0, 0.0)
    cold = model(_with_numbers({"cold": -2.0}, 0.030), -70.0, 0.0)
    shifted = model(_with_numbers({"clock": shift, "cold": -2.0}, 0.020), 0.0, 1.0)
    resists = model(_with_numbers({"cold": -2.0, "resistance": 0.5}, other_V), -20.0, 0.0)
    found = decide([shifted, resists, cold, null], 1.0, stated_V=0.012)
    assert found.model.ids == ids
    assert [e.id for e in found.effects] == list(ids)


@pytest.mark.parametrize(
    ("shift", "ids"), [(2.9, ("clock",)), (-7.3, ("cold", "weak")), (7.3, ("cold", "weak"))]
)
def test_few_effects_are_not_enough_where_the_pack_states_that_one_is_not_so(
    shift: float, ids: tuple[str, ...]
) -> None:
    """One effect leaves what the twin may err by, by a clock that is known to be right."""
    null = model(Fit((), 0.12, 0.12, excess=500.0), -900.0, 0.0)
    clock = model(_with_numbers({"clock": shift}, 0.05), -40.0, 1e-9)
    pair = model(_with_numbers({"cold": -5.0, "weak": -5.0}, 0.013), 0.0, 1.0)
    found = decide([pair, clock, null], 1.0, stated_V=0.035)
    assert found.model.ids == ids


def test_what_leaves_more_than_little_does_not_look_like_what_is_named_for_leaving_little() -> None:
    """Odds of 3 to 1 between all three; of 388 mV one leaves 145, the others 48 and 42."""
    null = model(Fit((), 0.158, 0.388, excess=500.0), -90.0, 0.0)
    first, far, near = (
        model(_with_effect(name, ahead_V), -k, probability)
        for k, (name, ahead_V, probability) in enumerate(
            (("gain", 0.048, 0.6), ("diffusion", 0.145, 0.2), ("heat", 0.042, 0.2))
        )
    )
    found = decide([first, far, near, null], 1.0, stated_V=0.018)
    (effect,) = found.effects
    assert (effect.id, effect.equivalent) == ("gain", ("heat",))
    assert effect.probability == pytest.approx(0.8)


@pytest.mark.parametrize(("best_V", "verdict"), [(0.025, "unknown"), (0.036, "named")])
def test_what_is_left_near_the_noise_is_no_other_cell(best_V: float, verdict: str) -> None:
    """Of 388 mV one effect leaves 40, and in vain if two leave hardly more than noise of 8.7."""
    null = model(Fit((), 0.158, 0.388, excess=500.0), -90.0, 0.0)
    pair = model(Fit(("diffusion", "gain"), 0.03, best_V, excess=180.0), 0.0, 0.9)
    gain = model(_with_effect("gain", 0.040), -4.0, 0.1)
    found = decide(with_noise(0.0087, [pair, gain, null]), 1.0, stated_V=0.0)
    assert found.verdict.value == verdict


@pytest.mark.parametrize(
    ("ahead_V", "excess", "verdict"),
    [
        (0.006, 1.0, Verdict.NAMED),
        (0.013, 1.0, Verdict.NAMED),
        (0.013, 4.0, Verdict.UNKNOWN),
    ],
    ids=["hardly worse", "spoilt", "spoilt, and more than noise is left without"],
)
def test_an_effect_that_makes_what_is_held_out_worse_is_no_error_of_the_twin(
    ahead_V: float, excess: float, verdict: Verdict
) -> None:
    """Of 30 mV one effect leaves 6; evidence for a second is strong, in microvolts of the fit."""
    null = model(Fit((), 0.027, 0.030, excess=500.0), -900.0, 0.0)
    alone = model(_with_effect("hysteresis", 0.006, excess=excess), -80.0, 0.0)
    more = Fit(("hysteresis", "salt"), alone.fitted.rms_V() - 1e-6, ahead_V, excess=excess)
    found = decide(with_noise(0.005, [model(more, 0.0, 1.0), alone, null]), 1.0)
    assert found.verdict is verdict
    assert [e.id for e in found.effects] == ["hysteresis"] * (verdict is Verdict.NAMED)


@pytest.mark.parametrize(
    ("more_V", "names"), [(0.58e-3, ["hysteresis"]), (0.8e-3, ["hysteresis", "salt"])]
)
def test_beside_others_an_effect_changes_more_than_two_simulators_differ_by(
    more_V: float, names: list[str]
) -> None:
    """Its evidence is strong, of so many samples; without it only noise of 4 mV is left."""
    null = model(Fit((), 0.027, 0.030, excess=500.0), -900.0, 0.0)
    alone = model(_with_effect("hysteresis", 4e-3, excess=1.0), -34.0, 1e-15)
    both = _with_effect("hysteresis", float(np.sqrt(4e-3**2 - more_V**2)), excess=1.0)
    both.ids, both.problem = ("hysteresis", "salt"), problem("hysteresis", "salt")
    found = decide(with_noise(4e-3, [model(both, 0.0, 1.0), alone, null]), 1.0)
    assert [e.id for e in found.effects] == names


@pytest.mark.parametrize("samples", [5, 12, 30, 100, 300, 1000, 3000, 10000])
def test_one_of_a_hundred_residuals_of_pure_noise_is_not_taken_for_noise(samples: int) -> None:
    rng, draws = np.random.default_rng(samples), 2000
    most = most_of_noise(samples)
    over = sum(excess_of(rng.standard_normal(samples)) > most for _ in range(draws))
    assert 0.004 < over / draws < 0.025


@pytest.mark.parametrize(("samples", "verdict"), [(3000, Verdict.UNKNOWN), (300, Verdict.NAMED)])
def test_of_many_samples_little_is_more_than_noise(samples: int, verdict: Verdict) -> None:
    """Excess of 1.5."""
    null = model(Fit((), 0.4, 0.4, excess=500.0), -90.0, 0.0)
    fit = _with_effect("heat", 0.002, excess=1.5)
    fit.there = fit.ahead = SimpleNamespace(residuals=np.zeros(samples))
    assert decide(with_noise(0.002, [model(fit, 0.0, 1.0), null]), 1.0).verdict is verdict


@pytest.mark.parametrize(
    ("others", "share", "verdict"),
    [(3, 0.2, Verdict.NAMED), (5, 0.12, Verdict.AMBIGUOUS), (5, 0.08, Verdict.NAMED)],
)
def test_a_name_has_few_that_look_like_it_or_is_likely_alone(
    others: int, share: float, verdict: Verdict
) -> None:
    null = model(Fit((), 0.4, 0.4, excess=500.0), -90.0, 0.0)
    first = model(_with_effect("heat", 0.002, excess=1.0), 0.0, 1.0 - others * share)
    rest = [model(_with_effect(f"e{k}", 0.002, 1.0), -2.0, share) for k in range(others)]
    found = decide(with_noise(0.002, [first, *rest, null]), 1.0)
    assert found.verdict is verdict
    assert len(found.effects[0].equivalent) == others


def test_a_probability_is_at_most_one() -> None:
    shares = (0.55, 0.34, 0.11)
    assert sum(shares) > 1.0  # rounded
    null = model(Fit((), 0.4, 0.4, excess=500.0), -90.0, 0.0)
    alike = [
        model(_with_effect(name, 0.002, excess=1.0), -2.0 * k, share)
        for k, (name, share) in enumerate(zip(("heat", "cold", "salt"), shares, strict=True))
    ]
    (effect,) = decide(with_noise(0.002, [*alike, null]), 1.0).effects
    assert effect.equivalent == ("cold", "salt")
    assert effect.probability == 1.0


def _with_effect(name: str, ahead_V: float, excess: float = 9.0) -> Fit:
    return Fit((name,), 0.022, ahead_V, excess=excess, problem=problem(name))


def _with_numbers(q: dict[str, float], left_V: float) -> Fit:
    """Effects of one number each; the pack states its own error of that of `clock`."""
    of = problem(*q, numbers=1, stated={"clock": {"x0": 0.02}})
    return Fit(tuple(q), left_V, left_V, q=np.array([*q.values()]), problem=of)
