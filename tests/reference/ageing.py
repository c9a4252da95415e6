"""The ageing cases: their loads by formula, and what is stored of them."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tests.reference.loads import LOADS, M50_AH, ReferenceLoad, constant

FloatArray = npt.NDArray[np.float64]
HERE = Path(__file__).parent
FLIGHT_S, FLOWN_S, REST_S, CHARGE_S = 60.0, 400.0, 3600.0, 1600.0


def _every(load: ReferenceLoad, step: int) -> ReferenceLoad:
    return ReferenceLoad(
        time_s=load.time_s[::step], current_A=load.current_A[::step], hold=load.hold
    )


def _start(load: ReferenceLoad, duration_s: float) -> ReferenceLoad:
    part = load.time_s <= duration_s
    return ReferenceLoad(time_s=load.time_s[part], current_A=load.current_A[part], hold=load.hold)


def _cycles(count: int, rate_s: tuple[tuple[float, float], ...], *, parts: int) -> ReferenceLoad:
    """C-rates and their seconds, each in equal parts, a ramp of 1 s from each to the next."""
    times: list[float] = []
    rates: list[float] = []
    for rate, duration_s in rate_s * count:
        since = times[-1] + 1.0 if times else 0.0
        times += list(since + np.linspace(0.0, duration_s, parts + 1))
        rates += [rate] * (parts + 1)
    return ReferenceLoad(time_s=np.array(times), current_A=np.array(rates) * M50_AH, hold=False)


def _flown(count: int, flight: ReferenceLoad) -> ReferenceLoad:
    """`count` times: the flight, a rest, what it drew back at 1C, a rest; ramps of 1 s between."""
    drawn_C = np.trapezoid(flight.current_A, flight.time_s)
    after = _cycles(1, ((0.0, 600.0), (-1.0, drawn_C / M50_AH - 1.0), (0.0, 600.0)), parts=1)
    times: list[float] = []
    currents: list[float] = []
    for part in (flight, after) * count:
        since = times[-1] + 1.0 if times else 0.0
        times += list(since + part.time_s)
        currents += list(part.current_A)
    return ReferenceLoad(time_s=np.array(times), current_A=np.array(currents), hold=False)


FULL = ((1.0, 3000.0), (0.0, 600.0), (-1.0, 1600.0), (0.0, 600.0))
MIDDLE = ((1.0, 1600.0), (0.0, 600.0), (-1.0, 1600.0), (0.0, 600.0))
AGEING_LOADS = {
    "2C": (1.0, _every(LOADS["lg_m50", "2C"], 4)),
    "rest": (1.0, _every(constant(M50_AH, rate=0.0, duration_s=REST_S), 12)),
    "charge": (0.2, _every(constant(M50_AH, rate=-1.0, duration_s=CHARGE_S), 4)),
    "flight": (1.0, _start(LOADS["lg_m50", "flight"], FLIGHT_S)),
    "cycle": (1.0, _cycles(1, FULL, parts=8)),
    "ten": (0.61, _cycles(10, MIDDLE, parts=1)),
    "fifty": (0.61, _cycles(50, MIDDLE, parts=1)),
    "flown": (0.61, _flown(10, _every(_start(LOADS["lg_m50", "flight"], FLOWN_S), 40))),
}
"""State of charge at the start, at rest, and the load; the charge ends before 4.2 V."""

ALONE = {
    "2C": ("sei", "film", "plating", "cracking", "crack_sei", "lam", "stress_diffusion"),
    "charge": ("plating", "lam", "negative", "stress_diffusion"),
    "cycle": ("negative", "stress_diffusion"),
    "ten": ("negative", "stress_diffusion"),
    "fifty": ("negative",),
    "flown": ("negative", "stress_diffusion"),
}


def ageing_names() -> list[str]:
    """All cases, `ageing-load-effects-thermal`: all effects on every load, then one by one."""
    together = [
        f"ageing-{load}-all-{thermal}"
        for load in ("2C", "rest", "charge", "flight")  # not cycles: README, the positive's loss
        for thermal in ("isothermal", "lumped")
        if thermal == "isothermal" or load not in ("rest", "flight")  # no heat; too slow
    ]
    return together + [f"ageing-{k}-{one}-isothermal" for k, v in ALONE.items() for one in v]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AgeingOutputs:
    """What is kept at the samples, each (n,); of the negative electrode where none is named.

    Attributes:
        voltage_V: at the terminals.
        temperature_K: of the cell.
        sei_mol: lithium bound in SEI since the start.
        crack_sei_mol: lithium bound in SEI on cracks since the start.
        plated_mol: lithium plated now, dead not counted.
        dead_mol: plated lithium that has lost contact.
        trapped_negative_mol: lithium in lost active material.
        trapped_positive_mol: the same of the positive electrode.
        particles_mol: lithium in the active material of both electrodes.
        electrolyte_mol: lithium in the salt.
        active_negative: volume share of active material, mean over the electrode.
        active_positive: the same of the positive electrode.
        crack_mean_m: crack length, mean over the electrode.
        crack_separator_m: crack length at the separator.
        porosity_mean: mean over the electrode.
        porosity_separator: at the separator.
        sei_thickness_m: mean over the electrode.
        plating_overpotential_V: least over the electrode of phi_s - phi_e - film drop.
    """

    voltage_V: FloatArray
    temperature_K: FloatArray
    sei_mol: FloatArray
    crack_sei_mol: FloatArray
    plated_mol: FloatArray
    dead_mol: FloatArray
    trapped_negative_mol: FloatArray
    trapped_positive_mol: FloatArray
    particles_mol: FloatArray
    electrolyte_mol: FloatArray
    active_negative: FloatArray
    active_positive: FloatArray
    crack_mean_m: FloatArray
    crack_separator_m: FloatArray
    porosity_mean: FloatArray
    porosity_separator: FloatArray
    sei_thickness_m: FloatArray
    plating_overpotential_V: FloatArray

    def lost_mol(self) -> FloatArray:
        """(n,) lithium neither in particles nor in the salt, from where it went."""
        return (
            self.sei_mol
            + self.crack_sei_mol
            + self.plated_mol
            + self.dead_mol
            + self.trapped_negative_mol
            + self.trapped_positive_mol
        )


OUTPUTS = tuple(f.name for f in fields(AgeingOutputs))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferenceAgeing:
    """One load on the ageing M50 by PyBaMM, extrapolated to the limit of fine meshes.

    Attributes:
        kind: of load.
        effects: which are on (`ageing_dfn.EFFECTS`).
        heated: one lumped temperature; else held at 25 degC.
        charge: state of charge at the start, at rest.
        load: the current.
        outputs: at the samples.
        own_error: output -> bound on its error at any sample, in its unit.
    """

    kind: str
    effects: str
    heated: bool
    charge: float
    load: ReferenceLoad
    outputs: AgeingOutputs
    own_error: dict[str, float]

    @classmethod
    def read(cls, name: str) -> "ReferenceAgeing":
        """The stored case `ageing-load-effects-thermal`."""
        _, kind, effects, thermal = name.split("-")
        with np.load(HERE / f"{name}.npz") as file:
            return cls(
                kind=kind,
                effects=effects,
                heated=thermal == "lumped",
                charge=float(file["charge"]),
                load=ReferenceLoad(time_s=file["time_s"], current_A=file["current_A"], hold=False),
                outputs=AgeingOutputs(**{k: file[k] for k in OUTPUTS}),
                own_error={k: float(file[f"own_error_{k}"]) for k in OUTPUTS},
            )
