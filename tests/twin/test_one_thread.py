"""CasADi's symbols are made by one thread at a time."""

import casadi as ca
import pytest

from twin import at_rest
from twin.builtin import load_cell
from twin.health import Examiner
from twin.one_thread import SYMBOLS
from twin.pack import Pack


def test_what_lives_and_starts_need_is_made_with_the_symbols_held(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Lives that were simulated side by side ended in a segmentation fault, once in many."""
    cell, held, sym = load_cell("lipo_2200"), [], ca.SX.sym

    def noted(*args: object) -> ca.SX:
        held.append(SYMBOLS._is_owned())  # type: ignore[attr-defined]
        return sym(*args)

    monkeypatch.setattr(ca.SX, "sym", staticmethod(noted))
    Examiner(Pack(cell=cell))
    at_rest._curve.__wrapped__(cell)
    assert len(held) >= 3
    assert all(held)
