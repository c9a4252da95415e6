"""Telemetry: what a target means by its autopilot, and a link that is lost for a while."""

from dataclasses import replace

import numpy as np
import pytest

from sample_logs import write_tlog as w
from tests.flightlogs.test_tlog import ARMED, POSCTL, T, encode, flight, read, without


def test_a_destination_of_ardupilot_is_no_trajectory() -> None:
    """In GUIDED the position is that of the goal, its rate 0 all the way."""
    goal = {"x": 200.0, "y": 0.0, "z": -10.0}
    target = w.velocity_target(T, np.full((T.size, 3), np.nan))
    mask = np.full(T.size, 0b111 << 3 | w.IGNORE_ACCELERATION | w.IGNORE_YAW)
    stream = replace(target, fields={**target.fields, **goal, "type_mask": mask})
    others = [s for s in flight() if s.message not in ("HEARTBEAT", "POSITION_TARGET_LOCAL_NED")]
    px4, copter = (
        read(encode([w.heartbeat(T, ARMED, mode, autopilot=pilot), *others, stream]))
        for pilot, mode in ((w.PX4, POSCTL), (w.ARDUPILOT, 4))
    )
    assert px4.position_setpoint_m is not None
    assert copter.position_setpoint_m is None


@pytest.mark.parametrize(("away_s", "spans"), [(14.0, 1), (70.0, 2)])
def test_a_link_that_is_lost_for_a_while_ends_no_flight(away_s: float, spans: int) -> None:
    t = T * 3
    heard = (t < 20) | (t > 20 + away_s)
    log = read(encode([w.heartbeat(t[heard], (t >= 2)[heard], POSCTL), *without("HEARTBEAT")]))
    assert len(log.armed) == spans
