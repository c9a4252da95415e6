"""Of `result.json`: the twin's answer, and what made it."""

from reports.parts.part import NotNegative, Part, Sha256, Share


class LithiumPart(Part):
    """The lithium of one cell, at the start and at the end."""

    negative_mol: tuple[float, float]
    """In the negative electrode, at start and end."""
    positive_mol: tuple[float, float]
    electrolyte_mol: tuple[float, float]
    lost_mol: dict[str, tuple[float, float]]
    """In SEI, on cracks, plated, dead, trapped; empty where no ageing is switched on."""
    relative_error: float
    """Change of the sum over the sum."""
    charge_error_c: float
    """Charge of the load minus what the positive electrode took up."""


class ReplayPart(Part):
    """The twin's answer to the recorded current."""

    voltage_rmse_mv: float | None
    """Root mean square of recorded minus simulated pack voltage, from take-off to landing."""
    max_error_mv: float | None
    final_soc: float | None
    max_temperature_c: float | None
    """Simulated."""
    lithium_audit: LithiumPart
    status: str
    """`done`, or why the simulation ended early."""
    status_text: str
    simulated_s: NotNegative
    """How far the simulation came."""


class ParametersPart(Part):
    """The numbers that were chosen for the twin."""

    initial_soc: Share
    initial_temperature_c: float
    ambient_c: float
    heat_transfer_W_m2_K: float
    physics: tuple[str, ...]
    inputs_sha256: Sha256
    """Of log, sensor, pack file, its cell and calibration, options and version; equal inputs give
    an equal result."""


class ProvenancePart(Part):
    """What made this result."""

    version: str
    cell: str
    """Where the numbers of the cell come from."""
    parameters: ParametersPart
    solver: str
    seconds: NotNegative
    """Wall time from opening the log to the finished result."""
    files: tuple[str, ...] = ()
    """Names of the others that were written with it, into the same folder."""
