"""The drawings of the workbench, as files of their own."""

import io
from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from analyze.workbench.cases import Answer
from reports.plots import COMMANDED, MEASURED, SIMULATED, STYLE, decimate, legend, panels
from twin.ageing import Cycle
from twin.constants import ZERO_CELSIUS_K

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DASHES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (8, 2)), (0, (1, 3)))
BESIDE = 8  # lines a legend above the panel has room for
MECHANISMS = {  # field of LostLithium -> name, colour (Okabe and Ito)
    "sei_C": ("SEI", "#0072b2"),
    "sei_on_cracks_C": ("SEI on cracks", "#56b4e9"),
    "plated_C": ("plated (can return)", "#e69f00"),
    "dead_C": ("dead", "#d55e00"),
    "trapped_C": ("trapped in lost material", "#8c8c8c"),
}


def to_file(canvas: Figure) -> str:
    """A whole SVG file; the same input gives the same bytes."""
    out = io.StringIO()
    with mpl.rc_context(STYLE):
        canvas.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()


def replay_svg(done: Sequence[Answer]) -> str:
    """Voltage and temperature of every case; over charge for discharges, else over time."""
    rates = done[0].case.rate is not None
    canvas, axes = panels((3.4, 2.0) if rates else (1.6, 3.0, 1.8))
    voltage, temperature = axes[-2:]
    for answer, look in zip(done, _looks(done), strict=True):
        s, load = answer.replay.solution, answer.case.load
        m = s.time_s.size
        x = load.drawn_C()[:m] / 3600 if rates else s.time_s
        if not rates:
            axes[0].plot(*decimate(x, s.current_A), **look)
        voltage.plot(*decimate(x, s.voltage_V), label=answer.case.name.replace("$", r"\$"), **look)
        temperature.plot(*decimate(x, s.temperature_K - ZERO_CELSIUS_K), **look)
    recorded = next((a.replay for a in done if np.isfinite(a.replay.recorded_V).any()), None)
    if recorded is not None:
        known = np.isfinite(recorded.recorded_V)
        line = decimate(recorded.load.time_s[known], recorded.recorded_V[known])
        voltage.plot(*line, color=MEASURED, linewidth=0.7, zorder=1, label="recorded")
    if not rates:
        axes[0].set_ylabel("current [A]")
    voltage.set_ylabel("voltage [V]")
    temperature.set_ylabel("temperature [°C]")
    temperature.set_xlabel("charge drawn [Ah]" if rates else "time [s]")
    _names(canvas, voltage)
    return to_file(canvas)


def _looks(done: Sequence[Answer]) -> list[dict[str, Any]]:
    """Colour by temperature (else by rate or factor), dashes by rate or factor."""
    cold = [a.case.load.ambient_K for a in done]
    strong = [a.case.rate or a.case.scale for a in done]
    first, second = (cold, strong) if len(set(cold)) > 1 else (strong, [0.0] * len(done))
    ranks = {v: i for i, v in enumerate(sorted(set(first)))}
    dashes = dict(zip(dict.fromkeys(second), cycle(DASHES), strict=False))
    colours = mpl.colormaps["plasma"]
    span = max(len(ranks) - 1, 1)
    if len(ranks) == 1:
        return [{"color": SIMULATED, "linestyle": dashes[s], "linewidth": 0.9} for s in second]
    return [
        {"color": colours(0.85 * ranks[f] / span), "linestyle": dashes[s], "linewidth": 0.9}
        for f, s in zip(first, second, strict=True)
    ]


def _names(canvas: Figure, ax: "Axes") -> None:
    if len(ax.get_lines()) <= BESIDE:
        legend(ax)
    else:
        canvas.legend(handles=ax.get_lines(), loc="outside right upper", frameon=False, fontsize=8)


def ageing_svg(cycles: Sequence[Cycle], kinds: Sequence[str], *, repeated: bool) -> str:
    """Capacity, losses, lithium by mechanism, and resistance over cycles.

    What a flight draws is shown beside the capacity if flights are `repeated` to the cut-off;
    else it is the load's, and the same for all. Of unlike cells each of `kinds` has a capacity.
    """
    n = [c.number for c in cycles]
    canvas, (capacity, loss, lithium, resistance) = panels((2.4, 2.0, 2.2, 1.8))
    _draw_capacity(capacity, cycles, kinds, repeated=repeated)
    for name, label, colour in (
        ("lithium_loss", "lithium (LLI)", "#0072b2"),
        ("negative_loss", "active material, negative", "#d55e00"),
        ("positive_loss", "active material, positive", "#009e73"),
    ):
        loss.plot(n, [100 * getattr(c.health, name) for c in cycles], color=colour, label=label)
    loss.set_ylabel("lost [%]")
    _draw_lithium(lithium, cycles)
    for name, label, colour in (
        ("resistance_ohm", "at once", "#0072b2"),
        ("resistance_10s_ohm", "after 10 s", "#e69f00"),
    ):
        values = [1000 * getattr(c.health, name) for c in cycles]
        resistance.plot(n, values, color=colour, label=label)
    resistance.set_ylabel("resistance [mΩ]")
    resistance.set_xlabel("cycle")
    for ax in (capacity, loss, resistance):
        legend(ax)
    return to_file(canvas)


def _draw_capacity(
    ax: "Axes", cycles: Sequence[Cycle], kinds: Sequence[str], *, repeated: bool
) -> None:
    n = [c.number for c in cycles]
    held = np.array([c.health.capacity_C for c in cycles])
    ax.plot(n, held / 3600, color=SIMULATED, label="in equilibrium, cut-off to cut-off")
    if cycles[0].health.cells:
        each = np.array([[k.health.capacity_C for k in c.health.cells] for c in cycles])
        for name, line, dash in zip(kinds, each.T / 3600, cycle(DASHES[1:]), strict=False):
            ax.plot(n, line, color=SIMULATED, linestyle=dash, label=f"{name} alone")
    if repeated:
        flown = np.array([np.nan if c.number == 0 else c.drawn_C for c in cycles])
        ax.plot(n, flown / 3600, color=COMMANDED, label="drawn in flight")
    ax.set_ylabel("charge [Ah]")
    percent_per_ah = 100 * 3600 / held[0]
    share = ax.secondary_yaxis(
        "right",
        functions=(
            lambda ah: np.multiply(ah, percent_per_ah),
            lambda pc: np.divide(pc, percent_per_ah),
        ),
    )
    share.set_ylabel("of the first capacity [%]", fontsize=9)
    share.tick_params(labelsize=9)


def _draw_lithium(ax: "Axes", cycles: Sequence[Cycle]) -> None:
    amounts = {f: [getattr(c.health.lost, f) / 3.6 for c in cycles] for f in MECHANISMS}
    ax.stackplot(
        [c.number for c in cycles],
        *amounts.values(),
        labels=[name for name, _ in MECHANISMS.values()],
        colors=[colour for _, colour in MECHANISMS.values()],
    )
    ax.set_ylabel("lithium lost [mAh]")
    ax.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(MECHANISMS),
        frameon=False,
        borderaxespad=0.1,
        fontsize=9,
    )
