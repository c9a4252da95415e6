"""Channels of a recording that are kept from the twin, to be compared with it afterwards."""

from collections.abc import Set
from dataclasses import replace
from enum import Enum
from typing import TypeVar

from flightlogs.recording import Recording
from twin.load_csv import LoadTable

Measured = TypeVar("Measured", Recording, LoadTable)


class Channel(Enum):
    """What a log may hold beyond current and voltage of the pack."""

    TEMPERATURE = "temperature"
    CELLS = "cells"


def without(measured: Measured, concealed: Set[Channel]) -> Measured:
    """As if these channels had not been logged."""
    if Channel.TEMPERATURE in concealed:
        measured = replace(measured, temperature_K=None)
    if Channel.CELLS in concealed:
        measured = replace(measured, cell_voltage_V=None)
    return measured
