import numpy as np
import pytest

from sample_logs.airframe import LIGHT, S500, AIR_kg_m3
from sample_logs.power import (
    INDUCED_LOSS,
    battery_current_A,
    electrical_power_W,
    induced_velocity_m_s,
)

ONE = np.ones(1)


def test_induced_velocity_agrees_with_momentum_theory_in_hover_climb_and_forward_flight():
    v = np.array([0.0, 1.0, 3.0, 8.0])
    climb = induced_velocity_m_s(np.full(4, 5.0), v, np.zeros(4))
    assert climb == pytest.approx(-v / 2 + np.sqrt(v**2 / 4 + 25.0), rel=1e-9)
    ahead = induced_velocity_m_s(np.full(4, 5.0), np.zeros(4), v)
    assert ahead == pytest.approx(np.sqrt(-(v**2) / 2 + np.sqrt(v**4 / 4 + 625.0)), rel=1e-9)


def test_descent_is_held_where_the_vortex_ring_begins():
    deep = induced_velocity_m_s(np.full(2, 5.0), np.array([-2.5, -9.0]), np.zeros(2))
    assert deep[0] == deep[1] > 5.0


@pytest.mark.parametrize("airframe", [S500, LIGHT], ids=lambda a: a.name)
def test_hover_power_is_the_ideal_power_over_the_efficiencies(airframe):
    weight = airframe.weight_N * ONE
    area = 4 * np.pi * airframe.propeller_radius_m**2
    ideal = weight * np.sqrt(weight / (2 * AIR_kg_m3 * area))
    expected = ideal / airframe.figure_of_merit / airframe.drive_efficiency + airframe.avionics_W
    got = electrical_power_W(airframe, weight, 0 * ONE, 0 * ONE)
    assert got == pytest.approx(expected, rel=1e-9)


def test_climbing_costs_and_flying_ahead_saves():
    hover, climb, ahead = electrical_power_W(
        S500, np.full(3, S500.weight_N), np.array([0.0, 2.0, 0.0]), np.array([0.0, 0.0, 5.0])
    )
    assert climb > hover > ahead
    # a slow climb costs half of what it lifts: the induced velocity falls by V / 2
    slow = electrical_power_W(S500, S500.weight_N * ONE, 0.1 * ONE, 0 * ONE)[0]
    lifted = S500.weight_N * 0.1 * (1 - INDUCED_LOSS / 2) / S500.drive_efficiency
    assert slow - hover == pytest.approx(lifted, rel=0.05)


def test_the_current_gives_the_power_at_the_sagging_voltage_and_rises_as_the_pack_empties():
    power = np.full(4000, 250.0)  # not yet empty
    current = battery_current_A(S500, power, 0.1)
    drawn = np.cumsum(power / (3.8 * 4)) * 0.1
    emf = 4 * (4.15 - 0.45 * drawn / S500.capacity_C)
    assert current * (emf - S500.resistance_ohm * current) == pytest.approx(power, rel=1e-9)
    assert np.all(np.diff(current) > 0)
