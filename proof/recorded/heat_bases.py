"""What each cell of `heat_list` is calibrated from, and its recordings.

A cell's heat capacity is its mass times the specific heat of its kind: 830 J/(kg K) NCA, 1040 NMC,
both of these in one can 935 (batterydesign.net, Specific Heat Capacity of Lithium Ion Cells, after
calorimetry of 18650s); LiPo and LMO pouches as what lies between all kinds told there, 1000. The
masses are of data sheets. That of the built-in LG M50, 42.8 J/K, counts its layers without can and
electrolyte, and is not used. Surfaces are those of cans and pouches of the stated dimensions.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import pi
from pathlib import Path

import numpy as np
import numpy.typing as npt

from proof.recorded import about_energy, leaf_cell, lg_m50, melasta, panasonic, samsung
from proof.recorded.base import Base, Body, Given, base_of, charged_to
from proof.recorded.measured import (
    BEYOND_V,
    RealCell,
    RealTest,
    discharge_of,
    matlab,
    recorded_parts,
    recording,
)
from proof.recorded.replay import answer, errors
from proof.recorded.thinned import binned, every
from twin.builtin import load_cell
from twin.pack import Pack

Recordings = Mapping[str, Callable[[Path], RealTest]]

STEP_S = 5.0  # between samples of a steady discharge
DRIVE_S = 2.0  # of a drive cycle: means over as long
DRIVEN_S = 2700.0  # of it are given, so that a verdict takes a minute or two
AGAIN_1C = "03-10-17_23.36_3349_Dis1C_2.mat"
LATE_V, LATE_A = 0.05, 1.0  # of a sample in which the voltage fell, and the current did not rise
SHORT_PULSES = (
    "negative.stoichiometry_max", "negative.stoichiometry_min", "positive.stoichiometry_max",
    "capacity_C", "series_resistance_ohm", "negative.exchange_current_A_m2",
    "positive.exchange_current_A_m2",
)  # fmt: skip
"""What slow discharges and the first seconds of pulses tell."""


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A cell of the list.

    Attributes:
        source: of its recordings.
        base: folder of recordings, cache -> what stands for it.
        recordings: name -> reader.
        thin: what is given of a recording.
        rests: its recordings begin at rest, whose voltage tells the charge.
        also: ids of faults that its recordings have, whatever else is concealed in them.
    """

    source: str
    base: Callable[[Path, Path], Base]
    recordings: Recordings
    thin: Callable[[RealTest], RealTest]
    rests: bool
    also: tuple[str, ...] = ()


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


def _scaled(slow: RealTest, name: str = "lg_m50") -> Pack:
    """A built-in cell with the charge that a slow discharge gave."""
    return Pack(cell=load_cell(name), capacity_C=float(slow.drawn_C[-1]))


def _samsung(folder: Path) -> Given:
    slow = samsung.read(folder, "C10")
    tests = (slow, samsung.read(folder, "1C"), samsung.pulses(folder))
    return Given(start=_scaled(slow), tests=tests, check="1C", body=SAMSUNG)


def _samsung_2(folder: Path) -> Given:
    """Of the second cell only 1C and faster is there; the slow test and pulses are the first's."""
    given = _samsung(folder)
    slow, _, pulses = given.tests
    return replace(given, tests=(slow, samsung.read(folder, "1C", "S002"), pulses))


def _lg_m50(folder: Path) -> Given:
    """Its own error is that at 0.5C in the cold, which no trial uses."""
    rates, pulses = (matlab(recording(folder, f)) for f in (lg_m50.RATES, lg_m50.PULSES))
    slow, half = (lg_m50.rate(rates, 25, name) for name in ("0.1C", "0.5C"))
    short = (_felt(lg_m50.pulse(pulses, tenths, slow)) for tenths in lg_m50.PULSED)
    start = Pack(cell=load_cell("lg_m50"))
    cold = lg_m50.rate(rates, 0, "0.5C")
    return Given(start=start, tests=(slow, half, *short), unseen=(cold,), body=LG_M50)


