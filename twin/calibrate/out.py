"""A calibration as files: the cell (BPX), the pack that has it, the fit (JSON)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from twin.bpx_out import scaled, write_bpx
from twin.bumps import is_bump, settled
from twin.calibrate.answer import Combination, Estimate
from twin.calibrate.asked import asked_by
from twin.calibrate.checks import Fitted, stated_error_V
from twin.calibrate.objective import Problem
from twin.calibrate.ocp_correction import Correction
from twin.calibrate.run import Calibration
from twin.cell import Cell, Electrode
from twin.effects import SeriesResistance, WeakCell
from twin.pack import Pack
from twin.pack_file import PackFile

FloatArray = npt.NDArray[np.float64]

FIT_VERSION = 1
TRANSFER, TRANSFER_STD = "heat_transfer_W_m2_K", "heat_transfer_std_W_m2_K"


def calibrated_cell(found: Calibration) -> Cell:
    """The cell with its calibrated numbers; a resistance in series belongs to the pack."""
    return cell_of(found.problem, found.q)


def cell_of(problem: Problem, q: FloatArray) -> Cell:
    """The same of a fit that goes on; `q` (k,) its coordinates."""
    pack, numbers = problem.pack, problem.numbers(q)
    cell, base = settled(pack.cell, numbers), pack.cell_parameters()
    salt = cell.electrolyte
    return replace(
        cell,
        name=f"{cell.name}, calibrated",
        negative=_electrode(cell.negative, "negative", numbers),
        positive=_electrode(cell.positive, "positive", numbers),
        separator=replace(
            cell.separator,
            porosity=numbers["separator.porosity"],
            transport_efficiency=numbers["separator.transport_efficiency"],
        ),
        electrolyte=replace(
            salt,
            initial_concentration_mol_m3=numbers["electrolyte.initial_concentration_mol_m3"],
            diffusivity_m2_s=scaled(
                salt.diffusivity_m2_s, numbers["electrolyte.diffusivity_factor"]
            ),
            diffusivity_activation_J_mol=numbers.get(
                "electrolyte.diffusivity_activation_J_mol", salt.diffusivity_activation_J_mol
            ),
            conductivity_activation_J_mol=numbers.get(
                "electrolyte.conductivity_activation_J_mol", salt.conductivity_activation_J_mol
            ),
        ),
        nominal_capacity_C=problem.values_by_name(q)["capacity_C"],
        area_m2=base["area_m2"],
        heat_capacity_J_K=numbers.get("heat_capacity_J_K", base["heat_capacity_J_K"]),
        cooling_area_m2=base["cooling_area_m2"],
        volume_m3=cell.volume_m3 * pack.scale,
    )


def cell_text(found: Calibration) -> str:
    """The calibrated cell as BPX."""
    tests = ", ".join(t.name for t in found.fitted)
    description = f"{found.problem.pack.cell.name}, calibrated to {tests}"
    return write_bpx(calibrated_cell(found), description=description)


def pack_text(  # noqa: PLR0913
    found: Calibration, pack: Pack, file: PackFile, *, cell: str, weak: Sequence[WeakCell] = (),
    standard_errors: Mapping[str, Mapping[str, float]] | None = None,
) -> str:  # fmt: skip
    """The pack file of `pack` with the calibrated cell in the file `cell` beside it.

    `weak` are the cells that differ from it; `standard_errors` as in `Pack`.
    """
    content = file.model_dump(exclude_none=True)
    capacity_C = found.problem.values_by_name(found.q)["capacity_C"] * pack.parallel
    content["pack"] |= {"cell": cell, "capacity_ah": capacity_C / 3600.0}
    resistance = found.numbers["series_resistance_ohm"] * pack.series / pack.parallel
    physics = [id_ for id_ in (e.id for e in pack.effects) if id_ != SeriesResistance.id]
    content["twin"]["physics"] = [*dict.fromkeys(physics), SeriesResistance.id]
    content["twin"].pop("cell_error_mv", None)  # of another calibration
    if error_V := stated_error_V(found.fitted):
        content["twin"]["cell_error_mv"] = float(f"{1e3 * error_V:.4g}")
    content["effects"] = content["effects"] | {SeriesResistance.id: {"resistance_ohm": resistance}}
    if TRANSFER in found.numbers:
        (told,) = (e for e in found.answer.estimates if e.name == TRANSFER)
        cooling = {TRANSFER: told.value, TRANSFER_STD: told.std}
        content["environment"] = content["environment"] | cooling
    if weak:
        content["twin"]["physics"].append(WeakCell.id)
        content["effects"][WeakCell.id] = [asdict(w) for w in weak]
    return toml_text(content | {"standard_errors": standard_errors or {}})


def toml_text(content: Mapping[str, Any], above: str = "") -> str:
    """TOML of nested tables and lists of tables, of text, numbers, truth values and lists."""
    own = {k: v for k, v in content.items() if not isinstance(v, Mapping) and not _tables(v)}
    lines = [f"{k} = {_toml(v)}" for k, v in own.items()]
    head = [f"[{above}]"] if above and own else []
    text = "\n".join([*head, *lines]) + ("\n\n" if own else "")
    for name, table in content.items():
        path = f"{above}.{name}" if above else name
        if isinstance(table, Mapping) and table:
            text += toml_text(table, path)
        for one in table if _tables(table) else ():
            text += toml_text(one, f"[{path}]")
    return text


def _toml(value: Any) -> str:
    """As in JSON, which leaves one character as it is that TOML does not."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _tables(value: Any) -> bool:
    """A list of tables."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)


def fit_text(found: Calibration, more: Mapping[str, Any] | None = None) -> str:
    """Everything that is known of the fit, as JSON; `values` is what a later fit may go on from.

    `more` is what was found beside the cell.
    """
    told = found.answer
    document = {
        "version": FIT_VERSION,
        "values": found.problem.values_by_name(found.q),
        "parameters": [_estimate(e) for e in told.estimates],
        "held": told.held,
        "derived": [_estimate(e) for e in told.derived],
        "correlations": {"names": told.names, "matrix": np.round(told.correlations, 4).tolist()},
        "stiff": [combination(c) for c in told.stiff],
        "sloppy": [combination(c) for c in told.sloppy],
        "tests": [
            _test(f) | {"correlated_samples": told.correlated_samples[f.name]} for f in found.fitted
        ],
        "advice": [
            {"test": a.name, "gain_nats": a.gain, "helps": dict(a.helps)} for a in found.advice
        ],
        "ocp_correction": _correction(found.correction),
        "information": {
            "tests": found.information.tests,
            "effect_mV": _by_test(1e3 * found.information.effect_V, found),
            "left_of_prior_alone": _by_test(found.information.alone, found),
        },
        "asked": asdict(asked_by([test.load for test in found.problem.tests])),
        "remarks": found.remarks,
        "missing": found.missing,
    }
    return json.dumps(document | dict(more or {}), indent=2, allow_nan=False) + "\n"


def _electrode(electrode: Electrode, side: str, numbers: Mapping[str, float]) -> Electrode:
    own: dict[str, Any] = {
        name.removeprefix(f"{side}."): value
        for name, value in numbers.items()
        if name.startswith(f"{side}.") and not is_bump(name)
    }
    factor = own.pop("diffusivity_factor")
    return replace(electrode, diffusivity_m2_s=scaled(electrode.diffusivity_m2_s, factor), **own)


def _estimate(e: Estimate) -> dict[str, Any]:
    return {
        "name": e.name, "unit": e.unit, "value": e.value, "std": e.std, "lower_90": e.lower,
        "upper_90": e.upper, "prior": e.prior if np.isfinite(e.prior) else None,
        "left_of_prior": e.left_of_prior, "verdict": e.verdict.name.lower(),
    }  # fmt: skip


def combination(c: Combination) -> dict[str, Any]:
    """As JSON has it."""
    return {"std": min(c.std, 1e9), "loadings": dict(c.loadings)}


def _by_test(values: FloatArray, found: Calibration) -> dict[str, list[float]]:
    """Parameter -> a number for each test; (tests, k) `values`."""
    return {n: v.tolist() for n, v in zip(found.information.names, values.T, strict=True)}


def _test(f: Fitted) -> dict[str, Any]:
    by_soc = [1e3 * v if np.isfinite(v) else None for v in f.rms_by_soc_V().tolist()]
    return {
        "name": f.name,
        "rms_mV": _mV(f.rms_V),
        "held_out_rms_mV": None if f.held_out_rms_V is None else _mV(f.held_out_rms_V),
        "noise_mV": 1e3 * f.noise_V,
        "rms_by_soc_mV": by_soc,
    }


def _correction(c: Correction | None) -> dict[str, Any] | None:
    if c is None:
        return None
    soc, added_V = c.along()
    return {
        "electrode": "positive", "test": c.test, "evidence": c.gain, "rms_mV": 1e3 * c.rms_V,
        "corrected_rms_mV": 1e3 * c.corrected_rms_V,
        "soc": soc[::5].round(3).tolist(), "added_mV": (1e3 * added_V[::5]).round(3).tolist(),
        "bumps": {
            "stoichiometry": c.potential.centres, "width": c.potential.width,
            "height_mV": [1e3 * v for v in c.heights_V], "std_mV": [1e3 * v for v in c.stds_V],
        },
    }  # fmt: skip


def _mV(value_V: float) -> float | None:
    """Null where the simulation did not come to the end."""
    return 1e3 * value_V if np.isfinite(value_V) else None
