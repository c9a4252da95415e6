"""One cell of a pack, as reference tests have it."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from twin.calibrate.table import CalibrationError
from twin.effects import (
    AGEING,
    OF_CELL,
    OF_CURRENT,
    AnyEffect,
    ColdPack,
    FilmResistance,
    Sei,
    SeriesResistance,
    VoltageGain,
)
from twin.pack import Pack
from twin.windows import SIDES

FloatArray = npt.NDArray[np.float64]

FILLER_LEAST, FILLER_EDGE = 0.01, 0.0001  # no less, if the start has it, but for so much
FILLER_STD = 0.03  # of the prior of the fillers, about those of the cell to start from

OF_FLIGHTS = (*OF_CURRENT, VoltageGain, ColdPack)
"""What was wrong with a flight's instruments, or with what was said of it."""


def check_effects(pack: Pack) -> None:
    """CalibrationError if an effect of `pack` is none that its tests can be calibrated with."""
    if pack.stressed or pack.weak or any(isinstance(e, OF_CELL) for e in pack.effects):
        raise CalibrationError(
            "the cells of this pack differ, stress enhances their diffusion, or an effect changes "
            "what is to be calibrated: calibrate without those effects in the pack file"
        )
    if any(isinstance(e, SeriesResistance) and e.outside for e in pack.effects):
        raise CalibrationError(
            "a series resistance outside of the cells is not calibrated: calibrate without "
            "effects.series_resistance.outside in the pack file, and add it afterwards"
        )
    if flown := ", ".join(e.id for e in pack.effects if isinstance(e, OF_FLIGHTS)):
        raise CalibrationError(
            f"{flown} in the pack file: found in flights, of their instruments and surroundings; "
            "here it would change the currents, voltages or temperatures that were measured in "
            f"tests. Calibrate without (take {flown} out of twin.physics and effects), and let "
            "`twin explain` look again with the calibrated cell"
        )


def labelled_C(pack: Pack) -> float:
    """Capacity of one cell of `pack` as it is labelled."""
    return pack.rated_C / pack.parallel


def single_cell(pack: Pack) -> Pack:
    """The mean cell of `pack` alone, its share of a resistance in series in it, without ageing.

    Of what ages only the resistance of the first film remains: the rest takes many cycles, in a
    reference test it changes nothing that can be seen.
    """
    share = pack.parallel / pack.series
    effects: list[AnyEffect] = []
    for e in pack.effects:
        if isinstance(e, SeriesResistance):
            effects.append(SeriesResistance(resistance_ohm=e.resistance_ohm * share))
        elif isinstance(e, Sei):
            effects.append(FilmResistance(negative_ohm_m2=e.first_film_ohm_m2))
        elif not isinstance(e, AGEING):
            effects.append(e)
    capacity_C = None if pack.capacity_C is None else pack.capacity_C / pack.parallel
    return replace(pack, series=1, parallel=1, capacity_C=capacity_C, effects=tuple(effects))


def filler_shares(pack: Pack) -> FloatArray:
    """(2,) of the electrodes, neither pore nor active material, of the cell as it is given."""
    p = pack.cell_parameters()
    solid = (p[f"{s}.specific_area_m2_m3"] * p[f"{s}.particle_radius_m"] / 3 for s in SIDES)
    pores = (p[f"{s}.porosity"] for s in SIDES)
    return np.array([1 - a - b for a, b in zip(solid, pores, strict=True)])


def below_prior(fillers: FloatArray, means: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2,) by how many deviations of their prior the fillers lie below its means, and the slope.

    Many more below FILLER_LEAST, or below the mean where that is less: no electrode holds more than
    its volume, and a cell that is told without filler may have none.
    """
    least = np.minimum(FILLER_LEAST, means)
    missed = (means - fillers) / FILLER_STD + np.maximum(least - fillers, 0.0) / FILLER_EDGE
    return missed, -1.0 / FILLER_STD - (fillers < least) / FILLER_EDGE
