"""Packs drawn from what a calibration left open: as far from it as it says, and all possible."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import cell_pack
from twin.calibrate.cell_map import full_and_empty_V
from twin.calibrate.degradation import SPREAD
from twin.calibrate.doubt import Doubt, cells_drawn, draws, read_doubt
from twin.calibrate.parameters import Scale, cell_table, window_capacity_C
from twin.calibrate.table import CalibrationError
from twin.damage import ageing
from twin.effects import SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

PACK = ageing(cell_pack())
TABLE = {p.name: p for p in cell_table(PACK)}
NAMES = (*TABLE, "start_V:0.1C")
RADIUS, POROSITY = "negative.particle_radius_m", "negative.porosity"


def doubt(share: float, *, together: float = 0.0) -> Doubt:
    """Errors of a share of the priors; two parameters correlated."""
    value = np.array([*(p.mean for p in TABLE.values()), 4.1])
    std = [share * p.std * (p.mean if p.scale is Scale.LOG else 1.0) for p in TABLE.values()]
    correlations = np.eye(len(NAMES))
    i, j = NAMES.index(RADIUS), NAMES.index(POROSITY)
    correlations[i, j] = correlations[j, i] = together
    return Doubt(names=NAMES, value=value, std=np.array([*std, 0.01]), correlations=correlations)


def test_cells_are_drawn_as_far_from_the_fit_as_it_says() -> None:
    drawn = draws(PACK, 300, cell=doubt(0.2, together=0.8), aged=None)
    numbers = [p.cell_parameters() for p in drawn]
    radius = np.array([n[RADIUS] for n in numbers]) / TABLE[RADIUS].mean
    porosity = np.array([n[POROSITY] for n in numbers]) - TABLE[POROSITY].mean
    assert np.log(radius).std() == pytest.approx(0.2 * TABLE[RADIUS].std, rel=0.1)
    assert porosity.std() == pytest.approx(0.2 * TABLE[POROSITY].std, rel=0.1)
    assert np.corrcoef(np.log(radius), porosity)[0, 1] == pytest.approx(0.8, abs=0.06)
    capacity = np.array([window_capacity_C(p) for p in drawn]) / window_capacity_C(PACK)
    assert np.log(capacity).std() == pytest.approx(0.2 * TABLE["capacity_C"].std, rel=0.15)


def test_a_drawn_cell_is_full_where_the_cell_is() -> None:
    full_V, _ = full_and_empty_V(PACK)
    still = Load(time_s=np.array([0.0, 1.0]), current_A=np.zeros(2))
    for drawn in draws(PACK, 4, cell=doubt(0.3)):
        rested = replace(drawn, initial_soc=1.0, effects=())
        assert simulate(rested, still).voltage_V[0] == pytest.approx(full_V, abs=2e-4)
        assert drawn.cell is PACK.cell  # no kernel of its own


def test_without_doubt_the_cell_is_the_one_there_is() -> None:
    (same,) = draws(PACK, 1, cell=doubt(0.0))
    own = PACK.cell_parameters()
    assert {"negative.porosity", "series_resistance_ohm"} < {name for name, _ in same.moved}
    for name, difference in same.moved:
        assert difference == pytest.approx(0.0, abs=1e-9 * abs(own[name])), name


def test_constants_of_ageing_come_from_their_priors_or_from_a_life() -> None:
    name = "sei.solvent_diffusivity_m2_s"
    own = sei_of(PACK)
    by_prior = np.log([sei_of(p) / own for p in draws(PACK, 200)])
    assert by_prior.std() == pytest.approx(SPREAD[name], rel=0.15)
    known = Doubt(names=(name,), value=np.array([own]), std=np.array([0.1 * own]),
                  correlations=np.eye(1))  # fmt: skip
    by_life = np.log([sei_of(p) / own for p in draws(PACK, 200, aged=known)])
    assert by_life.std() == pytest.approx(0.1, rel=0.15)


def sei_of(pack: Pack) -> float:
    (effect,) = [e for e in pack.effects if e.id == "sei"]
    return float(effect.solvent_diffusivity_m2_s)  # type: ignore[union-attr, arg-type]


def test_the_fit_of_another_cell_is_refused() -> None:
    other = doubt(0.1)
    value = other.value.copy()
    value[NAMES.index(RADIUS)] *= 1.5
    with pytest.raises(CalibrationError, match="of another cell: negative"):
        draws(PACK, 1, cell=replace(other, value=value))


def test_a_fit_is_read_and_what_is_none_is_refused() -> None:
    document = {
        "parameters": [
            {"name": "b", "value": 2.0, "std": 0.1},
            {"name": "a", "value": 1, "std": 0},
        ],
        "correlations": {"names": ["a", "b"], "matrix": [[1.0, 0.5], [0.5, 1.0]]},
    }
    read = read_doubt(json.dumps(document), name="x.fit.json")
    assert (read.names, read.value.tolist(), read.std.tolist()) == (("a", "b"), [1, 2], [0, 0.1])
    document["correlations"] = {"names": ["a", "c"], "matrix": [[1.0, 0.5], [0.5, 1.0]]}
    for text in ("{", "[]", json.dumps(document)):
        with pytest.raises(CalibrationError, match=r"x\.fit\.json: not the fit of a calibration"):
            read_doubt(text, name="x.fit.json")


def test_how_a_drawn_cell_cools_is_drawn_with_it() -> None:
    """In the logarithm, about what the pack does; one that does not heat has none."""
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=20.0),))
    own = doubt(0.1)
    names = (*own.names, "heat_transfer_W_m2_K")
    more = Doubt(
        names=names, value=np.append(own.value, 50.0), std=np.append(own.std, 15.0),
        correlations=np.eye(len(names)),
    )  # fmt: skip
    cools = np.log([other.cools for other in cells_drawn(pack, more, 300)])
    assert cools.std() == pytest.approx(0.3, rel=0.1)
    assert cools.mean() == pytest.approx(0.0, abs=0.06)
    assert {other.cools for other in cells_drawn(cell_pack(), more, 4)} == {1.0}
    assert "heat_transfer_W_m2_K" not in dict(cells_drawn(pack, more, 1)[0].moved)
