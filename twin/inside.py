"""`Inside` from the outputs of the kernel."""

import numpy as np
import numpy.typing as npt

from twin.effects import active_material_loss, mechanics
from twin.limits import COLUMN
from twin.pack import Pack
from twin.solution import Inside

FloatArray = npt.NDArray[np.float64]


def inside(pack: Pack, out: FloatArray) -> Inside:
    """From the outputs (rows, n) of a pack's steps; by the elastic constants of the pack."""
    return Inside(
        anode_V=out[COLUMN["anode_V"]],
        negative_stress_Pa=_stress_Pa(pack, "negative", out),
        positive_stress_Pa=_stress_Pa(pack, "positive", out),
    )


def _stress_Pa(pack: Pack, side: str, out: FloatArray) -> FloatArray:
    """(2, n); the sign of the partial volume says which extreme of the stoichiometry is which."""
    most = getattr(pack.cell, side).max_concentration_mol_m3
    names = ("modulus_Pa", "poisson", "partial_volume_m3_mol")
    elastic = (getattr(pack.mechanics, f"{side}_{name}") for name in names)
    under = out[[COLUMN[f"{side}_under_{which}"] for which in ("least", "most")]]
    tangential = mechanics.tangential_stress_Pa(most * under, *elastic)
    one, other = active_material_loss.HYDROSTATIC * tangential
    return np.stack([np.minimum(one, other), np.maximum(one, other)])
