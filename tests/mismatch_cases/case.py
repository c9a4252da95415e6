"""A case: recordings with something in them that the twin does not know, and what it is."""

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from proof.simulated.configured import Configured
from proof.simulated.solves import write_npz
from tests.mismatch_cases.record import Concealed, Recording


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Question:
    """All of a case that an engine may see.

    Attributes:
        told: the twin as configured.
        recordings: to be explained, in the order flown.
        held_out: the last flight; for the test of what was found.
    """

    told: Configured
    recordings: tuple[Recording, ...]
    held_out: Recording


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """One case.

    Attributes:
        name: unique in its split; tells the truth.
        split: `tune` or `report`.
        seed: of its noise.
        truth: ids of its effects; none in a control; `foreign:<kind>` is outside the library.
        sizes: of each effect, as `effects.py` means them.
        flavours: of each effect.
        strength: `barely`, `3x`, `10x` (each effect alone); `none` in a control.
        plan: of its flights.
        variant: of its recordings; `plain` if nothing is wrong with them.
        noise_V: rms of the voltage's noise.
        missed_V: rms by which the twin misses each recording's clean voltage.
        told: the twin as configured.
        recordings: the last one is held out.
        concealed: of each recording.
    """

    name: str
    split: str
    seed: int
    truth: tuple[str, ...]
    sizes: tuple[float, ...]
    flavours: tuple[int, ...]
    strength: str
    plan: str
    variant: str
    noise_V: float
    missed_V: tuple[float, ...]
    told: Configured
    recordings: tuple[Recording, ...]
    concealed: tuple[Concealed, ...]

    @property
    def question(self) -> Question:
        """Without truth and name."""
        *seen, last = self.recordings
        return Question(told=self.told, recordings=tuple(seen), held_out=last)

    def save(self, path: Path) -> None:
        """One npz: the recordings, what is concealed, and two JSON texts, `told` and `truth`."""
        parts: tuple[tuple[str, tuple[Recording | Concealed, ...]], ...] = (
            ("recording", self.recordings),
            ("concealed", self.concealed),
        )
        arrays: dict[str, npt.NDArray[np.generic]] = {
            f"{part}{k}.{name}": values
            for part, pieces in parts
            for k, piece in enumerate(pieces)
            for name, values in _fields(piece).items()
        }
        truth = {name: getattr(self, name) for name in TRUTH}
        arrays["told"] = np.array(json.dumps(asdict(self.told)))
        arrays["truth"] = np.array(json.dumps(truth))
        write_npz(path, arrays)

    @classmethod
    def load(cls, path: Path) -> "Case":
        """The whole case."""
        with np.load(path) as stored:
            truth = {k: _tuple(v) for k, v in json.loads(str(stored["truth"])).items()}
            seen = _question(stored)
            recordings = (*seen.recordings, seen.held_out)
            return cls(
                **truth,
                told=seen.told,
                recordings=recordings,
                concealed=tuple(
                    Concealed(**_piece(stored, f"concealed{k}.")) for k in range(len(recordings))
                ),
            )


TRUTH = (
    "name", "split", "seed", "truth", "sizes", "flavours", "strength", "plan", "variant",
    "noise_V", "missed_V",
)  # fmt: skip


def load_question(path: Path) -> Question:
    """What an engine may see; nothing else is read from the file."""
    with np.load(path) as stored:
        return _question(stored)


def _question(stored: Any) -> Question:
    names = {name.partition(".")[0] for name in stored if name.startswith("recording")}
    recordings = [Recording(**_piece(stored, f"recording{k}.")) for k in range(len(names))]
    told = Configured(**json.loads(str(stored["told"])))
    return Question(told=told, recordings=tuple(recordings[:-1]), held_out=recordings[-1])


def _fields(piece: Recording | Concealed) -> dict[str, Any]:
    return {f.name: getattr(piece, f.name) for f in fields(piece)}


def _piece(stored: Any, prefix: str) -> dict[str, Any]:
    return {name.removeprefix(prefix): stored[name] for name in stored if name.startswith(prefix)}


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
