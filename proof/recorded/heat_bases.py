"""What each cell of `heat_list` is calibrated from.

A base sees whatever was recorded of its cell but what its trial is about: rates and temperatures
beyond those of the trial too, with the temperature that was measured there.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

from proof.recorded import about_energy, leaf_cell, lg_m50, panasonic, samsung
from proof.recorded.base import Base, Given, base_of, charged_to
from proof.recorded.bodies import LEAF, LG_M50, MELASTA, PANASONIC, SAMSUNG
from proof.recorded.heat_recordings import (
    FLOWN,
    Recordings,
    about_energies,
    as_it_is,
    driven,
    either,
    leaf_test,
    leafs,
    lg_m50_other,
    lg_m50_others,
    lg_m50_warm,
    lg_m50s,
    melasta_test,
    melastas,
    panasonics,
    pulsed,
    samsung_test,
    samsungs,
    steady,
)
from proof.recorded.measured import (
    RealCell,
    RealTest,
    discharge_of,
    held_V,
    matlab,
    narrow,
    recorded_parts,
    recording,
    rms_A,
)
from proof.recorded.replay import answer, errors
from proof.recorded.thinned import until
from twin.builtin import load_cell
from twin.pack import Pack

DRIVEN = 0.6  # of the charge of a test, which is drawn in that time
WARM, COOL = "US06 25 degC", "US06 10 degC"  # the cell had aged before the other cycles
COLD_PULSES = "pulses 0 degC"
AGAIN_1C = "03-10-17_23.36_3349_Dis1C_2.mat"
SHORT_PULSES = (
    "negative.stoichiometry_max", "negative.stoichiometry_min", "positive.stoichiometry_max",
    "capacity_C", "series_resistance_ohm", "negative.exchange_current_A_m2",
    "positive.exchange_current_A_m2",
)  # fmt: skip
"""What slow discharges and the first seconds of pulses tell."""


class BaseOf(Protocol):
    """What stands for a cell."""

    def __call__(
        self, folder: Path, cache: Path, concealed: Collection[str], *, asked_A: float = 0.0
    ) -> Base:
        """Calibrated to recordings in `folder`, kept in `cache`.

        Args:
            folder: of the recordings.
            cache: folder of calibrations.
            concealed: names of the recordings that it must not see.
            asked_A: rms current of a trial that is on another cell of the make.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A cell of the list.

    Attributes:
        source: of its recordings.
        base: what stands for it.
        recordings: name -> reader.
        thin: what is given of a recording.
        rests: its recordings begin at rest, whose voltage tells the charge.
    """

    source: str
    base: BaseOf
    recordings: Recordings
    thin: Callable[[RealTest], RealTest]
    rests: bool


POWER = 0.6
"""Of a cell made for power: thickness of its coatings over those of the LG M50, which a calibration
keeps. With it 4C of the Samsung, fitted, is missed by 16 instead of 51 mV; pulses, 1C and 2C of the
Leaf by 3.5, 3.3 and 2.5 instead of 5.0, 4.5 and 3.0."""


def thinner(pack: Pack, factor: float) -> Pack:
    """With coatings so many times as thick, on the more area."""
    cell = pack.cell
    n, p = (replace(e, thickness_m=factor * e.thickness_m) for e in (cell.negative, cell.positive))
    thin = replace(
        cell, negative=n, positive=p, nominal_capacity_C=factor * cell.nominal_capacity_C
    )
    return replace(pack, cell=thin)


def _scaled(slow: RealTest, name: str = "lg_m50") -> Pack:
    """A built-in cell with the charge that a slow discharge gave."""
    return Pack(cell=load_cell(name), capacity_C=float(slow.drawn_C[-1]))


def _samsung(folder: Path, concealed: Collection[str], cell: str = "S001") -> Given:
    """Of S002 only 1C and faster is there; the slow test and pulses are those of S001.

    Not fitted: 1C of the other of the two.
    """
    slow, pulses = samsung.read(folder, "C10"), samsung.pulses(folder)
    unseen = (samsung_test(folder, "1C", "S002" if cell == "S001" else "S001"),)
    fast = (samsung_test(folder, n, cell) for n in ("2C", "3C", "4C") if n not in concealed)
    tests = (slow, samsung_test(folder, "1C", cell), pulses, *fast)
    return Given(
        start=thinner(_scaled(slow), POWER), tests=tests, unseen=unseen, body=SAMSUNG
    )  # fmt: skip


def _samsung_slow(folder: Path, concealed: Collection[str]) -> Given:
    given = _samsung(folder, (*concealed, "2C", "3C", "4C"))
    return _slow(given)


def _lg_m50(folder: Path, concealed: Collection[str]) -> Given:
    """Not fitted: 0.5C at 0 degC, which no trial of this cell uses."""
    rates, pulses = (matlab(recording(folder, f)) for f in (lg_m50.RATES, lg_m50.PULSES))
    slow = lg_m50.rate(rates, 25, "0.1C")
    short = (lg_m50.pulse(pulses, tenths, slow) for tenths in lg_m50.PULSED)
    others = (read(folder) for name, read in lg_m50s().items() if name not in concealed)
    start = Pack(cell=load_cell("lg_m50"))
    half, cold = (until(lg_m50.rate(rates, degrees, "0.5C"), FLOWN) for degrees in (25, 0))
    tests = (slow, half, *short, *others)
    return Given(start=start, tests=tests, unseen=(cold,), body=LG_M50)


def _lg_m50_2(folder: Path, concealed: Collection[str]) -> Given:
    """The others' tests, but what was drawn as fast and as cold; and cell 786 at 25 degC."""
    same = {name.split(",")[0] for name in concealed}
    own = lg_m50_other(folder, 786, "0.5C", 25)
    given = _lg_m50(folder, same)
    slow, _, *others = given.tests
    return replace(given, tests=(slow, own, *others))


