"""Where a flight and its twin differ: the short form of `twin explain`, for every report."""

from collections.abc import Sequence

from analyze.pack_choice import PackChoice
from flightlogs.recording import Recording
from reports.flight import NoMismatch, PackUse
from segment import motions_at
from segment.segment import Segment
from twin.calibrate.doubt import Other, cells_drawn
from twin.calibrate.table import CalibrationError
from twin.mismatch import (
    HYPOTHESES,
    Finding,
    Flight,
    Hypothesis,
    MismatchError,
    Verdict,
    explain,
)
from twin.mismatch.allowed import CELLS
from twin.pack import Pack
from twin.replay import Replay

NOT_ITS_TWIN = (
    "Without a pack file a built-in cell stands in for the pack's own{fitted}. What is left says "
    "where the twin is off, not why: no cause is looked for."
)
ITS_VOLTAGE = ", fitted to this flight, and such a fit takes up whatever looks like it"
BUILT_IN = (
    "The cell of the pack file is a built-in one: what looks like a missing effect may be the "
    "difference between that cell and the pack's own. Calibrate first, with `twin calibrate`."
)
UNSTATED = (
    "The pack file does not state by how much this twin errs (twin.cell_error_mv): it is taken for "
    "as exact as its numerics, and part of its own error may have been named as an effect. "
    "`twin calibrate` with two tests or more writes that number."
)


def allowed_of(pack: Pack, choice: PackChoice | None) -> tuple[tuple[Other, ...], tuple[str, ...]]:
    """Cells that the tests of the pack's calibration allow as well, and why if there are none.

    Nothing is said of a pack that was not calibrated.
    """
    doubt = choice.cell_doubt if choice else None
    try:
        return (cells_drawn(pack, doubt, CELLS) if doubt else ()), ()
    except CalibrationError as e:
        return (), (f"What the calibration leaves open is not known, and counts as nothing: {e}.",)


def mismatch_of(  # noqa: PLR0913
    recording: Recording, segments: Sequence[Segment], use: PackUse, pack: Pack, played: Replay,
    *, choice: PackChoice | None = None,
) -> Finding | NoMismatch:  # fmt: skip
    """The finding, or why there is none.

    Causes are looked for where a pack file was given. Without one the twin is not that of this
    pack, and a fit to the flight has taken up what could be told.

    Args:
        recording: of the flight.
        segments: its motions.
        use: how the numbers of the pack are known.
        pack: that was simulated.
        played: the recording beside it.
        choice: the pack file; None if there is none.
    """
    if any(w.code == "simulated_log" for w in recording.warnings):
        return NoMismatch("Its battery is a simulator's formula, which no cell follows.")
    allowed, untold = allowed_of(pack, choice)
    flight = Flight(
        name=recording.name,
        pack=pack,
        load=played.load,
        voltage_V=played.recorded_V,
        judged=played.judged,
        motion=motions_at(played.load.time_s, segments),
        temperature_K=recording.temperature_K,
        cell_voltage_V=recording.cell_voltage_V,
        allowed=allowed,
        start_std=use.soc_std,
    )
    as_configured = use.fitting is None
    try:
        found = explain([flight], hypotheses=quick(pack) if as_configured else (), short=True)
    except MismatchError as e:
        return NoMismatch(f"Too little to judge: {e}.")
    return found.remarked((*remarks_of(use, found.verdict), *untold))


def remarks_of(use: PackUse, verdict: Verdict, *, stated: bool = False) -> tuple[str, ...]:
    """What keeps a finding from being a diagnosis; where nothing is missing none is made.

    `stated`: the error of the twin is, elsewhere than in the pack file.
    """
    if use.fitting is not None:
        return (NOT_ITS_TWIN.format(fitted=ITS_VOLTAGE if use.fit else ""),)
    if verdict is Verdict.NONE:
        return ()
    if not use.calibrated:
        return (BUILT_IN,)
    return () if stated or use.cell_error_V else (UNSTATED,)


def quick(pack: Pack) -> tuple[Hypothesis, ...]:
    """Those that run on the kernel of the pack as it is: none is compiled for them."""

    def structure(p: Pack) -> tuple[bool, ...]:
        return p.ages, p.hysteretic, p.stressed

    return tuple(
        h for h in HYPOTHESES if structure(h.within(pack, h.begins(pack)[0])) == structure(pack)
    )
