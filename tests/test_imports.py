"""Imports go one way: proof -> analyze -> reports -> (segment, twin); segment -> flightlogs."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAY_IMPORT = {
    "flightlogs": set(),
    "twin": set(),
    "segment": {"flightlogs"},
    "reports": {"flightlogs", "segment", "twin"},
    "analyze": {"flightlogs", "segment", "twin", "reports"},
    "proof": {"flightlogs", "segment", "twin", "reports", "analyze"},
}


def imported(source: str) -> Iterator[str]:
    """Top-level packages that a module imports anywhere in it, late imports included."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the direction"
            yield (node.module or "").partition(".")[0]


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_a_package_imports_only_those_below_it(package: str) -> None:
    forbidden = set(MAY_IMPORT) - MAY_IMPORT[package] - {package}
    modules = list((ROOT / package).rglob("*.py"))
    assert modules
    found = {
        f"{module.relative_to(ROOT)} imports {name}"
        for module in modules
        for name in imported(module.read_text(encoding="utf-8"))
        if name in forbidden
    }
    assert not found


def test_a_late_import_and_one_for_types_only_are_seen() -> None:
    source = "def f():\n    import analyze.job\nif TYPE_CHECKING:\n    from reports import plots\n"
    assert set(imported(source)) == {"analyze", "reports"}


@pytest.mark.parametrize("module", ["analyze.__main__", "analyze.workbench.__main__"])
def test_a_command_line_loads_nothing_slow(module: str) -> None:
    """`--help` must answer at once; numpy alone would take a fifth of the time allowed."""
    code = f"import sys, {module}; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    slow = {"numpy", "casadi", "matplotlib", "pydantic", "rich", "distributed", "pyarrow"}
    assert not slow & set(run.stdout.split())
