"""Small inputs for the workbench."""

from pathlib import Path

PACK = '[pack]\nname = "a"\ncell = "lipo_2200"\nseries = 4\n[start]\nsoc = 0.9\n'
AGEING = PACK + '[twin]\nphysics = ["self_heating", "sei", "plating"]\n'


def put_load(folder: Path, *, seconds: float, current_A: float) -> str:
    """A CSV with a constant current; its path."""
    file = folder / "load.csv"
    file.write_text(f"time_s,current_A\n0,{current_A}\n{seconds},{current_A}\n", encoding="utf-8")
    return str(file)
