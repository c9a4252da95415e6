"""The reference loads, by formula: no file of a flight is needed to make them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferenceLoad:
    """A current for one cell.

    Attributes:
        time_s: (n,) samples.
        current_A: (n,) discharge positive.
        hold: the current holds from sample to sample; else it runs straight.
    """

    time_s: FloatArray
    current_A: FloatArray
    hold: bool


def constant(capacity_Ah: float, *, rate: float, duration_s: float) -> ReferenceLoad:
    """One current from a full cell at rest, a sample every 5 s."""
    time_s = np.arange(0.0, duration_s + 2.5, 5.0)
    return ReferenceLoad(
        time_s=time_s, current_A=np.full(time_s.size, rate * capacity_Ah), hold=False
    )


def pulses(capacity_Ah: float, *, rate: float) -> ReferenceLoad:
    """Twice: rest, 300 s at 1C, rest, 10 s at `rate`, rest, 5 s of charge at C/2; 1 s samples."""
    once = ((0.0, 10), (1.0, 300), (0.0, 20), (rate, 10), (0.0, 20), (-0.5, 5))
    rates = np.concatenate([np.full(n, r) for r, n in once * 2] + [np.zeros(11)])
    return ReferenceLoad(
        time_s=np.arange(float(rates.size)), current_A=rates * capacity_Ah, hold=True
    )


def flight(
    capacity_Ah: float, *, mean: float, peak: float, duration_s: float, seed: int
) -> ReferenceLoad:
    """A flight as a 10 Hz sensor would see it.

    Idling, take-off over half a second, then hover with gusts (filtered noise), a slow trend as
    the voltage sinks, and manoeuvres: smooth bursts towards `peak` and sinks below the mean.

    Args:
        capacity_Ah: of the cell.
        mean: C-rate of the whole flight.
        peak: C-rate of the highest sample.
        duration_s: of the flight.
        seed: of the gusts and of the manoeuvres' times.
    """
    random = np.random.default_rng(seed)
    t = np.arange(round(duration_s * 10) + 1) / 10
    gusts = np.zeros(t.size)
    for seconds, share in ((0.2, 0.05), (2.0, 0.06)):
        white, keep = random.standard_normal(t.size), np.exp(-0.1 / seconds)
        filtered = np.zeros(t.size)
        for k in range(1, t.size):
            filtered[k] = keep * filtered[k - 1] + np.sqrt(1 - keep**2) * white[k]
        gusts += share * filtered
    manoeuvres = np.zeros(t.size)
    for centre in random.uniform(20.0, duration_s - 5.0, size=int(duration_s / 12)):
        width, height = random.uniform(0.4, 2.5), random.uniform(-0.4, 0.7)
        manoeuvres += height * np.exp(-0.5 * ((t - centre) / width) ** 2)
    flying = np.clip((t - 5.0) / 0.5, 0.0, 1.0)
    shape = (0.95 + 0.1 * t / duration_s + gusts + manoeuvres) * flying + 0.05
    shape = np.maximum(shape, 0.05)
    for _ in range(30):  # raise what exceeds the mean to the peak, rescale to the mean, again
        shape *= mean / (float(np.dot(np.diff(t), shape[:-1] + shape[1:])) / 2 / t[-1])
        excess = np.maximum(shape - mean, 0.0)
        shape += excess * (peak - shape.max()) / excess.max()
    return ReferenceLoad(time_s=t, current_A=shape * capacity_Ah, hold=False)


M50_AH, LIPO_AH = 5.0, 2.2
LOADS = {
    ("lg_m50", "2C"): constant(M50_AH, rate=2.0, duration_s=1200.0),
    ("lg_m50", "3C"): constant(M50_AH, rate=3.0, duration_s=540.0),
    ("lg_m50", "pulses"): pulses(M50_AH, rate=4.0),
    ("lg_m50", "flight"): flight(M50_AH, mean=2.0, peak=4.0, duration_s=600.0, seed=1),
    ("lipo_2200", "2C"): constant(LIPO_AH, rate=2.0, duration_s=1500.0),
    ("lipo_2200", "pulses"): pulses(LIPO_AH, rate=4.0),
    ("lipo_2200", "flight"): flight(LIPO_AH, mean=8.0, peak=18.0, duration_s=360.0, seed=2),
    ("uneven", "2C"): constant(LIPO_AH, rate=2.0, duration_s=1500.0),
    ("uneven", "flight"): flight(LIPO_AH, mean=5.0, peak=11.0, duration_s=360.0, seed=3),
}
"""4C pulses for both; the LiPo's flight is as hard as it can fly, and so is shorter. Uneven: the
LiPo with diffusivities that vary along a particle's radius, 50-fold and 18-fold over the window."""

THERMAL = ("isothermal", "lumped")
WITHOUT_SALT = ("lg_m50", "3C")
"""After 167 s a part of its positive electrode has none left; isothermal: warmth spares it."""


def names() -> list[str]:
    """All cases, `cell-load-thermal`."""
    return [
        f"{cell}-{kind}-{thermal}"
        for cell, kind in LOADS
        for thermal in (THERMAL[:1] if (cell, kind) == WITHOUT_SALT else THERMAL)
    ]
