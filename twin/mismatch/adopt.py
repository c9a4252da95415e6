"""A pack file with what was named switched on, so that the next replay has it."""

from typing import Any

from twin.calibrate.out import toml_text
from twin.effects import SelfHeating
from twin.mismatch.finding import Finding, NamedEffect, Verdict
from twin.mismatch.flight import MismatchError
from twin.pack_file import PackFile, effects_of


def adopted_text(finding: Finding, file: PackFile, *, cell: str) -> str:
    """The text of `file` with the named effects at their best; its cell is `cell`.

    What tests said of a number that is adopted was of another value: it goes.

    Raises:
        MismatchError: nothing was named.
    """
    if finding.verdict is not Verdict.NAMED:
        raise MismatchError(
            f"nothing to adopt: the verdict is {finding.verdict.value!r}, only what is named can be"
        )
    content = file.model_dump(exclude_none=True)
    physics = [e.id for e in effects_of(file)]
    content["pack"] |= {"cell": cell}
    content["twin"]["physics"] = [*dict.fromkeys([*physics, *(e.pack_id for e in finding.effects)])]
    for effect in finding.effects:
        _switch_on(content, effect)
    return toml_text(content)


def _switch_on(content: dict[str, Any], effect: NamedEffect) -> None:
    numbers = {v.name: v.value for v in effect.parameters}
    content["standard_errors"].pop(effect.pack_id, None)
    if effect.pack_id == SelfHeating.id:
        content["environment"] = content["environment"] | numbers
        return
    own = content["effects"].get(effect.pack_id, {})
    # Of several weak cells it is the first that was fitted (`Hypothesis.present`).
    changed = [own[0] | numbers, *own[1:]] if isinstance(own, list) else own | numbers
    content["effects"] = content["effects"] | {effect.pack_id: changed}
