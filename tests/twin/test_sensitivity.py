"""Sensitivities against central differences of runs solved to rounding, and exact relations."""

from collections.abc import Iterator

import numpy as np
import pytest

from twin import limits, newton, pack_model
from twin.builtin import load_cell
from twin.effects import AnyEffect, Sei, SelfHeating, StressEnhancedDiffusion
from twin.load import Between, Load
from twin.pack import Pack, PackError
from twin.population import population
from twin.sensitivity import sensitivity
from twin.solution import Status

NAMES = (
    "negative.particle_radius_m",
    "positive.diffusivity_factor",
    "electrolyte.conductivity_factor",
    "negative.porosity",
    "area_m2",
    "initial_soc",
    "initial_K",
    "heat_transfer_W_m2_K",
    "ambient_K",
)
STEP = 4e-4  # relative; error of the difference goes as its square, rounding as its inverse


@pytest.fixture
def to_rounding(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Newton goes on to 1e-9 V: the difference of two runs has no error of its own from it."""
    for module in (newton, limits):
        monkeypatch.setattr(module, "CONVERGED_V", 1e-9)
    yield from _without_cached_kernels()


def _without_cached_kernels() -> Iterator[None]:
    pack_model.forget()
    yield
    pack_model.forget()


def flight(between: Between, seconds: float = 30.0, mean_A: float = 10.0) -> Load:
    t = np.arange(0.0, seconds, 0.1)
    current = mean_A * (1 + 0.2 * np.random.default_rng(7).standard_normal(t.size))
    return Load(time_s=t, current_A=current, between=between, ambient_K=290.0)


def difference(pack: Pack, load: Load, name: str, value: float) -> tuple[np.ndarray, np.ndarray]:
    step = STEP * value if name != "initial_K" and name != "ambient_K" else 1e-2
    ends = population(pack, load, [name], [[value + step], [value - step]], workers=1)
    change = (ends.voltage_V, ends.temperature_K)
    return tuple((c[0] - c[1]) / (2 * step) for c in change)


@pytest.mark.parametrize("cell", ["lg_m50", "lipo_2200"])
@pytest.mark.parametrize("between", list(Between))
@pytest.mark.usefixtures("to_rounding")
def test_derivatives_are_the_limit_of_differences(cell: str, between: Between) -> None:
    pack = Pack(
        cell=load_cell(cell), series=3, capacity_C=18000.0, initial_soc=0.8,
        effects=(SelfHeating(),),
    )  # fmt: skip
    load = flight(between)
    exact = sensitivity(pack, load, NAMES)
    for i, name in enumerate(NAMES):
        voltage, temperature = difference(pack, load, name, float(exact.values[i]))
        for got, near in ((exact.voltage, voltage), (exact.temperature, temperature)):
            assert got[:, i] == pytest.approx(near, abs=1e-5 * np.abs(near).max() + 1e-9), name


def test_at_the_kernels_own_tolerance_they_are_right_to_a_ten_thousandth() -> None:
    pack, load = Pack(cell=load_cell("lg_m50")), flight(Between.LINEAR)
    exact = sensitivity(pack, load, NAMES[:2])
    for i, name in enumerate(NAMES[:2]):
        near, _ = difference(pack, load, name, float(exact.values[i]))
        assert exact.voltage[:, i] == pytest.approx(near, abs=1e-4 * np.abs(near).max())


def test_where_a_run_ends_early_the_derivatives_end_with_it() -> None:
    pack, load = Pack(cell=load_cell("lg_m50"), initial_soc=0.05), flight(Between.HOLD, 90.0)
    part = sensitivity(pack, load, NAMES[:1])
    n = part.solution.voltage_V.size
    assert part.solution.status is not Status.DONE
    assert 10 < n < load.time_s.size
    assert part.voltage.shape == part.temperature.shape == (n, 1)
    before = Load(time_s=load.time_s[:n], current_A=load.current_A[:n], between=Between.HOLD)
    assert np.array_equal(part.voltage[:-1], sensitivity(pack, before, NAMES[:1]).voltage[:-1])


def test_many_parameters_give_what_each_gives_alone() -> None:
    pack, load = Pack(cell=load_cell("lg_m50")), flight(Between.LINEAR, 60.0)  # more than a chunk
    together = sensitivity(pack, load, NAMES[:6])
    for i in (0, 3, 5):
        alone = sensitivity(pack, load, NAMES[i : i + 1])
        scale = np.abs(alone.voltage).max()
        assert together.voltage[:, [i]] == pytest.approx(alone.voltage, abs=1e-11 * scale)


@pytest.mark.parametrize("effect", [Sei(), StressEnhancedDiffusion()], ids=lambda e: e.id)
def test_a_pack_whose_kernel_is_another_is_refused(effect: AnyEffect) -> None:
    pack = Pack(cell=load_cell("lg_m50"), effects=(effect,))
    with pytest.raises(PackError, match="age"):
        sensitivity(pack, flight(Between.HOLD), ["initial_soc"])


def test_an_unknown_name_is_refused_and_the_known_ones_told() -> None:
    with pytest.raises(PackError, match=r"'radius' is unknown.*particle_radius_m"):
        sensitivity(Pack(cell=load_cell("lg_m50")), flight(Between.HOLD), ["radius"])
