"""`FlightReport` -> `Result`: the numbers of a page for programs to read."""

from collections.abc import Iterable

import numpy as np

from reports.damage import assessment_part, damage_part, relative_part
from reports.flight import ASSESSED, FlightReport, NoMismatch
from reports.motions import in_flight_s, motion_loads
from reports.parts import (
    AlignmentPart,
    FitErrorsPart,
    FitPart,
    FlightPart,
    GapsPart,
    LithiumPart,
    LoadPart,
    MismatchPart,
    MotionPart,
    MotionsPart,
    PackPart,
    ParametersPart,
    ProvenancePart,
    QualityPart,
    QuantityPart,
    ReplayPart,
    SegmentPart,
    WarningPart,
)
from reports.result import Result
from segment.segment import LoadStatistics, Segment
from twin.calibrate.flight import NotFitted
from twin.constants import ZERO_CELSIUS_K
from twin.finite import finite
from twin.mismatch import Finding, finding_json
from twin.replay import Replay


def result_of(report: FlightReport, files: Iterable[str] = ()) -> Result:
    """All that `result.json` says of a flight; charges in Ah, temperatures in degrees Celsius.

    Args:
        report: the flight.
        files: names of those that are written with it.
    """
    return Result(
        flight=_flight(report),
        pack=_pack(report),
        quality=_quality(report),
        alignment=_alignment(report),
        segments=tuple(_segment(s) for s in report.segments),
        motions=_motions(report),
        replay=_replay(report.replay),
        assessment=assessment_part(report.damage, report.profiles),
        mismatch=_mismatch(report.mismatch),
        provenance=_provenance(report, tuple(sorted(files))),
    )


def _mismatch(found: Finding | NoMismatch) -> MismatchPart | None:
    if isinstance(found, NoMismatch):
        return None
    return MismatchPart.model_validate(finding_json(found))


def _flight(report: FlightReport) -> FlightPart:
    log = report.log
    return FlightPart(
        file=log.name,
        sha256=report.provenance.sha256,
        format=log.format,
        firmware=log.firmware,
        vehicle=log.vehicle.value,
        start_utc=log.start_utc,
        duration_s=log.duration_s,
        in_air_s=in_flight_s(report.segments),
    )


def _pack(report: FlightReport) -> PackPart:
    pack, recording = report.pack, report.recording
    return PackPart(
        name=pack.name,
        battery=recording.battery,
        other_batteries=recording.other_batteries,
        serial=pack.serial,
        cell=pack.cell,
        calibrated=pack.calibrated,
        series=pack.series,
        series_inferred=pack.series_inferred,
        parallel=pack.parallel,
        capacity_ah=pack.capacity_C / 3600,
        rated_ah=None if pack.rated_C is None else pack.rated_C / 3600,
        origins=dict(pack.origins),
        fit=_fit(report),
        fit_refusal=pack.fitting.outcome.reason
        if pack.fitting and isinstance(pack.fitting.outcome, NotFitted)
        else "",
    )


def _fit(report: FlightReport) -> FitPart | None:
    fitting, fit = report.pack.fitting, report.pack.fit
    if fitting is None or fit is None:
        return None
    return FitPart(
        quantities=tuple(
            QuantityPart.model_validate(
                {
                    "name": e.name,
                    "value": e.value,
                    "std": e.std,
                    "lower": e.lower,
                    "upper": e.upper,
                    "unit": e.unit,
                    "assumed": e.prior,
                    "verdict": e.verdict.name.lower(),
                }
            )
            for e in (*fit.estimates, fit.pulse)
        ),
        rmse_mv=FitErrorsPart(
            before=_milli(fitting.before_V),
            after=_milli(report.replay.rmse_V),
            holdout_before=1000 * fit.held_out_before_V,
            holdout_after=1000 * fit.held_out_after_V,
        ),
        independent_samples=fit.independent_samples,
    )


def _quality(report: FlightReport) -> QualityPart:
    recording, gaps, said = report.recording, report.gaps, report.recording.warnings
    resistance = recording.resistance_ohm
    return QualityPart(
        warnings=(
            *(WarningPart(code=w.code, message=w.message, where=w.where) for w in said),
            *_not_judged(report),
        ),
        dropouts_s=report.log.dropouts_s,
        recovered_fraction=report.log.recovered_fraction,
        coulomb_check=finite(recording.coulomb_check),
        resistance_mohm=None if resistance is None else finite(1000 * resistance),
        gaps=GapsPart(
            count=gaps.count,
            total_s=gaps.total_s,
            longest_s=gaps.longest_s,
            bridged_charge_ah=gaps.charge_C / 3600,
        ),
        current_source="sensor" if recording.current_source == "sensor" else "autopilot",
    )


