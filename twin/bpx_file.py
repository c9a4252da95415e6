"""BPX text -> `Cell`: Battery Parameter eXchange, every version the bpx package reads."""

import json
import math
import warnings
from typing import Any

import casadi as ca
import pydantic

from twin.at_rest import open_circuit_V
from twin.bpx_function import Constant, Expression, ExpressionError, Table
from twin.cell import Cell, Electrode, Electrolyte, Function, Hysteresis, Separator

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)  # bpx calls pyparsing by its old names
    import bpx
    from bpx import schema

DEFAULT_REFERENCE_K = 298.15
DEFAULT_SALT_mol_m3 = 1000.0  # what a file without a State section means to PyBaMM too
ROUNDING = 1e-3  # of volume fractions in a file
VOLTAGE_TOLERANCE_V = 1e-3  # of the BPX package, between stoichiometry window and cut-offs

THERMAL = {  # optional in BPX, needed here: field -> what is typical, for the message
    "volume": "Volume [m3] (coated area x thickness of a pair of electrodes, both foils included)",
    "external_surface_area": "External surface area [m2]",
    "density": "Density [kg.m-3] (lithium-ion: 1800 to 2800)",
    "specific_heat_capacity": "Specific heat capacity [J.K-1.kg-1] (lithium-ion: 800 to 1100)",
}


class CellError(ValueError):
    """The parameters of a cell cannot be used; the text says which, where and why."""


class CellWarning(UserWarning):
    """The parameters can be used; the text says what was assumed or left aside."""


def read_bpx(text: str, *, name: str) -> Cell:
    """The cell that a BPX file describes; CellError if it describes none that we can simulate.

    Used: everything of the DFN parameterisation. Not used: initial state of charge and hysteresis,
    temperatures and heat transfer of the State section (they belong to a pack and a load),
    Validation data. Missing activation energies and entropic coefficients are zero, as the
    standard has it.

    Args:
        text: of the file, JSON.
        name: of the file, for messages, and of the cell where the header has no title.
    """
    document = _document(text, name)
    file = _validated(document, name)
    parts = file.parameterisation
    _note_what_is_left_aside(file, name)
    c = parts.cell
    if missing := [label for field, label in THERMAL.items() if getattr(c, field) is None]:
        raise CellError(f"{name}: Cell lacks {'; '.join(missing)}: add to the file")
    reference_K = c.reference_temperature
    if reference_K is None:
        _warn(f"{name}: Cell has no Reference temperature [K]; {DEFAULT_REFERENCE_K} assumed")
        reference_K = DEFAULT_REFERENCE_K
    electrodes = {
        side: _electrode(getattr(parts, f"{side}_electrode"), f"{name}: {side} electrode")
        for side in ("negative", "positive")
    }
    cell = Cell(
        name=file.header.title or name,
        source=file.header.references or file.header.description or name,
        negative=electrodes["negative"],
        positive=electrodes["positive"],
        separator=Separator(
            thickness_m=parts.separator.thickness,
            porosity=parts.separator.porosity,
            transport_efficiency=parts.separator.transport_efficiency,
        ),
        electrolyte=_electrolyte(file, name),
        area_m2=c.electrode_area * c.number_of_electrodes,
        nominal_capacity_C=c.nominal_cell_capacity * 3600.0,
        lower_cut_off_V=c.lower_voltage_cutoff,
        upper_cut_off_V=c.upper_voltage_cutoff,
        reference_K=reference_K,
        heat_capacity_J_K=c.specific_heat_capacity * c.density * c.volume,
        cooling_area_m2=c.external_surface_area,
        volume_m3=c.volume,
        negative_hysteresis=_hysteresis(parts.negative_electrode, f"{name}: negative electrode"),
        positive_hysteresis=_hysteresis(parts.positive_electrode, f"{name}: positive electrode"),
    )
    _check_numbers(cell, name)
    _check_functions(cell, name)
    _check_window(cell, name)
    return cell


def _document(text: str, name: str) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except json.JSONDecodeError as e:
        raise CellError(f"{name}: not valid JSON: {e}") from e
    if not isinstance(document, dict) or "Header" not in document:
        raise CellError(f"{name}: JSON without a Header: no BPX file")
    for section in ("Header", "Parameterisation"):
        if not isinstance(document.get(section), dict):
            raise CellError(f"{name}: {section} is missing, or holds no fields")
    for section, content in document["Parameterisation"].items():
        if not isinstance(content, dict):
            raise CellError(f"{name}: {section} holds no fields")
    return document


