"""What reference tests say of numbers that an effect would change: `by_tests`.

Diffusivities, rates and the salt are of the cell's make: they are in its reference tests as in its
flights. A calibrated twin follows those tests within the error that is stated of it; were one of
these numbers off by much, it would not. So what explains a flight has to leave the tests as they
are followed, as far as they tell: an effect of the make is believed within the standard errors that
its numbers have where it alone is fitted to the tests. Where these tell little (slow tests of
diffusion), they say less than its own prior, and nothing changes.

That is the posterior of the tests as the prior of the flight: D. J. C. MacKay, Information Theory,
Inference, and Learning Algorithms (2003), chapter 3. It is linear about the calibrated twin; what
makes losses larger acts more than in proportion, so that the tests would say more than this.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import hypot

import numpy as np

from twin.calibrate.checks import own_error_V
from twin.calibrate.out import calibrated_cell
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import Calibration
from twin.calibrate.settle import MISSED_V
from twin.effects import AnyEffect, SelfHeating, SeriesResistance
from twin.mismatch.flight import Flight
from twin.mismatch.hypothesis import UNCERTAIN
from twin.mismatch.noise import Whitener
from twin.mismatch.problem import Problem
from twin.mismatch.split import as_seen, own_whitener
from twin.pack import Pack

OF_THE_MAKE: Mapping[str, tuple[str, ...]] = {
    "electrolyte_transport": ("electrolyte.diffusivity_factor",),
    "solid_diffusion_negative": ("negative.diffusivity_m2_s",),
    "solid_diffusion_positive": ("positive.diffusivity_m2_s",),
    "reaction_kinetics": ("negative.exchange_current_A_m2", "positive.exchange_current_A_m2"),
    "activation_energies": (),
}
"""Effect -> what a calibration has to have found if its tests shall say of it; of activation
energies they say as much as they are warm and cold, found or not. It is as it was in the tests;
not so ageing, the pack, the state it starts in, an instrument; nor hysteresis, which a calibration
to discharges has in its open-circuit curve."""

Tested = Mapping[str, Mapping[str, float]]


def by_tests(
    tests: Sequence[tuple[ReferenceTest, Pack]], error_V: float, *,
    only: Collection[str] | None = None,
) -> Tested:  # fmt: skip
    """Effect -> number -> its standard error by all `tests`, relative where it is logarithmic.

    Args:
        tests: each with the calibrated cell as it started, its losses heating it if they did.
        error_V: that is stated of the twin, rms; its kind is that of `Noise`.
        only: what was calibrated; None all of it. A number that was not is that of another cell,
            to which all others were fitted: that they leave it no room says nothing.
    """
    data = [as_tested(_flight(test, pack), error_V) for test, pack in tests]
    out = {}
    for h in UNCERTAIN:
        names = OF_THE_MAKE.get(h.id)
        if names is not None and (only is None or set(names) <= set(only)):
            problem = Problem(data, [h])
            slopes = problem.evidence(np.zeros(problem.size)).slopes
            covariance = np.linalg.inv(np.eye(problem.size) + slopes.T @ slopes)
            shares = np.sqrt(np.diag(covariance)).tolist()
            priors = h.priors(tests[0][1])
            out[h.id] = {p.name: p.prior_std * s for p, s in zip(priors, shares, strict=False)}
    return out


def as_tested(flight: Flight, error_V: float) -> tuple[Flight, Whitener]:
    """A recording of a test with what is chance in it.

    Numbers that are off all along are what is asked for, no chance: losses forget as all else does.
    """
    seen, noise = as_seen(flight, error_V)
    losses_V = hypot(noise.along_V, noise.losses_V)
    noise = replace(noise, along_V=losses_V, along_s=noise.slow_s, losses_V=0.0)
    return seen, own_whitener(seen, noise)


def by_calibration(found: Calibration, tests: Sequence[ReferenceTest]) -> Tested:
    """The same by the tests of a calibration; nothing if it does not follow one to its end.

    Its error is that of tests it was not fitted to, and no less than a twin misses of a cell.
    """
    missed_V = max(MISSED_V, own_error_V(found.fitted))
    if not np.isfinite(missed_V):
        return {}
    numbers = found.numbers
    own: list[AnyEffect] = [SeriesResistance(resistance_ohm=numbers["series_resistance_ohm"])]
    if transfer := numbers.get("heat_transfer_W_m2_K"):
        own.append(SelfHeating(heat_transfer_W_m2_K=transfer))
    ids, before = [e.id for e in own], found.problem.pack
    effects = (*(e for e in before.effects if e.id not in ids), *own)
    pack = replace(
        before, cell=calibrated_cell(found), capacity_C=None, effects=effects, standard_errors={}
    )  # else they would count twice

    def started(place: int) -> Pack:
        soc = found.problem.mapped(found.q, place).numbers["initial_soc"]
        return replace(pack, initial_soc=min(soc, 1.0), initial_K=tests[place].ambient_K)

    fitted = set(found.answer.names) - set(found.answer.held)
    both = [(test, started(k)) for k, test in enumerate(tests)]
    return by_tests(both, missed_V, only=fitted)


def _flight(test: ReferenceTest, pack: Pack) -> Flight:
    return Flight(
        name=test.name, pack=pack, load=test.load(), voltage_V=test.voltage_V, judged=~test.mixed(),
        motion=np.full(test.time_s.size, ""),
    )  # fmt: skip
