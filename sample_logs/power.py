"""From thrust and airspeed to battery current: momentum theory, drive, pack."""

import numpy as np
import numpy.typing as npt

from sample_logs.airframe import AIR_kg_m3, Airframe

FloatArray = npt.NDArray[np.float64]

INDUCED_LOSS = 1.15  # non-uniform inflow, tip loss
NEWTON_STEPS = 30


def induced_velocity_m_s(
    hover_m_s: FloatArray, axial_m_s: FloatArray, in_plane_m_s: FloatArray
) -> FloatArray:
    """Velocity a rotor disc gives to the air, v (V + v) with V = axial (climb > 0), Glauert.

    Solves v sqrt(U**2 + (V + v)**2) = v_h**2, U in-plane, on the branch that passes through hover.
    Momentum theory ends at a descent of about v_h / 2 where the vortex ring begins: beyond it
    the axial velocity is held there.

    Args:
        hover_m_s: (n,) v_h = sqrt(T / (2 rho A)) of the present thrust.
        axial_m_s: (n,) air through the disc from above, climb positive.
        in_plane_m_s: (n,) air along the disc.

    Source:
        Leishman, Principles of Helicopter Aerodynamics, 2nd ed., eq. (2.126).
    """
    h = np.maximum(hover_m_s, 1e-3)
    x = np.maximum(axial_m_s / h, -0.5)
    u = in_plane_m_s / h
    v = np.ones_like(h)
    for _ in range(NEWTON_STEPS):
        s = np.hypot(u, x + v)
        v = v - (v * s - 1) / (s + v * (x + v) / s) * 0.8
        v = np.clip(v, 0.01, 3.0)
    return np.asarray(v * h)


def electrical_power_W(
    airframe: Airframe, thrust_N: FloatArray, axial_m_s: FloatArray, in_plane_m_s: FloatArray
) -> FloatArray:
    """Power at the pack's terminals; the profile part is what the figure of merit leaves in hover.

    Args:
        airframe: whose rotors.
        thrust_N: (n,) of all four.
        axial_m_s: (n,) air through the discs, climb positive.
        in_plane_m_s: (n,) air along the discs.
    """
    area_m2 = 4 * np.pi * airframe.propeller_radius_m**2
    hover = np.sqrt(thrust_N / (2 * AIR_kg_m3 * area_m2))
    induced = induced_velocity_m_s(hover, axial_m_s, in_plane_m_s)
    profile = thrust_N * hover * (1 / airframe.figure_of_merit - INDUCED_LOSS)
    shaft = thrust_N * (INDUCED_LOSS * induced + axial_m_s) + profile
    idle = np.maximum(shaft / airframe.drive_efficiency, airframe.idle_W)
    return np.asarray(idle + airframe.avionics_W)


def battery_current_A(airframe: Airframe, power_W: FloatArray, dt_s: float) -> FloatArray:
    """Current that gives `power_W` (n,) from a pack which sags and empties.

    The EMF falls from 4.15 V a cell by 0.45 V over the capacity: good enough for how much the
    current rises during a flight. The pack's recorded voltage is
    the twin's business, not this function's.
    """
    power = np.asarray(power_W)
    charge_C = np.cumsum(power / (3.8 * airframe.series)) * dt_s
    emf = airframe.series * (4.15 - 0.45 * np.minimum(charge_C / airframe.capacity_C, 1.0))
    r = airframe.resistance_ohm
    root = np.sqrt(np.maximum(emf**2 - 4 * r * power, 0.1 * emf**2))
    return np.asarray((emf - root) / (2 * r))


def ripple(rng: np.random.Generator, n: int, dt_s: float) -> FloatArray:
    """(n,) relative ripple of motors and ESCs: 1 % white, 2 % around a frame mode near 7 Hz."""
    frequency_hz, width_hz = rng.uniform(6, 9), 1.5
    pole = np.exp((-np.pi * width_hz + 2j * np.pi * frequency_hz) * dt_s)
    drive = rng.standard_normal(n)
    mode = np.zeros(n)
    a, b, y1, y2 = 2 * pole.real, -(abs(pole) ** 2), 0.0, 0.0
    for k, e in enumerate(drive.tolist()):
        y1, y2 = a * y1 + b * y2 + e, y1
        mode[k] = y1
    return np.asarray(0.02 * mode / mode.std() + 0.01 * rng.standard_normal(n))
