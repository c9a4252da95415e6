"""A replay as a table and a drawing."""

import csv
import io

import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from twin.replay import Replay

COLUMNS = ("time_s", "current_A", "recorded_V", "simulated_V", "soc", "temperature_K", "heat_W")


def replay_csv(replay: Replay) -> str:
    """One row a sample, as far as simulated; empty where the voltage was not measured."""
    solution, m = replay.solution, replay.solution.time_s.size
    columns = (
        solution.time_s, solution.current_A, replay.recorded_V[:m], solution.voltage_V,
        solution.soc, solution.temperature_K, solution.heat_W,
    )  # fmt: skip
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in zip(*columns, strict=True):
        writer.writerow("" if np.isnan(value) else f"{value:.9g}" for value in row)
    return out.getvalue()


def replay_svg(replay: Replay) -> str:
    """Current, voltage and temperature over time."""
    solution, m = replay.solution, replay.solution.time_s.size
    canvas = Figure(figsize=(9.0, 6.5), layout="constrained")
    FigureCanvasSVG(canvas)
    current, voltage, temperature = canvas.subplots(3, 1, sharex=True)
    current.plot(solution.time_s, solution.current_A, linewidth=0.8)
    if np.isfinite(replay.recorded_V[:m]).any():
        voltage.plot(solution.time_s, replay.recorded_V[:m], linewidth=0.8, label="recorded")
    voltage.plot(solution.time_s, solution.voltage_V, linewidth=0.8, label="simulated")
    voltage.legend(loc="best", frameon=False)
    temperature.plot(solution.time_s, solution.temperature_K - 273.15, linewidth=0.8)
    current.set_ylabel("current [A]")
    voltage.set_ylabel("voltage [V]")
    temperature.set_ylabel("temperature [°C]")
    temperature.set_xlabel("time [s]")
    out = io.StringIO()
    canvas.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
