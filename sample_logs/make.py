"""Makes the committed samples: `python -m sample_logs.make [FOLDER]`. Equal bytes every time.

One flight of the larger airframe as ULog with the recording of a current sensor, as telemetry and
as DataFlash; another of the light airframe as ULog; beside each log its true answer. The pack's
voltage is the twin's own answer to the true current (built-in cell `lipo_2200`), with a start
state and surroundings that the log does not tell.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sample_logs.airframe import LIGHT, S500
from sample_logs.flown import Flown, Hidden, Sample, fly_sample
from sample_logs.formats import dataflash, sensor_csv, tlog, ulog
from sample_logs.instruments import AutopilotFlaws, SensorFlaws
from sample_logs.plan import Leg, hover
from sample_logs.truth import truth_json
from segment.segment import Motion

VERTICAL, HORIZONTAL, MIXED = Motion.VERTICAL, Motion.HORIZONTAL, Motion.MIXED

SAMPLES = (
    Sample(
        airframe=S500,
        seed=1,
        plan=(
            hover(25.0),
            Leg(motion=VERTICAL, strokes=8, stroke_s=4.0, speed_m_s=3.0),
            hover(12.0),
            Leg(motion=HORIZONTAL, strokes=8, stroke_s=5.0, speed_m_s=6.0, heading_rad=0.4),
            hover(15.0),
            Leg(motion=HORIZONTAL, strokes=8, stroke_s=4.5, speed_m_s=5.0, turn_rad=np.pi / 2),
            Leg(motion=MIXED, strokes=6, stroke_s=5.0, speed_m_s=4.0, climb_m_s=2.0),
            hover(20.0),
            Leg(motion=VERTICAL, strokes=6, stroke_s=5.0, speed_m_s=2.0),
            hover(18.0),
        ),
        hidden=Hidden(initial_soc=0.97, ambient_K=294.15, heat_transfer_W_m2_K=16.0),
        autopilot=AutopilotFlaws(gain=0.98, bias_A=0.1),
    ),
    Sample(
        airframe=LIGHT,
        seed=2,
        plan=(
            hover(15.0),
            Leg(motion=HORIZONTAL, strokes=8, stroke_s=5.0, speed_m_s=9.0, turn_rad=np.pi / 2),
            hover(12.0),
            Leg(motion=VERTICAL, strokes=8, stroke_s=4.0, speed_m_s=4.0),
            hover(14.0),
            Leg(motion=MIXED, strokes=4, stroke_s=5.0, speed_m_s=6.0, climb_m_s=2.5),
            hover(20.0),
        ),
        hidden=Hidden(initial_soc=0.92, ambient_K=283.15, heat_transfer_W_m2_K=14.0),
        autopilot=AutopilotFlaws(gain=1.02, bias_A=-0.05),
    ),
)
SENSOR = SensorFlaws(offset_s=-37.4, drift_ppm=85.0, missing=0.002)
"""Switched on 37.4 s before the log begins."""


def make(folder: Path) -> None:
    """Write all samples and their truths into `folder`."""
    large, light = (fly_sample(sample) for sample in SAMPLES)
    logs: tuple[tuple[str, Flown, Callable[[Flown, Path], None]], ...] = (
        ("s500.ulg", large, ulog),
        ("s500_telemetry.tlog", large, tlog),
        ("s500_ardupilot.bin", large, dataflash),
        ("light.ulg", light, ulog),
    )
    for name, flown, write in logs:
        path = folder / name
        write(flown, path)
        beside = SENSOR if name == "s500.ulg" else None
        if beside is not None:
            sensor_csv(flown, beside, path.with_suffix(".sensor.csv"))
        path.with_suffix(".truth.json").write_text(truth_json(flown, beside))


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
