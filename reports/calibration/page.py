"""`calibration_page`: the sections in their order."""

from collections.abc import Callable

from reports.calibration.cells import cells
from reports.calibration.errors import errors
from reports.calibration.fits import fits
from reports.calibration.further import further, remarks
from reports.calibration.identifiability import identifiability
from reports.calibration.parameters import parameters
from reports.calibration.report import CalibrationReport
from reports.calibration.summary import summary
from reports.page import Page
from reports.quantity import significant
from reports.section import Row, Section
from twin.calibrate.resample import FLOOR_V
from twin.cell_mesh import mesh_of


def calibration_page(report: CalibrationReport) -> Page:
    """The page of one calibration; sections with nothing to say are left out."""
    made = (section(report) for section in CALIBRATION_SECTIONS)
    return Page(
        title=f"{report.pack or 'Pack'}: calibrated cell",
        subtitle="What reference tests tell about this pack's cell",
        sections=tuple(section for section in made if section is not None),
        version=report.version,
    )


def provenance(report: CalibrationReport) -> Section:
    """From what, and how."""
    found = report.found
    search = f"{report.evaluations} evaluations, seed {report.seed}"
    physics = ", ".join(e.id.replace("_", " ") for e in found.problem.pack.effects)
    mesh = mesh_of(found.problem.pack.cell)
    layers = mesh.negative, mesh.separator, mesh.positive
    orders = ", ".join("+".join(map(str, layer.orders)) for layer in layers)
    return Section(
        id="provenance",
        title="Where this comes from",
        rows=(
            *(Row(label=f.name, value=f.sha256[:16], note="test, SHA-256") for f in report.files),
            Row(
                label="Model",
                value=f"P2D, {physics or 'isothermal'}",
                note=f"polynomials of order {orders} over the layers",
            ),
            Row(
                label="Fit",
                value="least squares with priors",
                note=f"each sample weighed by its noise and {significant(1e3 * FLOOR_V)} mV; a "
                "test that the model misses weighs less",
            ),
            Row(label="Search", value=search if report.evaluations else "none"),
        ),
    )


CALIBRATION_SECTIONS: tuple[Callable[[CalibrationReport], Section | None], ...] = (
    summary, fits, errors, parameters, cells, identifiability, further, remarks, provenance,
)  # fmt: skip
