"""`CalibrationReport`: all that the page of a calibration is made of."""

from dataclasses import dataclass

from twin.calibrate.run import Calibration
from twin.calibrate.unlike import Unlike


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceFile:
    """A test as it was given.

    Attributes:
        name: of the test.
        sha256: of the file.
    """

    name: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CalibrationReport:
    """One calibration.

    Attributes:
        found: what came out.
        pack: its name, as the pack file has it.
        pack_file: name of the one that was written.
        layout: cells in series and in parallel, e.g. 4S1P.
        files: the tests that were given.
        evaluations: of the search; 0 where there was none.
        seed: of its random numbers.
        doubts: of the pack file and its cell.
        version: of the program.
        unlike: the cells beside the calibrated one; None where their voltages were not measured.
    """

    found: Calibration
    pack: str
    pack_file: str
    layout: str
    files: tuple[SourceFile, ...]
    evaluations: int
    seed: int
    doubts: tuple[str, ...]
    version: str
    unlike: Unlike | None = None