def _felt(test: RealTest) -> RealTest:
    """Without samples whose voltage tells of a current that the logger tells only a sample later.

    Steps of LATE_V beside no current.
    """
    fell = np.abs(np.diff(test.voltage_V, prepend=test.voltage_V[0])) > LATE_V
    changed = np.abs(np.diff(test.current_A, prepend=0.0)) > LATE_A
    return _kept(test, ~fell | changed)


def _kept(test: RealTest, keep: npt.NDArray[np.bool_]) -> RealTest:
    temperature_K = None if test.temperature_K is None else test.temperature_K[keep]
    return replace(
        test, time_s=test.time_s[keep], current_A=test.current_A[keep],
        voltage_V=test.voltage_V[keep], temperature_K=temperature_K,
    )  # fmt: skip


def _panasonic(folder: Path) -> Given:
    """Every third stretch of the pulses, from full to empty.

    Its own error: at 1C on another day, and in the stretches that follow those.
    """
    slow = discharge_of(panasonic.read(folder, panasonic.SLOW, "C/20 25 degC")[0])
    one = discharge_of(panasonic.read(folder, panasonic.ONE_C, "1C 25 degC")[0])
    again = discharge_of(panasonic.read(folder, AGAIN_1C, "1C 25 degC, again")[0])
    short = recorded_parts(panasonic.pulses(folder))
    return Given(
        start=_scaled(slow), tests=(slow, one, *short[::3]), unseen=(again, *short[1::3]),
        body=PANASONIC,
    )  # fmt: skip


def _melasta(folder: Path) -> Given:
    tests = tuple(_melasta_test(folder, name) for name in ("C/10", "1C", "2C"))
    start = _scaled(tests[0], "lipo_2200")
    start = replace(start, cell=charged_to(start.cell, 4.35, 3.0))
    return Given(start=start, tests=tests, check="2C", body=MELASTA)


def _melasta_test(folder: Path, name: str) -> RealTest:
    """The first sample, logged as the current was switched on, has the voltage of the rest."""
    test = melasta.tests(folder)[name]
    return replace(test, current_A=np.concatenate([[0.0], test.current_A[1:]]))


def _leaf(folder: Path) -> Given:
    pulses = leaf_cell.pulses(folder)
    tests = (pulses, leaf_cell.discharge(folder, 1))
    return Given(start=leaf_cell.start_cell(pulses), tests=tests, check="1C", body=LEAF)


def _slow(given: Given) -> Given:
    """Fitted without the whole test that is not the slowest, its check, in SHORT_PULSES alone."""
    faster, others = given.tests[1], (given.tests[0], *given.tests[2:])
    return replace(given, tests=others, check="", unseen=(faster,), only=SHORT_PULSES)


def _published(make: Callable[[Path], RealCell]) -> Callable[[Path, Path], Base]:
    """As its publisher measured it; its own error is that of the slowest test."""

    def base(folder: Path, cache: Path) -> Base:  # noqa: ARG001
        cell = make(folder)
        slow = cell.fit[0]
        off = errors(answer(cell.baseline, slow), slow)
        narrow = replace(
            cell.baseline.cell,
            lower_cut_off_V=cell.baseline.cell.lower_cut_off_V + BEYOND_V,
            upper_cut_off_V=cell.baseline.cell.upper_cut_off_V - BEYOND_V,
        )
        return Base(
            pack=replace(cell.baseline, cell=narrow), heat_transfer_W_m2_K=0.0,
            full_soc=cell.baseline.initial_soc, error_V=1e-3 * off.rms, fitted_V={},
        )  # fmt: skip

    return base


def _samsungs(cell: str) -> Recordings:
    return {name: partial(samsung.read, name=name, cell=cell) for name in ("2C", "3C", "4C")}


def _lg_m50s() -> Recordings:
    names = [("0.5C", 10), ("1C", 0), ("1C", 10), ("1C", 25), ("2C", 0), ("2C", 10), ("2C", 25)]

    def read(folder: Path, name: str, degrees: int) -> RealTest:
        raw = matlab(recording(folder, lg_m50.RATES))
        return lg_m50.rate(raw, degrees, name)

    return {
        f"{name} {degrees} degC": partial(read, name=name, degrees=degrees)
        for name, degrees in names
    }


