"""Loads beyond the model end with a status, finite numbers up to there, and every atom counted."""

from functools import cache

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.effects import AGEING, EFFECTS, AnyEffect
from twin.kernel import Backend
from twin.load import Between, Load, LoadError
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution, Status

CELLS = ("lg_m50", "lipo_2200")
EVERYTHING: tuple[AnyEffect, ...] = tuple(kind() for kind in EFFECTS.values())
SOFT_ENDS = {Status.LOWER_CUT_OFF, Status.ELECTROLYTE_DEPLETED, Status.ELECTRODE_EMPTY}

both_cells = pytest.mark.parametrize("cell", CELLS)
ageing_or_not = pytest.mark.parametrize("effects", [(), EVERYTHING], ids=["bare", "all effects"])


@cache
def pack(
    cell: str, effects: tuple[AnyEffect, ...] = (), soc: float = 1.0, celsius: float = 25.0
) -> Pack:
    return Pack(cell=load_cell(cell), effects=effects, initial_soc=soc, initial_K=273.15 + celsius)


def rate(p: Pack, c_rate: float) -> float:
    return c_rate * p.cell.nominal_capacity_C / 3600


def constant(
    current_A: float, seconds: float, period_s: float = 0.1, celsius: float = 25.0
) -> Load:
    t = period_s * np.arange(round(seconds / period_s) + 1)
    return Load(time_s=t, current_A=np.full(t.size, current_A), ambient_K=273.15 + celsius)


def sound(p: Pack, load: Load, backend: Backend = Backend.AUTO) -> Solution:
    """The solution, held to what every solution must be."""
    s = simulate(p, load, backend=backend)
    n = s.time_s.size
    for name in ("voltage_V", "temperature_K", "soc", "heat_W"):
        assert getattr(s, name).shape == (n,)
        assert np.all(np.isfinite(getattr(s, name)))
    assert np.all(np.isfinite(s.end_state))
    assert abs(s.audit.relative_error) <= 1e-12
    through_C = abs(s.charge_C) + p.cell.nominal_capacity_C
    assert abs(s.audit.charge_error_C) <= 1e-12 * through_C
    assert load.time_s[0] <= s.stopped_s <= load.time_s[-1] + 1e-9
    assert s.status is not Status.NOT_CONVERGED
    if s.status is Status.DONE:
        assert n == load.time_s.size
        assert s.charge_C == pytest.approx(load.charge_C(), rel=1e-12, abs=1e-9)
    else:  # everything computed up to there: no sample before the stop is missing
        assert n == np.count_nonzero(load.time_s < s.stopped_s) or load.time_s[n] <= s.stopped_s
    return s


@both_cells
@ageing_or_not
def test_thirty_c_depletes_the_electrolyte_or_ends_at_the_cut_off(
    cell: str, effects: tuple[AnyEffect, ...]
) -> None:
    p = pack(cell, effects)
    s = sound(p, constant(rate(p, 30.0), 150.0))
    assert s.status in SOFT_ENDS
    assert s.stopped_s < 120.0  # 3600 s / 30


@both_cells
@ageing_or_not
@pytest.mark.parametrize(("soc", "sign"), [(0.0, 1.0), (1.0, -1.0)])
def test_at_the_end_of_the_stoichiometry_window_it_ends(
    cell: str, effects: tuple[AnyEffect, ...], soc: float, sign: float
) -> None:
    p = pack(cell, effects, soc)
    s = sound(p, constant(sign * rate(p, 2.0), 1200.0, 1.0))
    assert s.status in SOFT_ENDS if sign > 0 else s.status is Status.UPPER_CUT_OFF


@both_cells
@ageing_or_not
@pytest.mark.parametrize("celsius", [-20.0, 60.0])
def test_cold_and_heat(cell: str, effects: tuple[AnyEffect, ...], celsius: float) -> None:
    p = pack(cell, effects, 0.9, celsius)
    s = sound(p, constant(rate(p, 1.0), 120.0, celsius=celsius))
    warm = sound(pack(cell, effects, 0.9), constant(rate(p, 1.0), 120.0))
    if celsius > 25.0:
        assert s.status is Status.DONE
        assert s.voltage_V[0] > warm.voltage_V[0]
    elif s.time_s.size:
        assert s.voltage_V[0] < warm.voltage_V[0]


@both_cells
@ageing_or_not
def test_a_load_that_only_charges_ends_at_the_upper_cut_off(
    cell: str, effects: tuple[AnyEffect, ...]
) -> None:
    p = pack(cell, effects, 0.3)
    s = sound(p, constant(-rate(p, 1.0), 7200.0, 10.0))
    assert s.status is Status.UPPER_CUT_OFF
    assert np.all(np.diff(s.soc) > 0)


