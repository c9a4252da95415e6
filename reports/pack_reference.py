"""`docs/pack_file.md`: every key of a pack file, with unit, default and bounds.

`python -m reports.pack_reference > docs/pack_file.md` renews it; a test holds it current. What is
said of a key is its docstring in `twin.pack_file`; the numbers are those of the effects.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from inspect import cleandoc
from re import MULTILINE, findall
from typing import Any

from pydantic import BaseModel

from reports.mismatch.words import name
from twin.effects import EFFECTS, MEASURED, Mechanics, SelfHeating, WeakCell
from twin.effects.effect import Parameter
from twin.pack_file import PackFile
from twin.pack_physics import PLACE, STRAINED

HEAD = """\
# The pack file

`--pack pack.toml` tells `analyze` and `twin` what the battery is. It is TOML; a key that is not
known, or a value out of its bounds, is an error that says what was expected. This is enough:

```toml
[pack]
name = "S500-4S-2200"
cell = "lipo_2200"
capacity_ah = 2.2
series = 4
```

With a pack file nothing is fitted to a flight: the twin is the one that the file describes. So a
file with a built-in cell tells a report less than none does; what makes it better is the cell that
`twin calibrate` fits to tests of the pack, in the file that it writes. `twin explain --adopt`
writes one with the effects that it named.
"""
EFFECTS_HEAD = """\
## Effects

Ids for `twin.physics`; numbers under `[effects.<id>]`, e.g. `[effects.sei]`. The equation and the
source of each are in [twin/effects](../twin/effects).

### That act with the numbers they come with
"""
MEASURED_HEAD = """
### That are nothing without a number of the pack

One at least has to be given; the value in the table is that of no effect.
"""
ERRORS = """
## `[standard_errors.<id>]`

What tests of the cell, or who calibrated an instrument, leave open of a number of the second list:
one standard error, of the logarithm where the number is marked *log*. `twin explain` believes it.
`twin calibrate` writes those of the cell. Of a current sensor that was calibrated to 1 %:

```toml
[standard_errors.current_gain]
gain = 0.01
```
"""


def reference() -> str:
    """The whole page, as markdown."""
    return "\n".join(
        (
            HEAD,
            *_tables(PackFile),
            EFFECTS_HEAD,
            *_numbers(EFFECTS),
            "",
            "The number of `self_heating` is `environment.heat_transfer_W_m2_K`.",
            MEASURED_HEAD,
            *_numbers(MEASURED),
            "",
            "`[[effects.weak_cell]]`, with two brackets, may come several times.",
            "",
            "## `[mechanics]`",
            "",
            f"Elastic constants, on which {', '.join(f'`{e}`' for e in STRAINED)} act.",
            "",
            *_header("number"),
            *(_row(_number(p, _said(Mechanics))) for p in Mechanics.parameters),
            ERRORS,
        )
    )


def _tables(file: type[BaseModel]) -> Iterator[str]:
    """Each table whose keys are fixed."""
    for field in file.model_fields.values():
        kind = field.annotation
        if not (isinstance(kind, type) and issubclass(kind, BaseModel)):
            continue
        yield f"## {cleandoc(kind.__doc__ or '')}\n"
        yield from ("| key | value | default | what |", "|---|---|---|---|")
        schema = kind.model_json_schema()
        for key, own in schema["properties"].items():
            default = "" if key not in schema.get("required", ()) else "**has to be given**"
            shown = f"`{own['default']}`" if own.get("default") else default
            yield _row((f"`{key}`", _kind(own), shown, " ".join(own["description"].split())))
        yield ""


def _kind(own: Mapping[str, Any]) -> str:
    """Text, number or list, with its bounds."""
    told = next((k for k in own.get("anyOf", ()) if k["type"] != "null"), own)
    if told["type"] in ("string", "array"):
        return {"string": "text", "array": "list of text"}[told["type"]]
    least = told.get("minimum", told.get("exclusiveMinimum"))
    above = "above " if "exclusiveMinimum" in told else ""
    kind = "whole number" if told["type"] == "integer" else "number"
    most = f" to {told['maximum']:g}" if "maximum" in told else " or more"
    return f"{kind}, {above}{least:g}{most}"


def _numbers(effects: Mapping[str, Any]) -> Iterator[str]:
    """Every number of these effects."""
    yield from _header("effect", "number")
    for key, effect in effects.items():
        words = name(key)
        label = f"`{key}`" + (f": {words}" if words != key.replace("_", " ") else "")
        own = () if key == SelfHeating.id else effect.parameters
        place = (PLACE,) if key == WeakCell.id else ()
        rows = [_number(p, _said(effect)) for p in (*own, *place)]
        yield _row((label, *(rows[0] if rows else [""] * 5)))
        yield from (_row(("", *row)) for row in rows[1:])


def _said(effect: type) -> Mapping[str, str]:
    """What its docstring, or that of what it is derived from, says of each number."""
    doc = "\n".join(cleandoc(kind.__doc__ or "") for kind in effect.mro())
    found = findall(r"^    (\w+): (.*(?:\n     +.*)*)", doc, MULTILINE)
    return {key: " ".join(text.split()) for key, text in found}


def _header(*first: str) -> tuple[str, str]:
    columns = (*first, "unit", "default", "bounds", "what")
    return _row(columns), _row(["---"] * len(columns))


def _number(p: Parameter, said: Mapping[str, str]) -> Sequence[str]:
    """Its columns."""
    bounds = f"{p.lower:g} to {p.upper:g}" + (", *log*" if p.logarithmic else "")
    return f"`{p.name}`", p.unit, f"{p.value:g}", bounds, said.get(p.name, "")


def _row(columns: Sequence[str]) -> str:
    return f"| {' | '.join(columns)} |"


if __name__ == "__main__":
    sys.stdout.write(reference())