def _validated(document: dict[str, Any], name: str) -> bpx.BPX:
    """The file as the bpx package reads it, potentials unchecked against the cut-offs.

    The package checks that by writing the potentials to Python files and importing them; here a
    constant stands in while it validates, and `_check_window` does that check.
    """
    sides = [
        document["Parameterisation"].get(f"{side} electrode", {})
        for side in ("Negative", "Positive")
    ]
    potentials = [side.get("OCP [V]") for side in sides]
    try:
        for side, potential in zip(sides, potentials, strict=True):
            if isinstance(potential, str):
                side["OCP [V]"] = 0.0
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            file = bpx.parse_bpx_obj(document)
    except (pydantic.ValidationError, ValueError, TypeError) as e:
        raise CellError(f"{name}: {_first_errors(e)}") from e
    for warning in caught:
        if issubclass(warning.category, UserWarning):
            _warn(f"{name}: {str(warning.message).split('. ')[0]}")
    for side, potential in zip(("negative", "positive"), potentials, strict=True):
        if isinstance(potential, str):
            electrode = getattr(file.parameterisation, f"{side}_electrode")
            electrode.ocp = bpx.Function(potential)
    return file


def _first_errors(error: Exception) -> str:
    if not isinstance(error, pydantic.ValidationError):
        return str(error)
    lines = [
        f"{' / '.join(str(part) for part in e['loc'])}: {e['msg']}" for e in error.errors()[:5]
    ]
    more = error.error_count() - len(lines)
    return "; ".join(lines) + (f"; and {more} more" if more > 0 else "")


def _note_what_is_left_aside(file: bpx.BPX, name: str) -> None:
    if not isinstance(file.parameterisation, schema.Parameterisation):
        raise CellError(
            f"{name}: parameters of a {file.header.model} model; a DFN set is needed "
            "(electrolyte, separator and porous electrodes)"
        )
    user = file.parameterisation.user_defined
    if names := sorted(set((user.model_extra or {}) if user is not None else {})):
        _warn(f"{name}: user-defined parameters are not used: {', '.join(names)}")
    if file.state is not None and file.state.degradation is not None:
        _warn(f"{name}: State / Degradation is not used: the cell is taken as new")


def _electrode(electrode: Any, where: str) -> Electrode:
    if isinstance(electrode, schema.ElectrodeBlended):
        raise CellError(
            f"{where}: a blend of {', '.join(electrode.particle)}; one active material an electrode"
        )
    return Electrode(
        thickness_m=electrode.thickness,
        particle_radius_m=electrode.particle_radius,
        specific_area_m2_m3=electrode.surface_area_per_unit_volume,
        porosity=electrode.porosity,
        transport_efficiency=electrode.transport_efficiency,
        conductivity_S_m=electrode.conductivity,
        diffusivity_m2_s=_function(electrode.diffusivity, f"{where}: Diffusivity"),
        diffusivity_activation_J_mol=electrode.diffusivity_activation_energy or 0.0,
        ocp_V=_function(electrode.ocp, f"{where}: OCP"),
        entropic_V_K=_function(electrode.dudt or 0.0, f"{where}: Entropic change coefficient"),
        max_concentration_mol_m3=electrode.maximum_concentration,
        stoichiometry_min=electrode.minimum_stoichiometry,
        stoichiometry_max=electrode.maximum_stoichiometry,
        rate_constant_mol_m2_s=electrode.reaction_rate_constant,
        rate_activation_J_mol=electrode.reaction_rate_constant_activation_energy or 0.0,
    )


def _electrolyte(file: bpx.BPX, name: str) -> Electrolyte:
    electrolyte = file.parameterisation.electrolyte
    initial = file.state.initial_conditions if file.state is not None else None
    salt = initial.initial_electrolyte_concentration if initial is not None else None
    if salt is None:
        _warn(f"{name}: no Initial electrolyte concentration; {DEFAULT_SALT_mol_m3} mol/m3 assumed")
        salt = DEFAULT_SALT_mol_m3
    where = f"{name}: electrolyte"
    return Electrolyte(
        initial_concentration_mol_m3=salt,
        transference=electrolyte.cation_transference_number,
        conductivity_S_m=_function(electrolyte.conductivity, f"{where}: Conductivity"),
        conductivity_activation_J_mol=electrolyte.conductivity_activation_energy or 0.0,
        diffusivity_m2_s=_function(electrolyte.diffusivity, f"{where}: Diffusivity"),
        diffusivity_activation_J_mol=electrolyte.diffusivity_activation_energy or 0.0,
    )


