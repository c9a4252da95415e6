"""Without a pack file: the pack as this flight's own voltage shows it."""

from dataclasses import replace

from analyze.replaying import gaps_of, in_flight, measured_V, replay
from analyze.start import pack_of
from flightlogs.errors import LogWarning
from flightlogs.recording import Recording
from reports.flight import Fitting, PackUse
from reports.quantity import ampere_hours, celsius, fixed, significant
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.flight import FlightFit, NotFitted, fit_flight
from twin.calibrate.flight_problem import ENDURANCE_S, Flown, Known
from twin.cell import Cell
from twin.effects import SelfHeating
from twin.mismatch import START_SOC
from twin.replay import Replay

BELOW_BOARD_K = 8.0
"""A board is hardly colder than the air, and a pack in use not much colder than that. The one log
with both has 5.5 degC at least on the board, in flight, and 10.1 in the pack."""
BRIDGED_SHARE = 0.05  # of the charge, in gaps: more, and the charge was not measured


def fitted(
    recording: Recording, use: PackUse, cell: Cell, played: Replay
) -> tuple[PackUse, Replay]:
    """The pack and its replay after a fit to the flight; `played` is the replay before it.

    Where the flight cannot be fitted, or the replay would be none the better, the pack stays.
    """
    outcome = _outcome(recording, use, cell, played)
    fitting = Fitting(outcome=outcome, before_V=played.rmse_V)
    if isinstance(outcome, NotFitted):
        return replace(use, fitting=fitting), played
    changed = replace(_changed(use, outcome), fitting=fitting)
    after = replay(recording, changed, cell)
    if not _better(after, played):
        refused = NotFitted("the whole replay would be no better with what a fit finds")
        return replace(use, fitting=replace(fitting, outcome=refused)), played
    return changed, after


def doubts_of_fit(recording: Recording, use: PackUse) -> tuple[LogWarning, ...]:
    """What the log says against a fit to it."""
    board_K = recording.board_K
    if use.fit is None or board_K is None or use.initial_K > board_K - BELOW_BOARD_K:
        return ()
    text = (
        f"The fit puts the pack at {celsius(use.initial_K)} °C, but the autopilot's barometer was "
        f"never colder than {celsius(board_K)} °C: such cold stands for something else in this "
        "pack, as age or another chemistry, and its damage is that of so cold a pack. State its "
        "temperature in a pack file."
    )
    return (LogWarning(code="colder_than_board", message=text),)


def _outcome(
    recording: Recording, use: PackUse, cell: Cell, played: Replay
) -> FlightFit | NotFitted:
    codes = {w.code for w in recording.warnings}
    if "simulated_log" in codes:
        return NotFitted("its battery is a simulator's formula")
    bridged = abs(gaps_of(recording).charge_C) > BRIDGED_SHARE * abs(played.load.charge_C())
    known = Known(
        soc=use.soc_known,
        capacity=use.capacity_known,
        temperature=use.temperature_known,
        scale="current_scale_doubtful" not in codes,
        charge=not bridged and "coulomb_mismatch" not in codes,
    )
    flown = Flown(load=played.load, voltage_V=measured_V(recording), in_air=in_flight(recording))
    return fit_flight(pack_of(use, cell), flown, known)


def _better(after: Replay, before: Replay) -> bool:
    """It comes as far, with a smaller error."""
    if after.rmse_V is None or before.rmse_V is None:
        return False
    return after.solution.stopped_s >= before.solution.stopped_s and after.rmse_V < before.rmse_V


def _changed(use: PackUse, fit: FlightFit) -> PackUse:
    """The numbers of the fit in place of those before, with where they come from."""
    pack, found = fit.pack, {e.name: e for e in fit.estimates if e.verdict is not Verdict.PRIOR}
    origins = dict(use.origins)
    for name, estimate in found.items():
        if name in origins:
            origins[name] = _origin(estimate, use)
    if not use.capacity_known and "capacity_C" not in found:
        origins["capacity_C"] = (
            f"not known: taken to last {ENDURANCE_S / 60:.0f} min of this flight"
        )
    if "initial_K" in found:
        origins["ambient_K"] = "not known: that of the pack at the start"
    (heating,) = (e for e in pack.effects if isinstance(e, SelfHeating))
    return replace(
        use,
        capacity_C=use.capacity_C if pack.capacity_C is None else pack.capacity_C,
        capacity_known=use.capacity_known or "capacity_C" in found,
        initial_soc=pack.initial_soc,
        soc_std=max(START_SOC, found["initial_soc"].std) if "initial_soc" in found else use.soc_std,
        initial_K=pack.initial_K,
        ambient_K=fit.ambient_K,
        heat_transfer_W_m2_K=heating.heat_transfer_W_m2_K,
        effects=pack.effects,
        origins=origins,
    )


def _origin(estimate: Estimate, use: PackUse) -> str:
    """In words: fitted, how well, and what stood there before."""
    std, was = {
        "initial_soc": (
            f"{fixed(100 * estimate.std, 1)} %", f"{fixed(100 * use.shown_soc, 1)} %",
        ),
        "capacity_C": (
            f"{ampere_hours(estimate.std, 2)} Ah", f"{ampere_hours(use.capacity_C, 2)} Ah",
        ),
        "initial_K": (f"{fixed(estimate.std, 1)} °C", f"{celsius(use.initial_K)} °C"),
        "heat_transfer_W_m2_K": (
            significant(estimate.std, 2), significant(use.heat_transfer_W_m2_K),
        ),
    }[estimate.name]  # fmt: skip
    return f"fitted to this flight, ± {std}; before {was}, {use.origins[estimate.name]}"
