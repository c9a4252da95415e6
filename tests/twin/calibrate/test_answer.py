"""Standard errors of estimates, some of them held at their prior; what is held."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from twin.calibrate.answer import Verdict, _covariance, _curvature, estimated, not_identified
from twin.calibrate.parameters import Parameter

FloatArray = npt.NDArray[np.float64]


def linear(slopes: FloatArray, behind: FloatArray, held: tuple[int, ...] = ()) -> Any:
    """A problem of one test whose residuals at 0 are white and `slopes` @ q beyond."""
    n, k = slopes.shape
    ones = np.ones(n)
    residuals = np.concatenate([np.random.default_rng(5).standard_normal(n), np.zeros(len(behind))])
    test = SimpleNamespace(name="a", at=np.arange(n), noise_V=1.0, sigma_V=ones, count=ones)
    return SimpleNamespace(
        tests=[test],
        parameters=[SimpleNamespace(name=f"p{i}") for i in range(k)],
        held=np.isin(np.arange(k), held),
        linearised=lambda _: (residuals, np.vstack([slopes, behind])),
    )


@pytest.mark.parametrize("held", [(), (1,), (0, 3)])
def test_the_covariance_is_that_of_estimates_of_many_drawn_truths(held: tuple[int, ...]) -> None:
    random = np.random.default_rng(0)
    slopes, k = random.standard_normal((200, 4)) * [0.03, 0.05, 0.2, 0.02], 4
    slopes[:, 1] += 0.5 * slopes[:, 2]  # what is held has a share in what is not
    behind = np.vstack([np.eye(k), [[0.0, 1.5, 1.0, 0.0]]])  # a prior of two together
    problem = linear(slopes, behind, held)
    told = _curvature(problem, np.zeros(k))
    got = _covariance(told, problem.held)
    free = ~problem.held
    prior = behind.T @ behind
    noise_std = np.sqrt(told.meat[0, 0] / told.weighed[0, 0])
    truths = random.multivariate_normal(np.zeros(k), np.linalg.inv(prior), size=40_000)
    noise = noise_std * random.standard_normal((truths.shape[0], 200))
    pull = (truths @ slopes.T + noise) @ slopes  # measured = slopes @ truth + noise
    estimates = np.zeros_like(truths)
    normal = (slopes.T @ slopes + prior)[np.ix_(free, free)]
    estimates[:, free] = np.linalg.solve(normal, pull[:, free].T).T
    exact = np.cov(estimates - truths, rowvar=False)
    scale = np.sqrt(np.outer(np.diag(got), np.diag(got)))
    assert np.abs((got - exact) / scale).max() < 0.03  # 40 000 draws: 0.7 % for one deviation
    if held:
        alone = np.linalg.inv(prior)
        assert np.diag(got)[list(held)] == pytest.approx(np.diag(alone)[list(held)])


def test_of_parameters_that_only_a_sum_is_told_of_some_stay_free() -> None:
    k = 40
    problem = linear(np.full((50, k), 10.0), np.eye(k))
    names = not_identified(problem, np.zeros(k))
    # each alone keeps sqrt(1 - 1 / 40) of its prior, more than 0.98; one of 25 sqrt(24 / 25)
    assert len(names) == k - 25
    apart = linear(np.vstack([np.eye(2), np.eye(2)]) * [10.0, 0.1], np.eye(2))
    assert not_identified(apart, np.zeros(2)) == ("p1",)


@pytest.mark.parametrize(
    ("held", "q", "verdict"),
    [
        ("a", 0.0, Verdict.PRIOR),
        ("", 0.1, Verdict.PRIOR),
        ("", 1.2, Verdict.UNTOLD),
        ("", 3.0, Verdict.AT_BOUND),
    ],
)
def test_what_was_moved_is_never_said_to_be_its_prior(
    held: str, q: float, verdict: Verdict
) -> None:
    """However wide: what is left of its tests may be as large as the prior, or more."""
    number = Parameter(name="a", unit="1", mean=1.0, std=0.1, lower=0.7, upper=1.3)
    one = np.array([q]), np.array([1.0 if held else 1.1]), np.ones(1), np.array([held == "a"])
    (estimate,) = estimated([number], *one)
    assert estimate.verdict is verdict
