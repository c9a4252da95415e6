"""A truth as text, sealed: encrypted under a key that is thrown into the ledger when it is opened.

Fernet (AES-128 in CBC mode with HMAC-SHA256, https://github.com/fernet/spec) of `cryptography`.
"""

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from proof.truth import Channel, Number, Truth


def seal(truth: Truth) -> tuple[bytes, str]:
    """What may be shown before the verdict, and the key that may not."""
    from cryptography.fernet import Fernet  # late: of the extra `proof`

    key = Fernet.generate_key()
    return Fernet(key).encrypt(truth_text(truth).encode()), key.decode()


def unseal(sealed: bytes, key: str) -> Truth:
    """What was sealed; ValueError if it is not that, or the key is another's."""
    from cryptography.fernet import Fernet, InvalidToken

    try:
        text = Fernet(key.encode()).decrypt(sealed).decode()
    except InvalidToken as e:
        raise ValueError("the key does not open what was sealed, or it was changed") from e
    try:
        return truth_of(text)
    except (LookupError, TypeError, AttributeError) as e:
        raise ValueError(f"what was sealed is no truth of this version: {e}") from e


def truth_text(truth: Truth) -> str:
    """JSON."""
    return json.dumps(asdict(truth), default=_listed, indent=1)


def truth_of(text: str) -> Truth:
    """Inverse of `truth_text`."""
    raw: dict[str, Any] = json.loads(text)
    tuples = {name: tuple(raw[name]) for name in ("verdicts", "also")}
    made: dict[str, Any] = {
        "effects": tuple(map(tuple, raw["effects"])),
        "numbers": tuple(Number(**n) for n in raw["numbers"]),
        "channels": tuple(_channel(c) for c in raw["channels"]),
    }
    return Truth(**(raw | tuples | made))


def _listed(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} in a truth")


def _channel(raw: dict[str, Any]) -> Channel:
    arrays = {
        name: None if raw[name] is None else np.array(raw[name], dtype=float)
        for name in ("time_s", "temperature_K", "cell_voltage_V")
    }
    return Channel(**(raw | arrays))
