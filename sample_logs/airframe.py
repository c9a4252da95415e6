"""`Airframe`: the quadrotors of the synthetic flights, reduced to what shapes their current."""

from dataclasses import dataclass

GRAVITY_m_s2 = 9.80665
AIR_kg_m3 = 1.225


@dataclass(frozen=True, slots=True, kw_only=True)
class Airframe:
    """A quadrotor with its pack.

    Attributes:
        name: short, used in file names.
        mass_kg: take-off mass, pack included.
        propeller_radius_m: of each of the four.
        figure_of_merit: ideal hover power / shaft power.
        drive_efficiency: shaft power / electrical power, motors and ESCs.
        avionics_W: everything that is not a motor.
        idle_W: four motors turning on the ground.
        drag_area_m2: Cd A.
        thrust_to_weight: greatest thrust / weight.
        climb_m_s: fastest commanded climb (descent is at most half of it).
        cruise_m_s: fastest commanded horizontal speed.
        acceleration_m_s2: of the commanded trajectory.
        series: cells of the pack.
        capacity_C: of the pack.
        resistance_ohm: of the pack, used only for the drop that raises the current.
    """

    name: str
    mass_kg: float
    propeller_radius_m: float
    figure_of_merit: float
    drive_efficiency: float
    avionics_W: float
    idle_W: float
    drag_area_m2: float
    thrust_to_weight: float
    climb_m_s: float
    cruise_m_s: float
    acceleration_m_s2: float
    series: int = 4
    capacity_C: float = 2.2 * 3600
    resistance_ohm: float = 0.03

    @property
    def weight_N(self) -> float:
        """Force of gravity [N]."""
        return self.mass_kg * GRAVITY_m_s2


S500 = Airframe(
    name="s500",
    mass_kg=0.975 + 0.235,
    propeller_radius_m=0.1016,
    figure_of_merit=0.46,
    drive_efficiency=0.62,
    avionics_W=7.0,
    idle_W=22.0,
    drag_area_m2=0.022,
    thrust_to_weight=2.3,
    climb_m_s=5.0,
    cruise_m_s=8.0,
    acceleration_m_s2=4.0,
)
"""The larger airframe of arXiv:2603.12791: 975 g, pack 235 g, means of 16 A to 22 A; 8-inch
propellers and efficiencies are chosen to give them."""

LIGHT = Airframe(
    name="light",
    mass_kg=0.455 + 0.235,
    propeller_radius_m=0.0635,
    figure_of_merit=0.55,
    drive_efficiency=0.70,
    avionics_W=5.0,
    idle_W=14.0,
    drag_area_m2=0.011,
    thrust_to_weight=3.2,
    climb_m_s=6.0,
    cruise_m_s=12.0,
    acceleration_m_s2=4.5,
)
"""The 455 g airframe of arXiv:2603.12791 with the same pack; 5-inch propellers."""
