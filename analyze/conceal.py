"""Channels of a recording that are kept from the twin, to be compared with it afterwards."""

from collections.abc import Set
from dataclasses import replace
from enum import Enum

from flightlogs.recording import Recording


class Channel(Enum):
    """What a log may hold beyond current and voltage of the pack."""

    TEMPERATURE = "temperature"
    CELLS = "cells"


def without(recording: Recording, concealed: Set[Channel]) -> Recording:
    """As if these channels had not been logged."""
    if Channel.TEMPERATURE in concealed:
        recording = replace(recording, temperature_K=None)
    if Channel.CELLS in concealed:
        recording = replace(recording, cell_voltage_V=None)
    return recording
