"""Effects as a pilot would say them."""

from collections.abc import Callable, Mapping, Sequence

from reports.parts import MismatchPart
from reports.quantity import MISSING, fixed, significant
from twin.mismatch import Value

Values = Mapping[str, float]

ALMOST = 0.99
TOLD = 2.0  # standard deviations from nothing
GONE = 1.1  # times the current of each cell: one of ten in parallel less


def name(effect: str) -> str:
    """As it stands in a sentence; one that is not known here keeps its id."""
    return NAMES.get(effect, effect.replace("_", " "))


def clause(effect: str, parameters: Sequence[Value]) -> str:
    """What was left out, with its size, without a full stop.

    Of effects of separate faults those that are told are named, unless none is.
    """
    values = {p.name: p.shown for p in parameters}
    if effect in OF_PARTS:
        told = {p.name for p in parameters if abs(p.value - nothing(p.name)) > TOLD * p.std}
        values = {key: v for key, v in values.items() if not told or key in told}
    say = CLAUSES.get(effect)
    return say(values) if say and values else f"the twin has no {name(effect)}, the recordings do"


def nothing(parameter: str) -> float:
    """The value at which a number makes no difference."""
    return 1.0 if parameter.endswith(("factor", "gain")) else 0.0


def listed(words: Sequence[str], joint: str = "and") -> str:
    """`a, b and c`."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {joint} {words[-1]}"


def sentence(text: str) -> str:
    """With a capital and a full stop."""
    return f"{text[:1].upper()}{text[1:]}."


NAMES = {
    "self_heating": "self-heating",
    "cold_pack": "another temperature than stated",
    "electrolyte_transport": "transport in the electrolyte",
    "solid_diffusion_negative": "diffusion in the negative particles",
    "solid_diffusion_positive": "diffusion in the positive particles",
    "reaction_kinetics": "reaction rates",
    "ocv_hysteresis": "hysteresis of the rest voltage",
    "plating_stripping": "plated lithium that strips",
    "lithium_inventory_loss": "lost lithium",
    "active_material_loss_negative": "lost negative material",
    "active_material_loss_positive": "lost positive material",
    "film_resistance": "films on the electrodes",
    "series_resistance": "resistance in series",
    "weak_cell": "a weak cell",
    "initial_soc": "another charge at the start",
    "leakage": "leakage",
    "current_gain": "gain of the current sensor",
    "current_offset": "offset of the current sensor",
    "sensor_lag": "a slow current sensor",
    "clock_shift": "clocks that disagree",
    "voltage_gain": "gain of the voltage sensor",
}


def _percent(share: float) -> str:
    return f"{significant(100 * abs(share), 2)} %"


def _more(value: float, more: str, less: str) -> str:
    return more if value > 0 else less


def _times(value: float) -> str:
    return f"{significant(value, 2)} times"


def _warmth(v: Values) -> str:
    """Of the pack at the start and the air."""
    said = [
        f"{what} {significant(abs(v[key]), 2)} K {_more(v[key], 'warmer', 'colder')}"
        for what, key in (("the pack started", "start_offset_K"), ("the air was",
                          "ambient_offset_K"))
        if v.get(key)
    ]  # fmt: skip
    return f"{listed(said) or 'pack or air were warmer or colder'} than the twin was told"


def _resistance(v: Values) -> str:
    """All that is in series, also where the twin as configured had some."""
    if "resistance_ohm" not in v:
        return "what is in series with the cells warms them by another share of its heat"
    if not (R := v["resistance_ohm"]):
        return "the pack has nothing in series with its cells (tabs, connectors, leads)"
    return (
        f"the pack has {significant(1e3 * abs(R), 2)} mΩ {_more(R, 'more', 'less')} in series "
        "(tabs, connectors, leads) than its cells"
    )


def _sides(v: Values, ending: str, said: Callable[[float], str]) -> str:
    """Each electrode of which a number is known; "" if there is none."""
    return listed(
        [
            f"{said(v[key])} on the {side} one"
            for side in ("negative", "positive")
            if (key := f"{side}_{ending}") in v
        ]
    )


def _film(v: Values) -> str:
    sides = _sides(v, "ohm_m2", lambda R: f"{significant(1e3 * R, 2)} mΩ m²")
    return f"films on the electrodes resist: {sides}"


def _weak(v: Values) -> str:
    """Only what differs, unless nothing does."""
    said = []
    if f := v.get("capacity_factor", 1.0) - 1.0:
        said.append(f"holds {_percent(f)} {_more(f, 'more', 'less')}")
    if d := v.get("soc_offset", 0.0):
        said.append(f"starts {_percent(d)} {_more(d, 'fuller', 'emptier')}")
    if R := v.get("resistance_ohm", 0.0):
        said.append(f"has {significant(1e3 * R, 2)} mΩ more in series")
    return f"one cell is not like the others: it {listed(said) or 'differs'}"


def _electrolyte(v: Values) -> str:
    said = [
        f"{what} {_times(v[key])} as {how}"
        for what, key, how in (("salt diffuses in it", "diffusivity_factor", "fast"),
                               ("it conducts", "conductivity_factor", "well"))
        if key in v
    ]  # fmt: skip
    return f"the electrolyte is not the twin's: {listed(said)}"


def _reactions(v: Values) -> str:
    sides = _sides(v, "factor", _times)
    return f"the reactions on the electrodes run at another rate than the twin's: {sides}"


def _hysteresis(v: Values) -> str:
    sides = _sides(v, "amplitude_V", lambda V: f"{significant(1e3 * V, 2)} mV")
    size = f": by up to {sides}" if sides else ""
    return (
        "the rest voltage of the electrodes remembers which way the charge last went "
        f"(hysteresis){size}"
    )


def _stripping(v: Values) -> str:
    there = v.get("initial_mol_m3")
    size = "" if there is None else f" ({significant(there, 2)} mol/m³)"
    return f"lithium metal lay on the negative electrode before take-off{size} and strips in flight"


def _lost(what: str) -> Callable[[Values], str]:
    return lambda v: (
        f"the cells have {_percent(v['lost'])} {_more(v['lost'], 'less', 'more')} "
        f"{what} than the twin's"
    )


def _diffusion(side: str) -> Callable[[Values], str]:
    return lambda v: (
        f"in the {side} electrode's particles lithium moves {_times(v['diffusivity_factor'])} as "
        "fast as in the twin's"
    )


def _off(what: str, by: float) -> str:
    return f"{what} reads {_percent(by)} too {_more(by, 'high', 'low')}"


def _current_gain(v: Values) -> str:
    """Current over size of the pack is all that a cell sees."""
    gain = v["gain"]
    gone = ", as if cells in parallel were gone" if gain > GONE else ""
    return (
        f"{_off('the current sensor', 1.0 / gain - 1.0)}, or the pack is {_times(1.0 / gain)} as "
        f"large as stated{gone}: its terminals do not tell these apart"
    )


def _lag(v: Values) -> str:
    by = f"{significant(v['lag_s'], 2)} s " if "lag_s" in v else ""
    return f"the current sensor answers {by}late and smooths the gusts"


def _clock(v: Values) -> str:
    if not (shift_s := v.get("shift_s", 0.0)):
        return "current and voltage were recorded on clocks that disagree"
    return (
        f"the current was recorded {significant(abs(shift_s), 2)} s "
        f"{_more(shift_s, 'late', 'early')} beside the voltage: their clocks disagree"
    )


CLAUSES: Mapping[str, Callable[[Values], str]] = {
    "self_heating": lambda v: (
        "the pack heats itself and the twin did not know; its surface gives off "
        f"{significant(v['heat_transfer_W_m2_K'], 2)} W/(m² K) to the air"
    ),
    "cold_pack": _warmth,
    "electrolyte_transport": _electrolyte,
    "solid_diffusion_negative": _diffusion("negative"),
    "solid_diffusion_positive": _diffusion("positive"),
    "reaction_kinetics": _reactions,
    "ocv_hysteresis": _hysteresis,
    "plating_stripping": _stripping,
    "lithium_inventory_loss": _lost("lithium to cycle"),
    "active_material_loss_negative": _lost("negative material at work"),
    "active_material_loss_positive": _lost("positive material at work"),
    "film_resistance": _film,
    "series_resistance": _resistance,
    "weak_cell": _weak,
    "initial_soc": lambda v: (
        f"the pack started {_percent(v['offset'])} "
        f"{_more(v['offset'], 'fuller', 'emptier')} than the twin was told"
    ),
    "leakage": lambda v: (
        f"{significant(v['current_A'], 2)} A leak from the pack past the current sensor"
    ),
    "current_gain": _current_gain,
    "current_offset": lambda v: (
        f"the current sensor reads {significant(abs(v['offset_A']), 2)} A too "
        f"{_more(-v['offset_A'], 'high', 'low')}, at any load"
    ),
    "sensor_lag": _lag,
    "clock_shift": _clock,
    "voltage_gain": lambda v: _off("the voltage sensor", v["gain"] - 1.0),
}

OF_PARTS = {"cold_pack", "weak_cell"}
"""Effects of which each number is a fault of its own, which may be absent.

