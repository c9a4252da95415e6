"""Diffusion through a porous layer, in weak form.

Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597.
"""

import casadi as ca

from twin.mesh import Layer


def weak_divergence(layer: Layer, factor: ca.SX, thickness_m: ca.SX) -> ca.SX:
    """Integral of factor * d trial / dx * d test / dx over the layer, per test and trial function.

    Args:
        layer: the mesh of the layer, unit length.
        factor: (n,) minus the flux per gradient, at the nodes.
        thickness_m: of the layer.

    Returns:
        (n, n), symmetric; its columns sum to zero exactly: nothing is made or lost inside.
    """
    total = ca.SX(layer.size, layer.size)
    for element in layer.elements:
        nodes = list(element.nodes)
        slope = ca.DM(element.slope)
        conducted = ca.DM(element.weight) * factor[nodes] / thickness_m
        total[nodes, nodes] += slope.T @ (ca.repmat(conducted, 1, len(nodes)) * slope)
    return total
