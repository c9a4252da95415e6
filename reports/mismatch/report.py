"""`MismatchReport`: all that the page of a mismatch is made of."""

from dataclasses import dataclass

from twin.mismatch import Finding, Revealed


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """A recording as it was given; `sha256` is of the file."""

    name: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MismatchReport:
    """One finding.

    Attributes:
        finding: what came out.
        pack: its name, as the pack file has it.
        layout: cells in series and in parallel, e.g. 4S1P.
        physics: effects the twin had.
        recordings: that were given.
        adopted: name of the pack file that was written, or "".
        doubts: of the recordings, the pack file and its cell.
        version: of the program.
        concealed: channels that were kept from the twin.
        revealed: measured channels beside what the adopted twin says, looked at afterwards.
    """

    finding: Finding
    pack: str
    layout: str
    physics: tuple[str, ...]
    recordings: tuple[Recorded, ...]
    adopted: str
    doubts: tuple[str, ...]
    version: str
    concealed: tuple[str, ...] = ()
    revealed: tuple[Revealed, ...] = ()
