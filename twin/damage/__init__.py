"""What each motion does to the battery: `study` is where to begin."""

from twin.damage.assess import (
    TEMPERATURE,
    Assessed,
    Assessment,
    Manoeuvre,
    Ratio,
    ageing,
    ageing_drawn,
    assess,
)
from twin.damage.attribution import Attribution, Span, attribute
from twin.damage.baselines import Baselines
from twin.damage.cost import Cost
from twin.damage.counterfactual import FEATURES
from twin.damage.cycles import CannotCycle, Cycled, Extremes, Protocol, cycle
from twin.damage.error import Error
from twin.damage.lives import Lifetime, Lives, Mix, project
from twin.damage.loss import Loss
from twin.damage.measures import MEASURES, Part, number
from twin.damage.projection import Projection, life
from twin.damage.spread import Piece
from twin.damage.study import Others, Study, study
from twin.damage.waveform import Waveform, WaveformError, constant

__all__ = [
    "FEATURES",
    "MEASURES",
    "TEMPERATURE",
    "Assessed",
    "Assessment",
    "Attribution",
    "Baselines",
    "CannotCycle",
    "Cost",
    "Cycled",
    "Error",
    "Extremes",
    "Lifetime",
    "Lives",
    "Loss",
    "Manoeuvre",
    "Mix",
    "Others",
    "Part",
    "Piece",
    "Projection",
    "Protocol",
    "Ratio",
    "Span",
    "Study",
    "Waveform",
    "WaveformError",
    "ageing",
    "ageing_drawn",
    "assess",
    "attribute",
    "constant",
    "cycle",
    "life",
    "number",
    "project",
    "study",
]
