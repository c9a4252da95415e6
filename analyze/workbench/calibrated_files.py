"""The files of a calibration, side by side; each appears whole or not at all."""

from dataclasses import dataclass, field
from pathlib import Path

from analyze.version import version
from analyze.workbench.cells import cells_document
from reports.calibration import CalibrationReport, SourceFile, calibration_page
from reports.render import render
from twin.calibrate.out import cell_text, fit_text, pack_text
from twin.calibrate.run import Calibration
from twin.calibrate.search import Journal
from twin.calibrate.unlike import Unlike
from twin.mismatch.tested import OF_THE_MAKE, Tested
from twin.pack import Pack
from twin.pack_file import PackFile
from twin.whole_file import write_whole


@dataclass(frozen=True, slots=True)
class Files:
    """Their paths.

    Attributes:
        pack: the pack file, which the others lie beside.
    """

    pack: Path

    @property
    def cell(self) -> Path:
        """The calibrated cell as BPX."""
        return self.pack.with_suffix(".bpx.json")

    @property
    def fit(self) -> Path:
        """All that is known of the fit; what a later one goes on from."""
        return self.pack.with_suffix(".fit.json")

    @property
    def ageing(self) -> Path:
        """The fit to a life, where there was one."""
        return self.pack.with_suffix(".ageing.json")

    @property
    def page(self) -> Path:
        """The same for a person."""
        return self.pack.with_suffix(".html")

    @property
    def search(self) -> Path:
        """What the search has evaluated."""
        return self.pack.with_suffix(".search.json")

    @property
    def results(self) -> tuple[Path, ...]:
        """What a calibration replaces."""
        return self.pack, self.cell, self.page

    @property
    def traces(self) -> tuple[Path, ...]:
        """What nothing but a calibration leaves: one of them says whose the results are."""
        return self.fit, self.ageing, self.search


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """What a calibration was made from.

    Attributes:
        pack: whose cell was calibrated,
        file: and its file.
        tests: as they were given.
        seed: of the search.
        doubts: of the pack's cell.
        unlike: the cells beside it, where their voltages were measured.
        standard_errors: of effects' numbers by the tests, once they are known.
    """

    pack: Pack
    file: PackFile
    tests: tuple[SourceFile, ...]
    seed: int
    doubts: tuple[str, ...]
    unlike: Unlike | None = None
    standard_errors: Tested = field(default_factory=dict)


def in_the_way(files: Files) -> Path | None:
    """A folder that has the name of one of them."""
    return next((path for path in (*files.results, *files.traces) if path.is_dir()), None)


def of_another(files: Files) -> Path | None:
    """A file with the name of a result that no earlier calibration left."""
    if any(path.exists() for path in files.traces):
        return None
    return next((path for path in files.results if path.exists()), None)


def write_fit(files: Files, found: Calibration, frame: Frame, journal: Journal) -> None:
    """All but the page; an earlier page goes, and a fit to a life: they are not of this fit."""
    for old in (files.page, files.ageing):
        old.unlink(missing_ok=True)
    unlike = frame.unlike
    write_whole(files.fit, fit_text(found, {"cells": cells_document(unlike)} if unlike else None))
    write_whole(files.cell, cell_text(found))
    weak = unlike.weak if unlike else ()
    stated = {id_: n for id_, n in frame.file.standard_errors.items() if id_ not in OF_THE_MAKE}
    text = pack_text(
        found,
        frame.pack,
        frame.file,
        cell=files.cell.name,
        weak=weak,
        standard_errors=stated | dict(frame.standard_errors),
    )
    write_whole(files.pack, text)
    keep_search(files, journal)


def write_page(files: Files, found: Calibration, frame: Frame, journal: Journal) -> None:
    """The page of what `write_fit` wrote."""
    report = CalibrationReport(
        found=found,
        pack=frame.file.pack.name,
        pack_file=files.pack.name,
        layout=f"{frame.pack.series}S{frame.pack.parallel}P",
        files=frame.tests,
        evaluations=len(journal),
        seed=frame.seed,
        doubts=frame.doubts,
        version=version(),
        unlike=frame.unlike,
    )
    write_whole(files.page, render(calibration_page(report)))


def keep_search(files: Files, journal: Journal) -> None:
    """The search beside the fit it belongs to; none where nothing was searched."""
    if len(journal):
        write_whole(files.search, journal.to_json())
    else:
        files.search.unlink(missing_ok=True)
