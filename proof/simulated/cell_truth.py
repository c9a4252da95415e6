"""What one cell truly is: numbers, of which PyBaMM's terms are made in `dfn.py`."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class CellTruth:
    """A cell as it is; the defaults are the cell of the file. Its `repr` says all there is.

    Attributes:
        cell: built-in BPX file.
        soc: at the start, of the window between the file's voltages at rest.
        start_K: temperature at the start; without heat it is that of the air.
        ambient_K: of the air.
        heat_transfer_W_m2_K: to the air; None is isothermal.
        scaled: PyBaMM parameter (number or function) and what it is multiplied with.
        lithium_left: cyclable lithium of the full cell over that of the file.
        material_left: active material of the two electrodes over that of the file, lost when full.
        film_ohm_m2: of a film on the negative particles.
        contact_ohm: in series.
        plated_mol_m3: metallic lithium at the start, which strips reversibly; None: no plating.
        half_gap_V: between the branches of the two electrodes; None: no hysteresis.
        double_layer_F_m2: in both electrodes; None: none.
        feature_V: height of a bump in the positive open-circuit potential.
    """

    cell: str
    soc: float
    start_K: float
    ambient_K: float
    heat_transfer_W_m2_K: float | None = None
    scaled: tuple[tuple[str, float], ...] = ()
    lithium_left: float = 1.0
    material_left: tuple[float, float] = (1.0, 1.0)
    film_ohm_m2: float = 0.0
    contact_ohm: float = 0.0
    plated_mol_m3: float | None = None
    half_gap_V: tuple[float, float] | None = None
    double_layer_F_m2: float | None = None
    feature_V: float = 0.0