def _lg_m50_slow(folder: Path, concealed: Collection[str]) -> Given:
    return _slow(_lg_m50(folder, (*concealed, *lg_m50s())))


def _panasonic(folder: Path, concealed: Collection[str]) -> Given:
    """C/20, and of the others the charge that the trials use.

    Every third stretch of the pulses at 25 degC, and WARM and COOL if they are not concealed. The
    pulses at 0 degC are two months of cycles later: they are there too if the trial is later still,
    or if nothing else is cold. Not fitted: 1C on another day, and the stretches that follow those.
    """
    given = _panasonic_slow(folder, ())
    one, again = (_panasonic_1c(folder, file) for file in (panasonic.ONE_C, AGAIN_1C))
    warm, cold = (_panasonic_pulses(folder, degrees) for degrees in (25, 0))
    if set(concealed) == {WARM} or COLD_PULSES in concealed:
        cold = ()
    slow, *short = given.tests
    return replace(
        given, tests=(slow, one, *short, *cold[::3]), only=None,
        driven=tuple(
            driven(panasonic.cycle(folder, name)) for name in (WARM, COOL) if name not in concealed
        ),
        unseen=(again, *warm[1::3], *cold[1::3]),
    )  # fmt: skip


def _panasonic_slow(folder: Path, concealed: Collection[str]) -> Given:  # noqa: ARG001
    slow = panasonic.slow(folder)
    one = _panasonic_1c(folder, panasonic.ONE_C)
    short = _panasonic_pulses(folder, 25)[::3]
    return Given(
        start=_scaled(slow), tests=(slow, *short), unseen=(one,), body=PANASONIC, only=SHORT_PULSES
    )


def _panasonic_1c(folder: Path, file: str) -> RealTest:
    return until(discharge_of(panasonic.read(folder, file, f"1C 25 degC, {file[:8]}")[0]), DRIVEN)


def _panasonic_pulses(folder: Path, degrees: int) -> tuple[RealTest, ...]:
    """Stretches that begin before so much was drawn."""
    whole = panasonic.pulses(folder, degrees)
    return recorded_parts(until(whole, DRIVEN))


def _melasta(folder: Path, concealed: Collection[str]) -> Given:
    names = [n for n in ("C/10", "1C", "2C", "5C", "9.1C") if n not in concealed]
    tests = tuple(melasta_test(folder, name) for name in names)
    start = _scaled(tests[0], "lipo_2200")
    start = replace(start, cell=charged_to(start.cell, 4.35, 3.0))
    return Given(start=start, tests=tests, body=MELASTA)


