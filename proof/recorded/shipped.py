"""Base twins of real cells that come with the program: `twin prove` makes only those it lacks.

A calibration is known by a hash of all that went into it (`base`, `calibrated`): with another test,
bound or version it is another one, and is made. `python -m proof.recorded.shipped CELLS` writes the
file from the folder that a run left.
"""

import json
import sys
from importlib import resources
from pathlib import Path
from typing import Any

from twin.whole_file import write_whole

FILE = "base_twins.json"
NOT_ASKED = ".fit.json"  # of the end of a name: how well each number is known, for a reader


def put_into(cells: Path) -> int:
    """Write those that are not in a folder, made if it is not there; how many files."""
    text = (resources.files("proof") / FILE).read_text(encoding="utf-8")
    kept: dict[str, Any] = json.loads(text)
    missing = {name: content for name, content in kept.items() if not (cells / name).exists()}
    for name, content in missing.items():
        (cells / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole(cells / name, json.dumps(content, indent=1) + "\n")
    return len(missing)


def collected(cells: Path) -> dict[str, Any]:
    """Name in the folder -> content, by name, but `base.json` last: with it a base is whole."""
    found = {
        path.relative_to(cells).as_posix(): json.loads(path.read_text(encoding="utf-8"))
        for path in cells.rglob("*.json")
        if not path.name.endswith(NOT_ASKED)
    }
    whole = {name: c for name, c in found.items() if "/" not in name or _is_whole(name, found)}
    return dict(sorted(whole.items(), key=lambda item: (item[0].endswith("/base.json"), item[0])))


def _is_whole(name: str, found: dict[str, Any]) -> bool:
    return f"{name.partition('/')[0]}/base.json" in found


if __name__ == "__main__":
    rows = [f"{json.dumps(n)}: {json.dumps(c)}" for n, c in collected(Path(sys.argv[1])).items()]
    write_whole(Path(__file__).parents[1] / FILE, "{\n" + ",\n".join(rows) + "\n}\n")
