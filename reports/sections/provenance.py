"""What made this page, enough to make it again."""

from reports.flight import FlightReport
from reports.quantity import celsius, fixed, significant
from reports.section import Row, Section


def provenance(report: FlightReport) -> Section:
    """Inputs, versions, parameters."""
    made, pack, origins = report.provenance, report.pack, report.pack.origins
    return Section(
        id="provenance",
        title="Provenance",
        rows=(
            Row(label="Log", value=report.log.name, note=f"SHA-256 {made.sha256}"),
            *_other_files(report),
            Row(label="Program", value=f"drone-battery-health {made.version}"),
            Row(label="Cell", value=pack.cell, note=pack.cell_source),
            Row(
                label="Heat transfer",
                value=significant(pack.heat_transfer_W_m2_K),
                unit="W/(m² K)",
                note=origins.get("heat_transfer_W_m2_K", ""),
            ),
            Row(
                label="Ambient temperature",
                value=celsius(pack.ambient_K),
                unit="°C",
                note=origins.get("ambient_K", ""),
            ),
            Row(label="Effects", value=", ".join(pack.effect_ids) or "none"),
            Row(label="Solver", value=made.solver),
            Row(label="Time taken", value=fixed(made.seconds, 1), unit="s"),
        ),
    )


def _other_files(report: FlightReport) -> tuple[Row, ...]:
    made = report.provenance
    rows = []
    if made.sensor_name:
        note = f"SHA-256 {made.sensor_sha256}" if made.sensor_sha256 else "could not be read"
        rows.append(Row(label="Current sensor", value=made.sensor_name, note=note))
    if made.pack_sha256:
        note = f"SHA-256 {made.pack_sha256}, with its cell file"
        rows.append(Row(label="Pack file", value=report.pack.name, note=note))
    return tuple(rows)
