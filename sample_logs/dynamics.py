"""A point mass under a cascaded position and velocity controller, with lags, drag and gusts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sample_logs.airframe import AIR_kg_m3, Airframe, GRAVITY_m_s2

FloatArray = npt.NDArray[np.float64]

POSITION_GAIN = 0.95  # 1/s, PX4's MPC_XY_P
VELOCITY_GAIN = 3.0  # 1/s
INTEGRAL_GAIN = 0.6  # 1/s2
ATTITUDE_LAG_s = 0.12
MOTOR_LAG_s = 0.05
LEAST_LIFT_m_s2 = 4.5
TILT_LIMIT = 0.7  # tangent of 35 degrees


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion3D:
    """What the vehicle did, (n,) or (n, 3) north, east, down.

    Attributes:
        position_m: from the take-off point.
        velocity_m_s: over ground.
        setpoint_m_s: velocity asked for by the position controller.
        thrust_N: of all rotors.
        axial_m_s: air through the discs, climb positive.
        in_plane_m_s: air along the discs.
        in_air: off the ground.
    """

    position_m: FloatArray
    velocity_m_s: FloatArray
    setpoint_m_s: FloatArray
    thrust_N: FloatArray
    axial_m_s: FloatArray
    in_plane_m_s: FloatArray
    in_air: npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Disturbance:
    """Wind and estimator noise (n,): horizontal parts are complex, north + 1j east.

    Attributes:
        wind: horizontal air motion.
        updraft: vertical, up positive.
        noise: error of the horizontal velocity estimate.
        noise_down: error of the vertical one.
    """

    wind: npt.NDArray[np.complex128]
    updraft: FloatArray
    noise: npt.NDArray[np.complex128]
    noise_down: FloatArray


def coloured(
    rng: np.random.Generator, n: int, dt_s: float, sigma: float, tau_s: float
) -> FloatArray:
    """(n,) first-order Gauss-Markov noise: standard deviation `sigma`, correlation time `tau_s`."""
    keep = math.exp(-dt_s / tau_s)
    kicks = (rng.standard_normal(n) * sigma * math.sqrt(1 - keep**2)).tolist()
    out, x = [], float(rng.standard_normal() * sigma)
    for kick in kicks:
        x = keep * x + kick
        out.append(x)
    return np.asarray(out)


def disturb(rng: np.random.Generator, n: int, dt_s: float) -> Disturbance:
    """A steady wind of 0 to 4 m/s with Dryden-like gusts (first order, 1.5 s to 3 s), and noise."""
    mean = rng.uniform(0, 4) * np.exp(2j * np.pi * rng.random())
    sigma, tau_s = 0.1 + 0.12 * abs(mean), rng.uniform(1.5, 3)
    north, east, up = (coloured(rng, n, dt_s, sigma, tau_s) for _ in range(3))
    noise = [coloured(rng, n, dt_s, 0.03, 0.25) for _ in range(3)]
    return Disturbance(
        wind=mean + north + 1j * east,
        updraft=0.6 * up,
        noise=noise[0] + 1j * noise[1],
        noise_down=noise[2],
    )


def simulate(
    airframe: Airframe,
    reference_m_s: FloatArray,
    thrust_limit: FloatArray,
    air: Disturbance,
    dt_s: float,
) -> Motion3D:
    """Fly the commanded velocity `reference_m_s` (n, 3); explicit Euler at `dt_s`.

    Args:
        airframe: mass, drag and thrust.
        reference_m_s: north, east, down; the position reference is its integral.
        thrust_limit: (n,) share of the greatest thrust that is released (0 before the start).
        air: wind and noise.
        dt_s: step, a few times shorter than the motors' lag.
    """
    mass, drag = airframe.mass_kg, 0.5 * AIR_kg_m3 * airframe.drag_area_m2
    full_N = airframe.thrust_to_weight * airframe.weight_N
    ground = reference_m_s[:, 0] + 1j * reference_m_s[:, 1]
    k_attitude, k_motor = dt_s / ATTITUDE_LAG_s, dt_s / MOTOR_LAG_s
    p = v = tilt = total = p_ref = 0j
    z = w = z_ref = total_z = thrust = 0.0  # z and w down positive
    rows = []
    columns = (ground, reference_m_s[:, 2], thrust_limit, air.wind, air.updraft)
    inputs = (c.tolist() for c in (*columns, air.noise, air.noise_down))
    for vr, wr, limit, wind, updraft, nv, nw in zip(*inputs, strict=True):
        p_ref, z_ref = p_ref + vr * dt_s, z_ref + wr * dt_s
        v_set = vr + POSITION_GAIN * (p_ref - p)
        w_set = wr + POSITION_GAIN * (z_ref - z)
        on_ground = z >= 0 and thrust <= airframe.weight_N
        if on_ground:
            total, total_z = 0j, 0.0  # integrators wait for take-off
        dv, dw = v_set - v - nv, w_set - w - nw
        total_z += INTEGRAL_GAIN * dw * dt_s
        up = max(GRAVITY_m_s2 - VELOCITY_GAIN * dw - total_z, LEAST_LIFT_m_s2)
        want = (VELOCITY_GAIN * dv + total) / up  # tangent of the tilt
        if abs(want) > TILT_LIMIT:
            want *= TILT_LIMIT / abs(want)
        else:
            total += INTEGRAL_GAIN * dv * dt_s  # no wind-up while the tilt is limited
        tilt += k_attitude * (want - tilt)
        cos = 1 / math.sqrt(1 + abs(tilt) ** 2)
        thrust += k_motor * (min(mass * up / cos, full_N * limit) - thrust)
        air_h, air_up = v - wind, -w - updraft
        air_speed = math.hypot(abs(air_h), air_up)
        accel = (thrust * cos * tilt - drag * air_speed * air_h) / mass
        accel_down = GRAVITY_m_s2 - (thrust * cos - drag * air_speed * air_up) / mass
        axial = cos * (air_up + (air_h * tilt.conjugate()).real)
        in_plane = math.sqrt(max(air_speed**2 - axial**2, 0.0))
        v, w = (0j, 0.0) if on_ground else (v + accel * dt_s, w + accel_down * dt_s)
        p, z = p + v * dt_s, min(z + w * dt_s, 0.0)
        w = min(w, 0.0) if z >= 0 else w
        rows.append((p, z, v, w, v_set, w_set, thrust, axial, in_plane, z < 0 and not on_ground))
    return _collect(rows)


def _collect(rows: Sequence[tuple[complex, ...]]) -> Motion3D:
    p, z, v, w, v_set, w_set, thrust, axial, in_plane, flying = np.array(rows).T

    def three(h: npt.NDArray[np.complex128], d: npt.NDArray[np.complex128]) -> FloatArray:
        return np.column_stack([h.real, h.imag, d.real])

    return Motion3D(
        position_m=three(p, z),
        velocity_m_s=three(v, w),
        setpoint_m_s=three(v_set, w_set),
        thrust_N=thrust.real,
        axial_m_s=axial.real,
        in_plane_m_s=in_plane.real,
        in_air=flying.real > 0.5,
    )
