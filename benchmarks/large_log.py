"""A 10-minute flight as a 20 MB ULog with its sensor CSV: `python -m benchmarks.large_log FOLDER`.

Writes the files; then time the whole process and its memory with
`/usr/bin/time -v analyze FOLDER/large.ulg --out FOLDER/out`. Most of a real log is attitude and raw
sensors, so that is what fills it.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from sample_logs import formats
from sample_logs.flown import fly_sample
from sample_logs.make import SAMPLES, SENSOR
from sample_logs.write_ulog import Topic

RATE_Hz = 500
ROUNDS = 4  # of the light airframe's plan: 600 s


def filler(start_s: float, stop_s: float) -> list[Topic]:
    """Attitude and accelerometer at RATE_Hz."""
    t = np.arange(start_s, stop_s, 1.0 / RATE_Hz)
    rng = np.random.default_rng(0)
    names = ("x", "y", "z", "w")
    return [
        Topic(name=topic, time_s=t, fields={f"float {n}": rng.normal(size=t.size) for n in names})
        for topic in ("vehicle_attitude", "vehicle_acceleration")
    ]


def main(folder: Path) -> None:
    """Write `large.ulg` and `large.sensor.csv` into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    light = SAMPLES[1]
    flown = fly_sample(replace(light, plan=light.plan * ROUNDS))
    stop_s = formats.BOOT_s + float(flown.flight.time_s[-1])
    formats.ulog(flown, folder / "large.ulg", filler(formats.BOOT_s, stop_s))
    formats.sensor_csv(flown, SENSOR, folder / "large.sensor.csv")
    print(f"{(folder / 'large.ulg').stat().st_size / 1e6:.1f} MB, {flown.flight.time_s[-1]:.0f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
