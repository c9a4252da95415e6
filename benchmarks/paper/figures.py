"""The paper's first figure in our form: current raw, smoothed, cut and made periodic; voltage."""

import numpy as np

from benchmarks.paper.flights import Flown
from reports import plots
from segment.runs import moving_average
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

SMOOTH_S = 2.0


def course_svg(of: Flown, pack: Pack) -> str:
    """Raw, smoothed and shaded by motion, voltage, and one period of each motion."""
    recording, made = of.recording, list(of.profiles.values())
    t, raw = recording.time_s, recording.current_A
    canvas, axes = plots.panels([1.8, 1.8, 1.6, *[1.4] * len(made)], share_x=False)
    answer = simulate(pack, Load(time_s=t, current_A=raw))
    plots.line(axes[0], t, raw, plots.MEASURED, "raw")
    plots.shade(axes[1:2], of.segments)
    plots.line(axes[1], t, moving_average(t, raw, SMOOTH_S), plots.MEASURED, "smoothed, cut")
    plots.line(axes[2], answer.time_s, answer.voltage_V, plots.SIMULATED, "voltage, simulated")
    for ax, label in zip(axes[:3], ("current [A]", "current [A]", "voltage [V]"), strict=True):
        ax.set_xlim(float(t[0]), float(t[-1]))
        ax.set_ylabel(label)
        plots.legend(ax)
    axes[2].set_xlabel("time [s]")
    for ax, profile in zip(axes[3:], made, strict=True):
        ax.plot(profile.time_s, profile.current_A, color=plots.MOTION_COLOUR[profile.motion])
        ax.set_title(f"periodic: {plots.motion_name(profile.motion)}", loc="left", fontsize=10)
        ax.set_ylabel("current [A]")
        ax.set_xlim(0.0, float(np.max(profile.time_s)))
    axes[-1].set_xlabel("time in the period [s]")
    plots.motion_key(canvas, of.segments)
    return plots.to_svg(canvas, "paper")
