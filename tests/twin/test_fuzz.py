"""A small part of `python -m benchmarks.fuzz`, always with the same seeds."""

import time
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import fuzz
from twin.solution import Solution, Status


@pytest.mark.parametrize("first", range(0, 100, 20))
def test_random_flights_end_with_a_status_and_every_atom_counted(first: int) -> None:
    outcomes = [fuzz.outcome("flight", seed) for seed in range(first, first + 20)]
    assert [(o.seed, o.faults) for o in outcomes if o.faults] == []
    assert [o.seed for o in outcomes if o.status is Status.NOT_CONVERGED] == []


@pytest.mark.parametrize("first", range(0, 12, 3))
def test_random_protocols_end_with_a_status_and_every_atom_counted(first: int) -> None:
    outcomes = [fuzz.outcome("protocol", seed) for seed in range(first, first + 3)]
    assert [(o.seed, o.faults) for o in outcomes if o.faults] == []
    assert [o.seed for o in outcomes if o.status is Status.NOT_CONVERGED] == []


@pytest.mark.parametrize("seed", [36, 57])  # not solved with twelve tries instead of MAX_TRIES
def test_a_hold_that_needs_many_tries_is_solved(seed: int) -> None:
    got = fuzz.outcome("protocol", seed)
    assert not got.faults
    assert got.status is not Status.NOT_CONVERGED


def not_a_number(s: Solution) -> Solution:
    return replace(s, voltage_V=s.voltage_V * np.nan)


def an_atom_lost(s: Solution) -> Solution:
    return replace(s, audit=replace(s.audit, relative_error=2e-9))


def a_coulomb_lost(s: Solution) -> Solution:
    return replace(s, charge_C=s.charge_C + 1.0)


def a_sample_lost(s: Solution) -> Solution:
    return replace(s, time_s=s.time_s[:-1])


@pytest.mark.parametrize(
    ("harm", "said"),
    [
        (not_a_number, "voltage_V is not finite"),
        (an_atom_lost, "lithium wrong"),
        (a_coulomb_lost, "charge wrong"),
        (a_sample_lost, "samples"),
    ],
)
def test_a_fault_is_seen(monkeypatch: pytest.MonkeyPatch, harm, said: str) -> None:
    done = next(s for s in range(20) if fuzz.outcome("flight", s).status is Status.DONE)
    real = fuzz.solution_of
    monkeypatch.setattr(fuzz, "solution_of", lambda *a: harm(real(*a)))
    assert any(said in fault for fault in fuzz.outcome("flight", done).faults)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_hang_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though a callback swallows the alarm: this one, or one of the garbage collector's."""
    monkeypatch.setattr(fuzz, "LIMIT_S", 0.05)
    swallowed = []

    def hang(_: object) -> None:
        while True:
            try:
                time.sleep(1e-3)
            except TimeoutError:  # as a callback of C would
                if swallowed:
                    raise
                swallowed.append(True)

    monkeypatch.setattr(fuzz, "fly", hang)
    assert "TimeoutError: not done" in fuzz.outcome("flight", 0).faults[0]
