"""What a laboratory knows of its instruments, as a question tells it."""

from dataclasses import replace

import pytest

from proof.recorded.instruments import by_cycler
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
