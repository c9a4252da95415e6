"""By how much a calibrated twin is said to err."""

import numpy as np
import pytest

from twin.calibrate.checks import Fitted, own_error_V, stated_error_V

TIME_S = np.arange(100.0)
MEASURED_V = 4.0 - 0.01 * TIME_S


def with_prediction(predicted_V: np.ndarray | None) -> Fitted:
    return Fitted(
        name="1C", time_s=TIME_S, current_A=np.ones(100), measured_V=MEASURED_V,
        simulated_V=MEASURED_V + 0.003, soc=1 - TIME_S / 100, noise_V=0.0, held_out_V=predicted_V,
    )  # fmt: skip


def test_a_prediction_that_is_empty_too_soon_counts_by_where_it_ended() -> None:
    """By the fit to it, a few millivolts, the worst of all predictions would not show."""
    early_V = np.where(TIME_S < 80, MEASURED_V, np.nan)
    missed_V = np.where(TIME_S < 80, 0.0, 0.01 * (TIME_S - 79))
    error_V = float(np.sqrt(np.mean(missed_V**2)))
    assert own_error_V([with_prediction(early_V)]) == pytest.approx(error_V)
    assert error_V > 0.04
    other_V = MEASURED_V + 0.01
    both_V = float(np.sqrt((error_V**2 + 0.01**2) / 2))
    assert stated_error_V([with_prediction(early_V), with_prediction(other_V)]) == pytest.approx(
        both_V
    )


def test_what_nobody_predicted_counts_by_its_fit_and_is_no_statement() -> None:
    """As after an interrupt while tests are predicted: the rest would make the error look small."""
    alone, far = with_prediction(None), with_prediction(MEASURED_V + 0.03)
    assert own_error_V([alone]) == pytest.approx(0.003)
    assert stated_error_V([alone]) is None
    assert stated_error_V([far, alone, alone, alone]) == pytest.approx(0.03)
    none, exact = with_prediction(np.full(100, np.nan)), with_prediction(MEASURED_V)
    assert stated_error_V([none]) is None
    assert stated_error_V([exact]) is None
    assert stated_error_V([none, far]) == pytest.approx(0.03)
