"""The true answer that lies beside each sample, as JSON."""

import json
from typing import Any

from sample_logs.flown import Flown
from sample_logs.instruments import SensorFlaws
from twin.constants import ZERO_CELSIUS_K


def truth_json(flown: Flown, flaws: SensorFlaws | None) -> str:
    """What is to be found out about one log; times in s since the first sample of the log.

    Args:
        flown: the flight.
        flaws: of the current sensor beside the log, None where there is none.
    """
    hidden, pack, gauge = flown.sample.hidden, flown.pack, flown.sample.autopilot
    airframe = flown.sample.airframe
    content: dict[str, Any] = {
        "airframe": {"name": airframe.name, "mass_kg": round(airframe.mass_kg, 3)},
        "seed": flown.sample.seed,
        "segments": [
            {"motion": s.motion.value, "start_s": round(s.start_s, 2), "stop_s": round(s.stop_s, 2)}
            for s in flown.flight.truth
        ],
        "sensor_clock": None
        if flaws is None
        else {"offset_s": flaws.offset_s, "drift_ppm": flaws.drift_ppm},
        "autopilot_current": {"gain": gauge.gain, "bias_a": gauge.bias_A},
        "effects": ["self_heating"],
        "pack": {
            "cell": hidden.cell,
            "series": airframe.series,
            "capacity_ah": airframe.capacity_C / 3600,
            "initial_soc": hidden.initial_soc,
            "initial_temperature_c": round(hidden.ambient_K - ZERO_CELSIUS_K, 2),
            "ambient_c": round(hidden.ambient_K - ZERO_CELSIUS_K, 2),
            "heat_transfer_W_m2_K": hidden.heat_transfer_W_m2_K,
        },
        "at_the_end": {
            "soc": round(float(pack.soc[-1]), 4),
            "temperature_c": round(float(pack.temperature_K[-1]) - ZERO_CELSIUS_K, 2),
        },
    }
    return json.dumps(content, indent=1) + "\n"