@both_cells
@pytest.mark.parametrize("sign", [1.0, -1.0])
@ageing_or_not
def test_ten_thousand_amperes_end_at_once_with_a_status(
    cell: str, sign: float, effects: tuple[AnyEffect, ...]
) -> None:
    s = sound(pack(cell, effects, 0.5), constant(sign * 1e4, 5.0))
    assert s.status is not Status.DONE
    assert s.stopped_s < 0.1


@both_cells
@ageing_or_not
def test_a_single_sample_is_answered_with_the_voltage_at_its_current(
    cell: str, effects: tuple[AnyEffect, ...]
) -> None:
    p = pack(cell, effects, 0.8)
    for between in Between:
        load = Load(time_s=np.array([3.0]), current_A=np.array([rate(p, 2.0)]), between=between)
        s = sound(p, load)
        assert s.status is Status.DONE
        longer = simulate(p, constant(rate(p, 2.0), 1.0))
        assert s.voltage_V[0] == longer.voltage_V[0]
        assert s.stopped_s == 3.0
        assert s.charge_C == 0.0


@both_cells
@ageing_or_not
def test_a_gap_is_crossed_as_the_samples_in_it_would_have_been(
    cell: str, effects: tuple[AnyEffect, ...]
) -> None:
    p = pack(cell, effects, 0.8)
    whole = constant(rate(p, 2.0), 30.0)
    seen = (whole.time_s < 10.05) | (whole.time_s > 19.95)
    gap = Load(time_s=whole.time_s[seen], current_A=whole.current_A[seen])
    s, full = sound(p, gap), sound(p, whole)
    assert s.status is Status.DONE
    after = s.time_s > 21.0
    assert s.voltage_V[after] == pytest.approx(full.voltage_V[seen][after], abs=5e-4)


@both_cells
@ageing_or_not
def test_no_current_changes_no_charge(cell: str, effects: tuple[AnyEffect, ...]) -> None:
    s = sound(pack(cell, effects, 0.5), constant(0.0, 3600.0, 60.0))
    assert s.status is Status.DONE
    assert s.charge_C == 0.0
    assert s.voltage_V[-1] == pytest.approx(s.voltage_V[0], abs=2e-3)


@both_cells
@ageing_or_not
@pytest.mark.parametrize("period_s", [3600.0, 1e-6])
def test_samples_an_hour_or_a_microsecond_apart(
    cell: str, effects: tuple[AnyEffect, ...], period_s: float
) -> None:
    p = pack(cell, effects, 0.9)
    s = sound(p, constant(rate(p, 0.1), 4 * period_s, period_s))
    assert s.status is Status.DONE
    assert s.stopped_s == pytest.approx(4 * period_s, rel=1e-9)


@pytest.mark.parametrize("effects", [(), tuple(kind() for kind in AGEING)], ids=["bare", "ages"])
@pytest.mark.parametrize("c_rate", [30.0, -5.0, 1.0])
def test_the_virtual_machine_ends_where_the_compiled_kernel_does(
    effects: tuple[AnyEffect, ...], c_rate: float
) -> None:
    p = pack("lipo_2200", effects, 0.9, 0.0)
    load = constant(rate(p, c_rate), 20.0, celsius=0.0)
    a, b = sound(p, load), sound(p, load, Backend.VIRTUAL_MACHINE)
    assert a.status is b.status
    assert a.stopped_s == pytest.approx(b.stopped_s, abs=1e-5)
    assert a.voltage_V == pytest.approx(b.voltage_V, abs=1e-9)


@pytest.mark.parametrize(
    ("time_s", "current_A", "said"),
    [
        ([0.0, 1.0], [1.0, np.nan], r"current_A\[1\] is not finite"),
        ([0.0, np.inf], [1.0, 1.0], r"time_s\[1\] is not finite"),
        ([], [], "needs a sample"),
        ([[0.0, 1.0]], [[1.0, 1.0]], "needs a sample"),
        ([0.0, 0.0], [1.0, 1.0], "does not exceed"),
    ],
)
def test_what_is_no_load_is_refused(time_s: list, current_A: list, said: str) -> None:
    with pytest.raises(LoadError, match=said):
        Load(time_s=np.array(time_s), current_A=np.array(current_A))


@pytest.mark.parametrize("ambient_K", [25.0, np.nan])
def test_air_in_degrees_celsius_is_refused(ambient_K: float) -> None:
    with pytest.raises(LoadError, match=f"ambient_K = {ambient_K}: expected 200 to 400"):
        Load(time_s=np.zeros(1), current_A=np.zeros(1), ambient_K=ambient_K)
