"""A channel that is concealed is as if it had not been logged."""

from dataclasses import replace

import numpy as np
import pytest

from analyze import pipeline
from analyze.conceal import Channel, without
from analyze.pipeline import Source, read_flight
from analyze.start import pack_use
from flightlogs.recording import Recording
from tests.analyze.test_workbench_replay import SAMPLES
from tests.reports import example
from twin.builtin import load_cell


def warm() -> Recording:
    n = example.T.size
    return example.recording(
        temperature_K=np.full(n, 285.0),
        cell_voltage_V=np.full((n, example.recording().series), 4.0),
    )


def test_a_concealed_temperature_does_not_start_the_twin() -> None:
    cell = load_cell("lipo_2200")
    seen = pack_use(warm(), None, cell, builtin=True)
    blind = pack_use(without(warm(), {Channel.TEMPERATURE}), None, cell, builtin=True)
    never = pack_use(replace(warm(), temperature_K=None), None, cell, builtin=True)
    assert (seen.initial_K, seen.ambient_K) == (285.0, 285.0)
    assert blind == never
    assert not blind.temperature_known


def test_each_channel_is_concealed_by_itself() -> None:
    for concealed, left in (
        (set(), (True, True)),
        ({Channel.TEMPERATURE}, (False, True)),
        ({Channel.CELLS}, (True, False)),
        (set(Channel), (False, False)),
    ):
        recording = without(warm(), concealed)
        kept = recording.temperature_K is not None, recording.cell_voltage_V is not None
        assert kept == left


@pytest.mark.parametrize("concealed", [frozenset(), frozenset({Channel.TEMPERATURE})])
def test_a_log_is_read_without_it(
    monkeypatch: pytest.MonkeyPatch, concealed: frozenset[Channel]
) -> None:
    """The samples have no temperature: one is put into the recording as it is assembled."""
    real = pipeline.assemble

    def with_temperature(*args: object, **options: object) -> Recording:
        made = real(*args, **options)  # type: ignore[arg-type]
        return replace(made, temperature_K=np.full(made.time_s.size, 280.0))

    monkeypatch.setattr(pipeline, "assemble", with_temperature)
    flight = read_flight(
        Source(log=SAMPLES / "light.ulg", sensor=None, pack=None, battery=None, concealed=concealed)
    )
    assert (flight.use.initial_K == 280.0) == (not concealed)
    assert (flight.recording.temperature_K is None) == bool(concealed)