Numbers of other effects share one drop of voltage: without the smaller the larger is not what was
found.
"""

UNITS = {
    "W/(m2 K)": ("W/(m² K)", 1.0),
    "W/m2/K": ("W/(m² K)", 1.0),
    "Ohm": ("mΩ", 1e3),
    "Ohm m2": ("mΩ m²", 1e3),
    "mol/m3": ("mol/m³", 1.0),
    "V": ("mV", 1e3),
    "1": ("", 1.0),
}
ENDINGS = ("_W_m2_K", "_ohm_m2", "_mol_m3", "_m_s", "_ohm", "_A", "_K", "_V", "_s")


def number(parameter: str) -> str:
    """A number of an effect in words."""
    ending = next((e for e in ENDINGS if parameter.endswith(e)), "")
    words = parameter.removesuffix(ending).split("_")
    return " ".join("state of charge" if word == "soc" else word for word in words)


def unit(of: str) -> tuple[str, float]:
    """As it is shown, and the factor to it."""
    return UNITS.get(of, (of, 1.0))


def percent(probability: float) -> str:
    """Of a probability; what is nearly certain is not called certain."""
    if probability > ALMOST:
        return f"> {fixed(100 * ALMOST, 0)} %"
    if probability < 1.0 - ALMOST:
        return f"< {fixed(100 * (1.0 - ALMOST), 0)} %"
    return f"{fixed(100 * probability, 0)} %"


def missed(part: MismatchPart | None) -> str:
    """The verdict in a cell; what is named with its probability."""
    if part is None:
        return MISSING
    if part.verdict not in ("named", "ambiguous"):
        return {"none": "nothing"}.get(part.verdict, "not known")
    said = listed([f"{name(e.id)} ({percent(e.probability)})" for e in part.effects])
    return said if part.verdict == "named" else f"not settled: {said}"
