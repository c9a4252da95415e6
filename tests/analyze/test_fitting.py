"""What the log's doubts make of a fit, and that a pack which is no better is not taken."""

from dataclasses import replace

import numpy as np
import pytest

from analyze import fitting
from analyze.pack_choice import cell_of
from analyze.replaying import replay
from analyze.start import pack_use
from flightlogs.errors import LogWarning
from flightlogs.recording import Recording
from reports.flight import Fitting, PackUse
from tests.reports import example
from twin.calibrate.flight import FlightFit, NotFitted
from twin.calibrate.flight_problem import Flown, Known
from twin.effects import SelfHeating
from twin.mismatch import START_SOC, UNTOLD
from twin.pack import Pack

CELL, _ = cell_of("lipo_2200")
NEVER_AT_REST = {"in_air": example.T >= 0, "resistance_ohm": None}


class Fit:
    """Stands in for `fit_flight`, and remembers what it was told."""

    def __init__(self, *, soc_std: float = 0.004, **changes: object) -> None:
        self.soc_std, self.changes = soc_std, changes
        self.known: Known | None = None

    def __call__(self, pack: Pack, flown: Flown, known: Known) -> FlightFit:
        self.known = known
        changed = replace(pack, **({"initial_soc": 0.8} | self.changes))
        fit = example.flight_fit()
        told = tuple(
            replace(e, std=self.soc_std) if e.name == "initial_soc" else e for e in fit.estimates
        )
        return replace(fit, pack=changed, ambient_K=flown.load.ambient_K, estimates=told)


def fitted(
    monkeypatch: pytest.MonkeyPatch, fit: Fit, recording: Recording
) -> tuple[PackUse, PackUse]:
    """The pack before and after."""
    monkeypatch.setattr(fitting, "fit_flight", fit)
    use = pack_use(recording, None, CELL, builtin=True)
    return use, fitting.fitted(recording, use, CELL, replay(recording, use, CELL))[0]


def answering(soc: float, **changes: object) -> Recording:
    """A flight whose voltage is that of the twin at this state of charge."""
    use = replace(pack_use(example.recording(), None, CELL, builtin=True), initial_soc=soc)
    voltage = replay(example.recording(), use, CELL).solution.voltage_V
    return example.recording(voltage_V=voltage, **changes)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, {}),
        ({"warnings": (LogWarning("current_scale_doubtful", ""),)}, {"scale": False}),
        ({"warnings": (LogWarning("coulomb_mismatch", ""),)}, {"charge": False}),
        ({"capacity_C": None}, {"capacity": False}),
        ({"temperature_K": np.full(example.T.size, 285.0)}, {"temperature": True}),
        (NEVER_AT_REST, {"soc": False}),
    ],
)
def test_what_is_doubtful_reaches_the_fit(
    monkeypatch: pytest.MonkeyPatch, changes: dict, expected: dict
) -> None:
    fit = Fit()
    fitted(monkeypatch, fit, answering(0.8, **changes))
    usual = {"soc": True, "capacity": True, "temperature": False, "scale": True, "charge": True}
    assert fit.known == Known(**(usual | expected))


def test_charge_in_long_gaps_is_no_measured_charge(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, fit = answering(0.8), Fit()
    kept = (example.T < 20) | (example.T > 26)
    cut = {
        name: getattr(whole, name)[kept]
        for name in (
            "time_s", "current_A", "voltage_V", "velocity_m_s", "velocity_setpoint_m_s", "in_air",
        )
    }  # fmt: skip
    fitted(monkeypatch, fit, example.recording(**cut))
    assert fit.known is not None
    assert not fit.known.charge


def test_the_fitted_numbers_are_used_and_their_origin_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    warm = (SelfHeating(heat_transfer_W_m2_K=20.0),)
    before, after = fitted(monkeypatch, Fit(effects=warm), answering(0.8))
    assert after.fit is not None
    assert after.initial_soc == 0.8
    assert after.heat_transfer_W_m2_K == 20.0
    assert after.effects == warm
    was = f"before {100 * before.initial_soc:.1f} %, from the voltage at rest"
    assert after.origins["initial_soc"].startswith(f"fitted to this flight, ± 0.4 %; {was}")
    # this one was not told by the flight
    assert after.origins["heat_transfer_W_m2_K"] == before.origins["heat_transfer_W_m2_K"]


def test_a_worse_replay_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    before, after = fitted(monkeypatch, Fit(initial_soc=0.3), answering(0.8))
    assert after.fit is None
    assert after.fitting is not None
    assert isinstance(after.fitting.outcome, NotFitted)
    assert replace(after, fitting=None) == before


def test_a_simulators_battery_is_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = Fit()
    simulated = answering(0.8, warnings=(LogWarning("simulated_log", ""),))
    _, after = fitted(monkeypatch, fit, simulated)
    assert fit.known is None
    assert after.fitting is not None
    assert after.fitting.outcome == NotFitted("its battery is a simulator's formula")


@pytest.mark.parametrize(("board_K", "said"), [(299.0, True), (280.0, False), (None, False)])
def test_a_fit_colder_than_the_barometer_ever_was_is_owned_up_to(
    board_K: float | None,
    said: bool,  # noqa: FBT001
) -> None:
    recording = example.recording(board_K=board_K)
    use = replace(pack_use(recording, None, CELL, builtin=True), initial_K=275.15)
    assert not fitting.doubts_of_fit(recording, use)  # nothing was fitted
    fit = Fitting(outcome=example.flight_fit(), before_V=0.1)
    doubts = fitting.doubts_of_fit(recording, replace(use, fitting=fit))
    assert [w.code for w in doubts] == ["colder_than_board"] * said
    assert all("at 2.0 °C, but" in w.message for w in doubts)


@pytest.mark.parametrize(("found", "std"), [(0.004, 0.004), (1e-5, START_SOC)])
def test_a_start_that_nobody_told_is_known_as_well_as_the_fit_tells_it(
    monkeypatch: pytest.MonkeyPatch, found: float, std: float
) -> None:
    fit = Fit(soc_std=found)
    before, after = fitted(monkeypatch, fit, answering(0.8, **NEVER_AT_REST))
    assert (before.soc_std, before.soc_known) == (UNTOLD, False)
    assert fit.known is not None
    assert not fit.known.soc
    assert after.fit is not None
    assert (after.soc_std, after.soc_known) == (std, True)