def _leaf(folder: Path, concealed: Collection[str]) -> Given:
    """Full is that of the trial: its pulses are of another charge than its discharges.

    So are those that are warm and cold, which a trial on the others of them needs: what a twin
    says of temperature hangs on its activation energies. Its temperature is that of the chamber.
    """
    pulses = leaf_cell.pulses(folder)
    given = held_V(replace(until(pulses, FLOWN), temperature_K=None))
    one, again = (until(leaf_cell.discharge(folder, 1, which), FLOWN) for which in (0, 1))
    fast = (leaf_test(folder, k) for k in (2, 3) if f"{k}C" not in concealed)
    warm_and_cold = {name: read for name, read in leafs().items() if name.startswith("pulses")}
    if warm_and_cold.keys() & concealed:
        others = (read(folder) for name, read in warm_and_cold.items() if name not in concealed)
        tests = (given, one, *(held_V(until(test, FLOWN)) for test in others), *fast)
    else:
        tests = (one, given, *fast)
    start = thinner(leaf_cell.start_cell(pulses), POWER)
    return Given(start=start, tests=tests, unseen=(again,), body=LEAF)


def _slow(given: Given) -> Given:
    """Without the whole test that is not the slowest, which is its check, in SHORT_PULSES alone."""
    faster, others = given.tests[1], (given.tests[0], *given.tests[2:])
    return replace(given, tests=others, unseen=(faster,), only=SHORT_PULSES)


def _published(make: Callable[[Path], RealCell]) -> BaseOf:
    """As its publisher measured it; its own error is that of the slowest test."""

    def base(
        folder: Path,
        cache: Path,  # noqa: ARG001
        concealed: Collection[str],  # noqa: ARG001
        *,
        asked_A: float = 0.0,  # noqa: ARG001
    ) -> Base:
        cell = make(folder)
        slow = cell.fit[0]
        off = errors(answer(cell.baseline, slow), slow)
        pack = replace(cell.baseline, cell=narrow(cell.baseline.cell))
        return Base(
            pack=pack, series_resistance_ohm=0.0, cooling={},
            warming_K=0.0, full_soc=pack.initial_soc,
            errors_V={slow.name: 1e-3 * off.rms}, fitted_V={},
        )  # fmt: skip

    return base


SAMSUNG_OF = "Samsung 30Q, ARTS-Laboratory, CC BY-SA 4.0"
LG_OF = "LG M50, WMG Warwick, BSD-3"
LG_2_OF = "LG M50, cells 786 and 796 (TEC-reduced-model), BSD-3"
PANASONIC_OF = "Panasonic NCR18650PF, Kollmeyer, U Wisconsin-Madison"


def _cell(
    source: str, given: Callable[[Path, Collection[str]], Given], recordings: Recordings,
    thin: Callable[[RealTest], RealTest] = steady, *, rests: bool = True,
) -> Material:  # fmt: skip
    def base(
        folder: Path, cache: Path, concealed: Collection[str], *, asked_A: float = 0.0
    ) -> Base:
        asked = [recordings[name](folder) for name in concealed]
        asked_A = max((rms_A(test) for test in asked), default=asked_A)
        mounts = {test.mount for test in asked}
        mount = mounts.pop() if len(mounts) == 1 else ""
        return base_of(replace(given(folder, concealed), asked_A=asked_A, mount=mount), cache)

    return Material(source, base, recordings, thin, rests)


CELLS: Mapping[str, Material] = {
    "samsung": _cell(SAMSUNG_OF, _samsung, samsungs("S001")),
    "samsung_2": _cell(SAMSUNG_OF, partial(_samsung, cell="S002"), samsungs("S002")),
    "samsung_slow": _cell(SAMSUNG_OF, _samsung_slow, samsungs("S001")),
    "lg_m50": _cell(LG_OF, _lg_m50, {**lg_m50s(), **lg_m50_warm()}),
    "lg_m50_slow": _cell(LG_OF, _lg_m50_slow, lg_m50s()),
    "lg_m50_2": _cell(LG_2_OF, _lg_m50_2, lg_m50_others(), as_it_is),
    "panasonic": _cell(PANASONIC_OF, _panasonic, panasonics(), driven),
    "panasonic_slow": _cell(PANASONIC_OF, _panasonic_slow, panasonics(), driven),
    "melasta": _cell("Melasta SLPBA842124HV, SINTEF", _melasta, melastas(), as_it_is),
    "leaf": _cell("Nissan Leaf cell, batterysim, MIT", _leaf, leafs(), pulsed, rests=False),
    "nmc": Material(
        "NMC111 pouch, About:Energy, CC BY-SA 4.0", _published(about_energy.nmc),
        about_energies("nmc"), either, rests=False,
    ),
    "lfp": Material(
        "LFP 18650, About:Energy, CC BY-SA 4.0", _published(about_energy.lfp),
        about_energies("lfp"), either, rests=False,
    ),
}  # fmt: skip
"""By the keys of `heat_list`."""
