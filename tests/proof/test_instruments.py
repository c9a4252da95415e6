"""What a laboratory knows of its instruments, as a question tells it."""

from dataclasses import replace

import pytest

from proof.recorded.instruments import by_cycler, by_thermocouple
from tests.twin.mismatch.recordings import flown
from twin.mismatch.hypothesis import HYPOTHESES
from twin.pack_physics import check_standard_errors


def test_faults_of_a_cycler_are_believed_no_further_than_its_maker_states() -> None:
    plain = flown(seed=1).pack
    known = by_cycler(replace(plain, standard_errors={"reaction_kinetics": {"x": 1.0}}))
    assert known.standard_errors["reaction_kinetics"] == {"x": 1.0}
    stds = {
        h.id: after.prior_std
        for h in HYPOTHESES
        for before, after in zip(h.priors(plain), h.priors(known), strict=True)
        if after != before
    }
    assert stds == pytest.approx({
        "current_gain": 5e-3, "voltage_gain": 1e-3, "current_offset": 0.022,
        "sensor_lag": 0.02, "clock_shift": 0.02,
    })  # fmt: skip
    check_standard_errors(by_cycler(plain).standard_errors)


def test_a_temperature_that_was_measured_is_believed_within_the_error_of_a_thermocouple() -> None:
    plain = by_cycler(flown(seed=1).pack)
    known = by_thermocouple(plain)
    (cold,) = (h for h in HYPOTHESES if h.id == "cold_pack")
    assert [p.prior_std for p in cold.priors(plain)] == [15.0, 15.0]
    assert [p.prior_std for p in cold.priors(known)] == [1.0, 1.0]
    assert {*known.standard_errors} == {*plain.standard_errors, "cold_pack"}
    check_standard_errors(known.standard_errors)
