"""Transport through the porous layers: electrolyte and solid, in weak form on one layer.

Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597: concentrated
binary electrolyte, Ohm's law in the solid; effective properties as in the BPX standard.
"""

import casadi as ca

from twin.mesh import Layer


def weak_divergence(layer: Layer, nodal: ca.SX, factor: ca.SX, thickness_m: ca.SX) -> ca.SX:
    """Integral of factor * d nodal / dx * d test / dx over the layer, per test function.

    Args:
        layer: the mesh of the layer, unit length.
        nodal: (n,) the quantity whose gradient drives the flux.
        factor: (n,) minus the flux per gradient, at the nodes.
        thickness_m: of the layer.

    Returns:
        (n,) whose sum is zero exactly: nothing is made or lost inside.
    """
    total = ca.SX.zeros(layer.size)
    for element in layer.elements:
        nodes = list(element.nodes)
        slope = ca.DM(element.slope)
        flux = ca.DM(element.weight) * factor[nodes] * (slope @ nodal[nodes]) / thickness_m
        total[nodes] += slope.T @ flux
    return total
