"""The numbers of the twin's effects that are the truth of `effects.py`."""

from math import exp

from proof.simulated.configured import Configured


def true_value(effect: str, size: float, flavour: int) -> tuple[str, float, str] | None:
    """Name, value and unit of the twin's number; None where it depends on more than the size."""
    sign = -1.0 if flavour % 2 else 1.0
    factor = exp(-size)
    known = {
        "self_heating": ("heat_transfer_W_m2_K", 12.0 / size, "W/m2/K"),
        "cold_pack": ("start_offset_K", size if flavour % 4 == 3 else -size, "K"),
        "solid_diffusion_negative": ("diffusivity_factor", factor, "1"),
        "solid_diffusion_positive": ("diffusivity_factor", factor, "1"),
        "lithium_inventory_loss": ("lost", size, "1"),
        "active_material_loss_negative": ("lost", size, "1"),
        "active_material_loss_positive": ("lost", size, "1"),
        "film_resistance": ("negative_ohm_m2", size, "Ohm m2"),
        "series_resistance": ("resistance_ohm", size, "Ohm"),
        "initial_soc": ("offset", -sign * size, "1"),
        "current_gain": ("gain", 1.0 / (1.0 + sign * size), "1"),
        "current_offset": ("offset_A", -sign * size, "A"),
        "sensor_lag": ("lag_s", size, "s"),
        "clock_shift": ("shift_s", sign * size, "s"),
        "voltage_gain": ("gain", 1.0 + sign * size, "1"),
        "plating_stripping": ("initial_mol_m3", size, "mol/m3"),
    }
    return known.get(effect)


def true_value_in(
    told: Configured, effect: str, size: float, flavour: int
) -> tuple[str, float, str] | None:
    """The same in that pack; None also where the pack decides what the effect is."""
    heated = effect == "cold_pack" and told.heat_transfer_W_m2_K is not None
    full = effect == "initial_soc" and told.start_soc + size >= 1.0
    return None if heated or full else true_value(effect, size, flavour)
