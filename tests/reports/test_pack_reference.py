"""`docs/pack_file.md` says what a pack file may hold, as the program has it."""

import re
import tomllib
from pathlib import Path

from reports.pack_reference import reference
from twin.effects import AGEING, EFFECTS, MEASURED
from twin.pack_file import PackFile, parse_pack_file

ROOT = Path(__file__).parents[2]


def test_the_page_is_current() -> None:
    page = (ROOT / "docs/pack_file.md").read_text(encoding="utf-8")
    assert reference() == page, "python -m reports.pack_reference > docs/pack_file.md"


def test_every_key_and_every_effect_is_on_it() -> None:
    page = reference()
    keys = (
        key for name, field in PackFile.model_fields.items()
        for key in (getattr(field.annotation, "model_fields", None) or (name,))
    )  # fmt: skip
    numbers = (p.name for e in (EFFECTS | MEASURED).values() for p in e.parameters)
    missing = [k for k in (*keys, *EFFECTS, *MEASURED, *numbers) if k not in page]
    assert not missing


def test_its_example_is_a_pack_file() -> None:
    first, *more = _examples("docs/pack_file.md")
    parse_pack_file(first, name="docs/pack_file.md")
    assert all(tomllib.loads(example) for example in more)


def test_the_readmes_pack_ages_as_its_twin_age_needs() -> None:
    pack, weak = _examples("README.md")
    assert set(parse_pack_file(pack, name="README.md").twin.physics or ()) & {e.id for e in AGEING}
    assert tomllib.loads(weak)["effects"]["weak_cell"]


def _examples(file: str) -> list[str]:
    text = (ROOT / file).read_text(encoding="utf-8")
    return re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
