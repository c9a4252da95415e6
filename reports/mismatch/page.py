"""`mismatch_page`: the sections in their order."""

from reports.mismatch.candidates import candidates
from reports.mismatch.effects import effects
from reports.mismatch.follows import follows
from reports.mismatch.improved import improved
from reports.mismatch.located import located
from reports.mismatch.report import MismatchReport
from reports.mismatch.revealed import revealed
from reports.mismatch.summary import summary
from reports.page import Page
from reports.section import Row, Section


def mismatch_page(report: MismatchReport) -> Page:
    """The page of one finding; sections with nothing to say are left out."""
    made = (
        summary(report),
        located(report),
        *effects(report),
        improved(report),
        revealed(report),
        follows(report),
        candidates(report),
        provenance(report),
    )
    return Page(
        title=f"{report.pack or 'Pack'}: twin and recordings",
        subtitle="Where they differ, and what was left out",
        sections=tuple(section for section in made if section is not None),
        version=report.version,
    )


def provenance(report: MismatchReport) -> Section:
    """From what, and how."""
    ahead = {c.name for c in report.finding.courses if c.judged_ahead.any()}
    fitted = {c.name for c in report.finding.courses if (c.judged & ~c.judged_ahead).any()}

    def role(name: str) -> str:
        both = [w for w, who in (("fitted", fitted), ("held out", ahead)) if name in who]
        return " and ".join(both) + ", SHA-256"

    return Section(
        id="provenance",
        title="Where this comes from",
        rows=(
            *(Row(label=f.name, value=f.sha256[:16], note=role(f.name)) for f in report.recordings),
            Row(
                label="Twin as configured",
                value=f"P2D, {', '.join(report.physics).replace('_', ' ') or 'isothermal'}",
            ),
            Row(label="Kept from the twin", value=", ".join(report.concealed) or "nothing"),
        ),
    )
