"""Compiled kernels: same numbers, safe cache, no compiler no problem."""

import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from twin import kernel as kernel_module
from twin.builtin import load_cell
from twin.kernel import Backend, cache_folder, kernel
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

needs_compiler = pytest.mark.skipif(kernel_module.compiler() is None, reason="no C compiler")


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DRONE_BATTERY_HEALTH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def square(factor: float = 1.0) -> ca.Function:
    x = ca.SX.sym("x")
    return ca.Function("square", [x], [factor * x**2])


@needs_compiler
def test_compiled_and_virtual_machine_give_the_same_numbers() -> None:
    t = np.arange(0.0, 20.0, 0.1)
    load = Load(time_s=t, current_A=10 + 3 * np.sin(t))
    pack = Pack(cell=load_cell("lg_m50"))
    compiled, virtual = (simulate(pack, load, backend=b).voltage_V for b in Backend)
    assert np.max(np.abs(compiled - virtual)) < 1e-9


@needs_compiler
def test_a_second_use_finds_the_first_ones_library(own_cache: Path) -> None:
    assert float(kernel(square())(3.0)) == 9.0
    entries = list(own_cache.glob("*.so"))
    kernel(square())
    assert list(own_cache.glob("*.so")) == entries
    kernel(square(2.0))
    assert len(list(own_cache.glob("*.so"))) == 2


@needs_compiler
def test_a_damaged_entry_is_rebuilt(own_cache: Path) -> None:
    kernel(square(3.0))
    (entry,) = own_cache.glob("*.so")
    whole = entry.read_bytes()
    entry.unlink()  # a new inode: the old one is mapped by this process
    entry.write_bytes(whole[: len(whole) // 2])
    assert float(kernel(square(3.0))(2.0)) == 12.0
    (entry,) = own_cache.glob("*.so")
    assert entry.stat().st_size == len(whole)


@needs_compiler
def test_the_cache_is_bounded(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_module, "MAX_ENTRIES", 2)
    for k in range(4):
        kernel(square(10.0 + k))
    assert len(list(own_cache.glob("*.so"))) == 2


@needs_compiler
def test_several_processes_may_start_at_once(own_cache: Path) -> None:
    script = (
        "import casadi as ca; from twin.kernel import kernel; x = ca.SX.sym('x');"
        "print(float(kernel(ca.Function('f', [x], [ca.sin(x) + 7]))(0.0)))"
    )
    running = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    assert [p.communicate()[0].strip() for p in running] == ["7.0"] * 4
    assert len(list(own_cache.glob("*.so"))) in (1, 2, 3, 4)
    assert not list(own_cache.glob("build-*"))


@pytest.mark.usefixtures("own_cache")
def test_without_a_compiler_the_virtual_machine_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_module, "compiler", lambda: None)
    assert kernel(square()).class_name() == "SXFunction"


@needs_compiler
def test_an_unwritable_cache_is_no_obstacle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("DRONE_BATTERY_HEALTH_CACHE", str(blocked))
    assert float(kernel(square(5.0))(1.0)) == 5.0


def test_the_cache_is_where_the_user_wants_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DRONE_BATTERY_HEALTH_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert cache_folder() == Path("/somewhere/drone-battery-health")
