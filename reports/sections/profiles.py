"""Each motion's current as a waveform that repeats, and how faithful it is."""

from reports import plots
from reports.flight import FlightReport
from reports.quantity import fixed
from reports.section import Cell, Column, Figure, Notice, Section, Table
from segment.profile import PeriodicProfile, TooLittle

COLUMNS = (
    Column(title="motion", numeric=False),
    Column(title="period [s]"),
    Column(title="made from [s]"),
    Column(title="Δ mean [A]"),
    Column(title="Δ RMS [A]"),
    Column(title="Δ 1 % [A]"),
    Column(title="Δ 50 % [A]"),
    Column(title="Δ 99 % [A]"),
    Column(title="Δ ripple spectrum [%]"),
    Column(title="ramp rates, KS"),
    Column(title="seam [A]"),
)
NOTE = (
    "Δ is profile minus segments. The ripple spectrum's deviation is relative and RMS over "
    "frequency; KS is the largest distance between the two distributions of dI/dt, 0 to 1; the "
    "seam is the jump where the waveform repeats."
)


def profiles(report: FlightReport) -> Section | None:
    """None if no motion was asked for."""
    if not report.profiles:
        return None
    made = [p for p in report.profiles.values() if isinstance(p, PeriodicProfile)]
    return Section(
        id="profiles",
        title="Periodic profile of each motion",
        lead=("The waveform that stands for a motion when a flight is repeated many times.",),
        notices=_missing(report),
        figures=(_figure(made),) if made else (),
        tables=(_table(made),) if made else (),
        notes=(NOTE,) if made else (),
    )


def _missing(report: FlightReport) -> tuple[Notice, ...]:
    """Motions without a profile; those that were not flown in one sentence."""
    missing = [p for p in report.profiles.values() if isinstance(p, TooLittle)]
    few = [
        Notice(text=f"{plots.motion_name(p.motion).capitalize()}: no profile. {p.reason}")
        for p in missing
        if p.source_s
    ]
    none = ", ".join(plots.motion_name(p.motion) for p in missing if not p.source_s)
    if none:
        few.append(Notice(text=f"No profile of motions that this flight does not have: {none}."))
    return tuple(few)


def _figure(made: list[PeriodicProfile]) -> Figure:
    canvas, axes = plots.panels([1.6] * len(made), share_x=False)
    for ax, profile in zip(axes, made, strict=True):
        t, i = plots.decimate(profile.time_s, profile.current_A)
        ax.plot(t, i, color=plots.MEASURED)
        ax.set_facecolor((*plots.rgb(profile.motion), 0.15))
        ax.set_title(plots.motion_name(profile.motion), loc="left", fontsize=10)
        ax.set_ylabel("current [A]")
        ax.set_xlim(0.0, profile.period_s)
    axes[-1].set_xlabel("time in the period [s]")
    named = ", ".join(f"{p.motion.value} over {fixed(p.period_s, 1)} seconds" for p in made)
    return Figure(
        caption="One period of each; the end joins the start.",
        description=f"Current over one period: {named}.",
        svg=plots.to_svg(canvas, "profiles"),
    )


def _table(made: list[PeriodicProfile]) -> Table:
    return Table(
        caption="Fidelity of the profiles",
        columns=COLUMNS,
        rows=tuple(tuple(Cell(text=text) for text in _texts(p)) for p in made),
    )


def _texts(p: PeriodicProfile) -> tuple[str, ...]:
    f = p.fidelity
    return (
        plots.motion_name(p.motion),
        fixed(p.period_s, 1),
        f"{fixed(p.source_s, 1)} in {p.segments}",
        fixed(f.mean_A, 3),
        fixed(f.rms_A, 3),
        *(fixed(value, 3) for value in f.percentile_A),
        fixed(100 * f.ripple_spectrum, 1),
        fixed(f.ramp_rate, 3),
        fixed(f.seam_A, 2),
    )
