"""What of each cell of `heat_list` warms and cools.

A cell's heat capacity is its mass times the specific heat of its kind: 830 J/(kg K) NCA, 1040 NMC,
both of these in one can 935 (batterydesign.net, Specific Heat Capacity of Lithium Ion Cells, after
calorimetry of 18650s); LiPo and LMO pouches as what lies between all kinds told there, 1000. The
masses are of data sheets. That of the built-in LG M50, 42.8 J/K, counts its layers without can and
electrolyte, and is not used. Surfaces are those of cans and pouches of the stated dimensions.
"""

from math import pi

from proof.recorded.base import Body


def can(diameter_m: float, height_m: float) -> float:
    """Surface of a cylinder with its ends [m2]."""
    return pi * diameter_m * height_m + pi * diameter_m**2 / 2


def pouch(length_m: float, width_m: float, thickness_m: float) -> float:
    """Surface of a box [m2]."""
    return 2 * (length_m * width_m + (length_m + width_m) * thickness_m)


SAMSUNG = Body(heat_capacity_J_K=0.046 * 935, cooling_area_m2=can(0.0183, 0.0649))
LG_M50 = Body(heat_capacity_J_K=0.0685 * 1040, cooling_area_m2=can(0.0211, 0.0702))
PANASONIC = Body(heat_capacity_J_K=0.047 * 830, cooling_area_m2=can(0.0183, 0.0652))
MELASTA = Body(heat_capacity_J_K=0.128 * 1000, cooling_area_m2=pouch(0.124, 0.042, 0.0084))
"""Dimensions by the type's name; mass by that of its makers' other pouches of 6.4 to 6.8 Ah."""
LEAF = Body(heat_capacity_J_K=0.787 * 1000, cooling_area_m2=pouch(0.290, 0.216, 0.0071))
"""AESC's statement of the cell of 2011 to 2013."""