def _not_judged(report: FlightReport) -> tuple[WarningPart, ...]:
    """Why `assessment`, or `mismatch`, is null."""
    reasons = {
        "no_damage": report.no_damage,
        "no_mismatch": report.mismatch.reason if isinstance(report.mismatch, NoMismatch) else "",
    }
    return tuple(WarningPart(code=c, message=text, where="") for c, text in reasons.items() if text)


def _alignment(report: FlightReport) -> AlignmentPart | None:
    fit = report.recording.alignment
    if fit is None:
        return None
    return AlignmentPart(
        method=fit.method,
        offset_s=fit.offset_s,
        drift_ppm=fit.drift_ppm,
        correlation=fit.correlation,
        uncertainty_s=fit.uncertainty_s,
        drift_uncertainty_ppm=fit.drift_uncertainty_ppm,
        gain=fit.gain,
        bias_a=fit.bias_A,
    )


def _load(load: LoadStatistics) -> LoadPart:
    return LoadPart(
        charge_ah=load.charge_C / 3600,
        energy_wh=finite(load.energy_J / 3600),
        mean_current_a=load.mean_A,
        rms_current_a=load.rms_A,
        p99_current_a=finite(load.p99_A),
        ripple_a=load.ripple_A,
    )


def _segment(segment: Segment) -> SegmentPart:
    return SegmentPart(
        **_load(segment.load).model_dump(),
        motion=segment.motion.value,
        start_s=segment.start_s,
        stop_s=segment.stop_s,
        basis=segment.basis.value,
    )


def _motions(report: FlightReport) -> MotionsPart:
    loads = motion_loads(report.recording, report.segments)
    parts = {
        motion.value: (
            MotionPart(
                **_load(loads[motion].load).model_dump(),
                time_s=loads[motion].time_s,
                damage=damage_part(report.damage, motion.value),
                relative_to_constant_current=relative_part(report.damage, motion.value),
            )
            if motion in loads
            else None
        )
        for motion in ASSESSED
    }
    return MotionsPart.model_validate(parts)


def _replay(replay: Replay) -> ReplayPart:
    solution, audit = replay.solution, replay.solution.audit
    started = bool(solution.time_s.size)
    return ReplayPart(
        voltage_rmse_mv=_milli(replay.rmse_V),
        max_error_mv=_milli(replay.max_error_V),
        final_soc=float(solution.soc[-1]) if started else None,
        max_temperature_c=float(np.max(solution.temperature_K)) - ZERO_CELSIUS_K
        if started
        else None,
        lithium_audit=LithiumPart(
            negative_mol=_pair(audit.negative_mol),
            positive_mol=_pair(audit.positive_mol),
            electrolyte_mol=_pair(audit.electrolyte_mol),
            lost_mol={name: _pair(mol) for name, mol in audit.lost_mol.items()},
            relative_error=audit.relative_error,
            charge_error_c=audit.charge_error_C,
        ),
        status=solution.status.name.lower(),
        status_text=solution.status.value,
        simulated_s=solution.stopped_s - float(replay.load.time_s[0]),
    )


def _provenance(report: FlightReport, files: tuple[str, ...]) -> ProvenancePart:
    made, pack = report.provenance, report.pack
    return ProvenancePart(
        version=made.version,
        cell=pack.cell_source,
        parameters=ParametersPart(
            initial_soc=pack.shown_soc,
            initial_temperature_c=pack.initial_K - ZERO_CELSIUS_K,
            ambient_c=pack.ambient_K - ZERO_CELSIUS_K,
            heat_transfer_W_m2_K=pack.heat_transfer_W_m2_K,
            physics=pack.effect_ids,
            inputs_sha256=made.inputs_sha256,
        ),
        solver=made.solver,
        seconds=made.seconds,
        files=files,
    )


def _pair(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _milli(value: float | None) -> float | None:
    return None if value is None else 1000 * value