def _hysteresis(electrode: Any, where: str) -> Hysteresis | None:
    branches = (electrode.ocp_lith, electrode.ocp_delith, electrode.gamma_hys)
    if all(b is None for b in branches):
        return None
    if any(b is None for b in branches):
        raise CellError(
            f"{where}: hysteresis needs OCP (lithiation), OCP (delithiation) and "
            "OCP hysteresis decay constant, or none of them"
        )
    if not 0 <= electrode.gamma_hys < math.inf:
        raise CellError(
            f"{where}: OCP hysteresis decay constant = {electrode.gamma_hys}; 0 or more expected"
        )
    return Hysteresis(
        lithiation_V=_function(electrode.ocp_lith, f"{where}: OCP (lithiation)"),
        delithiation_V=_function(electrode.ocp_delith, f"{where}: OCP (delithiation)"),
        decay=electrode.gamma_hys,
    )


def _function(value: Any, where: str) -> Function:
    try:
        if isinstance(value, bpx.InterpolatedTable):
            return Table(tuple(value.x), tuple(value.y))
        if isinstance(value, str):
            return Expression(str(value))
    except ExpressionError as e:
        raise CellError(f"{where}: {e}") from e
    return Constant(float(value))


def _check_numbers(cell: Cell, name: str) -> None:
    """CellError where a number would make the equations meaningless."""
    if not cell.lower_cut_off_V < cell.upper_cut_off_V:
        raise CellError(
            f"{name}: cut-offs: lower {cell.lower_cut_off_V} V, upper {cell.upper_cut_off_V} V; "
            "lower < upper expected"
        )
    for side in ("negative", "positive"):
        e: Electrode = getattr(cell, side)
        if not 0 <= e.stoichiometry_min < e.stoichiometry_max <= 1:
            raise CellError(
                f"{name}: {side} electrode: stoichiometry from {e.stoichiometry_min} to "
                f"{e.stoichiometry_max}; 0 <= minimum < maximum <= 1 expected"
            )
        solid = e.specific_area_m2_m3 * e.particle_radius_m / 3
        if solid + e.porosity > 1 + ROUNDING:
            raise CellError(
                f"{name}: {side} electrode: pores {e.porosity:.3f} and active material a R / 3 = "
                f"{solid:.3f} exceed the volume"
            )
    for part in (cell, cell.negative, cell.separator, cell.positive, cell.electrolyte):
        for field in part.__dataclass_fields__:
            value = getattr(part, field)
            may_vanish = field.startswith("stoichiometry") or field.endswith("J_mol")
            if isinstance(value, float | int) and not (value > 0 or (may_vanish and value == 0)):
                raise CellError(f"{name}: {field} = {value}; more than zero expected")


def _check_functions(cell: Cell, name: str) -> None:
    """CellError where a function has no usable value at the ends of its range in use."""
    salt = cell.electrolyte
    initial = (salt.initial_concentration_mol_m3,)
    checks: list[tuple[str, Function, tuple[float, ...], bool]] = [
        ("electrolyte: Conductivity", salt.conductivity_S_m, initial, True),
        ("electrolyte: Diffusivity", salt.diffusivity_m2_s, initial, True),
    ]
    for side, e in (("negative", cell.negative), ("positive", cell.positive)):
        ends = (e.stoichiometry_min, e.stoichiometry_max)
        checks += [
            (f"{side} electrode: Diffusivity", e.diffusivity_m2_s, ends, True),
            (f"{side} electrode: OCP", e.ocp_V, ends, False),
            (f"{side} electrode: Entropic change coefficient", e.entropic_V_K, ends, False),
        ]
        if (branches := cell.hysteresis(side)) is not None:
            checks += [
                (f"{side} electrode: OCP (lithiation)", branches.lithiation_V, ends, False),
                (f"{side} electrode: OCP (delithiation)", branches.delithiation_V, ends, False),
            ]
    for what, function, arguments, positive in checks:
        for x in arguments:
            value = _value(function, x)
            if not math.isfinite(value) or (positive and value <= 0):
                raise CellError(
                    f"{name}: {what} is {value} at {x}; a finite value"
                    f"{' above zero' if positive else ''} expected"
                )


def _value(function: Function, x: float) -> float:
    return float(ca.evalf(function(ca.SX(x))))


def _check_window(cell: Cell, name: str) -> None:
    for soc, limit_V, sign in ((1.0, cell.upper_cut_off_V, 1), (0.0, cell.lower_cut_off_V, -1)):
        voltage = open_circuit_V(cell, soc)
        if sign * (voltage - limit_V) > VOLTAGE_TOLERANCE_V:
            _warn(
                f"{name}: {voltage:.4f} V at the {100 * soc:.0f} % end of the stoichiometry "
                f"window, beyond the cut-off at {limit_V} V"
            )


def _warn(text: str) -> None:
    warnings.warn(text, CellWarning, stacklevel=4)