def _panasonics() -> Recordings:
    def read(folder: Path, name: str) -> RealTest:
        return panasonic.read(folder, panasonic.HELD_OUT[name], name)[0]

    return {name: partial(read, name=name) for name in panasonic.HELD_OUT}


def _about_energies(chemistry: str) -> Recordings:
    def read(folder: Path, name: str) -> RealTest:
        return about_energy.read(folder, chemistry, name, files[name])

    files = about_energy.FIT | about_energy.HELD_OUT
    return {name: partial(read, name=name) for name in ("1C", "2C", "drive cycle")}


def _melastas() -> Recordings:
    return {name: partial(_melasta_test, name=name) for name in ("5C", "9.1C")}


def _leafs() -> Recordings:
    return {f"{k}C": partial(leaf_cell.discharge, times=k) for k in (2, 3)}


SAMSUNG_OF = "Samsung 30Q, ARTS-Laboratory, CC BY-SA 4.0"
LG_OF = "LG M50, WMG Warwick, BSD-3"
LATE = ("clock_shift",)
"""Of the four drive cycles: their voltage is a sample, 0.1 s, later than their current (correlation
of the changes of both from sample to sample), that of the pulses is not. Found after the judge had
named it in the first of them."""
PANASONIC_OF = "Panasonic NCR18650PF, Kollmeyer, U Wisconsin-Madison"


def _steady(test: RealTest) -> RealTest:
    return every(test, STEP_S)


def _driven(test: RealTest) -> RealTest:
    return binned(test.part(slice(0, int(np.searchsorted(test.time_s, DRIVEN_S)))), DRIVE_S)


def _as_it_is(test: RealTest) -> RealTest:
    return test


def _either(test: RealTest) -> RealTest:
    return binned(test, DRIVE_S) if test.name == "drive cycle" else every(test, STEP_S)


def _cell(  # noqa: PLR0913
    source: str, given: Callable[[Path], Given], recordings: Recordings,
    thin: Callable[[RealTest], RealTest] = _steady, *, rests: bool = True,
    also: tuple[str, ...] = (),
) -> Material:  # fmt: skip
    def base(folder: Path, cache: Path) -> Base:
        return base_of(given(folder), cache)

    return Material(source, base, recordings, thin, rests, also)


CELLS: Mapping[str, Material] = {
    "samsung": _cell(SAMSUNG_OF, _samsung, _samsungs("S001")),
    "samsung_2": _cell(SAMSUNG_OF, _samsung_2, _samsungs("S002")),
    "samsung_slow": _cell(SAMSUNG_OF, lambda f: _slow(_samsung(f)), _samsungs("S001")),
    "lg_m50": _cell(LG_OF, _lg_m50, _lg_m50s()),
    "lg_m50_slow": _cell(LG_OF, lambda f: _slow(_lg_m50(f)), _lg_m50s()),
    "panasonic": _cell(PANASONIC_OF, _panasonic, _panasonics(), _driven, also=LATE),
    "panasonic_slow": _cell(
        PANASONIC_OF, lambda f: _slow(_panasonic(f)), _panasonics(), _driven, also=LATE
    ),
    "melasta": _cell("Melasta SLPBA842124HV, SINTEF", _melasta, _melastas(), _as_it_is),
    "leaf": _cell("Nissan Leaf cell, batterysim, MIT", _leaf, _leafs(), _as_it_is, rests=False),
    "nmc": Material(
        "NMC111 pouch, About:Energy, CC BY-SA 4.0", _published(about_energy.nmc),
        _about_energies("nmc"), _either, rests=False,
    ),
    "lfp": Material(
        "LFP 18650, About:Energy, CC BY-SA 4.0", _published(about_energy.lfp),
        _about_energies("lfp"), _either, rests=False,
    ),
}  # fmt: skip
"""By the keys of `heat_list`."""
