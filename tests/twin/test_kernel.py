"""Compiled kernels: same numbers, safe cache, no compiler no problem."""

import subprocess
import sys
import threading
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from twin import compiled
from twin.builtin import load_cell
from twin.compiled import cache_folder
from twin.kernel import Backend, CompiledLoop, Kernel, VirtualLoop, begun, kernel
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

needs_compiler = pytest.mark.skipif(compiled.compiler() is None, reason="no C compiler")


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DRONE_BATTERY_HEALTH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def adding(factor: float = 1.0) -> ca.Function:
    """Carries a sum, gives its square."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    return ca.Function("adding", [x, y], [x + y, factor * (x + y) ** 2])


def first(loop: Kernel, value: float) -> float:
    """What a loop over `adding` gives after one step."""
    return float(loop(np.zeros(1), [np.array([[value]])], [])[1][0, 0])


@needs_compiler
def test_compiled_and_virtual_machine_give_the_same_numbers() -> None:
    t = np.arange(0.0, 20.0, 0.1)
    load = Load(time_s=t, current_A=10 + 3 * np.sin(t))
    pack = Pack(cell=load_cell("lg_m50"))
    compiled, virtual = (simulate(pack, load, backend=b).voltage_V for b in Backend)
    assert np.max(np.abs(compiled - virtual)) < 1e-9


@needs_compiler
def test_a_second_use_finds_the_first_ones_library(own_cache: Path) -> None:
    assert first(kernel(adding()), 3.0) == 9.0
    entries = list(own_cache.glob("*.so"))
    kernel(adding())
    assert list(own_cache.glob("*.so")) == entries
    kernel(adding(2.0))
    assert len(list(own_cache.glob("*.so"))) == 2


@needs_compiler
def test_a_damaged_entry_is_rebuilt(own_cache: Path) -> None:
    kernel(adding(3.0))
    (entry,) = own_cache.glob("*.so")
    whole = entry.read_bytes()
    entry.unlink()  # a new inode: the old one is mapped by this process
    entry.write_bytes(whole[: len(whole) // 2])
    assert first(kernel(adding(3.0)), 2.0) == 12.0
    (entry,) = own_cache.glob("*.so")
    assert entry.stat().st_size == len(whole)


@needs_compiler
def test_the_cache_is_bounded(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "MAX_ENTRIES", 2)
    for k in range(4):
        kernel(adding(10.0 + k))
    assert len(list(own_cache.glob("*.so"))) == 2


@needs_compiler
def test_several_processes_may_start_at_once(own_cache: Path) -> None:
    script = (
        "import casadi as ca, numpy as np; from twin.kernel import kernel;"
        "x, y = ca.SX.sym('x'), ca.SX.sym('y'); f = ca.Function('f', [x, y], [x, y + 7]);"
        "print(kernel(f)(np.zeros(1), [np.zeros((1, 1))], [])[1][0, 0])"
    )
    running = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    assert [p.communicate()[0].strip() for p in running] == ["7.0"] * 4
    assert len(list(own_cache.glob("*.so"))) in (1, 2, 3, 4)
    assert not list(own_cache.glob("build-*"))


@pytest.mark.usefixtures("own_cache")
@needs_compiler
def test_two_kernels_are_compiled_side_by_side_while_the_caller_goes_on(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    both, genuine = threading.Barrier(2, timeout=20), compiled.library

    def library(source: str, found: compiled.Compiler) -> Path:
        both.wait()  # broken, were the second not begun before the first is done
        return genuine(source, found)

    monkeypatch.setattr(compiled, "library", library)
    made = [begun(adding(factor)) for factor in (1.0, 2.0)]
    loops = [m() for m in made]
    assert all(isinstance(loop, CompiledLoop) for loop in loops)
    assert [first(loop, 3.0) for loop in loops] == [9.0, 18.0]
    assert len(list(own_cache.glob("*.so"))) == 2


def test_without_a_compiler_the_virtual_machine_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "compiler", lambda: None)
    loop = kernel(adding())
    assert isinstance(loop, VirtualLoop)
    assert first(loop, 3.0) == 9.0


@needs_compiler
def test_an_unwritable_cache_is_no_obstacle_but_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("DRONE_BATTERY_HEALTH_CACHE", str(blocked))
    with pytest.warns(
        RuntimeWarning, match=f"no compiled equations .*{blocked}.* ten times slower"
    ):
        loop = kernel(adding(5.0))
    assert first(loop, 1.0) == 5.0


@pytest.mark.usefixtures("own_cache")
def test_a_compiler_that_fails_is_no_obstacle_but_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "cc"
    broken.write_text('#!/bin/sh\n[ "$1" = --version ]\n')
    broken.chmod(0o755)
    found = compiled.Compiler(str(broken), "broken")
    monkeypatch.setattr(compiled, "compiler", lambda: found)
    with pytest.warns(RuntimeWarning, match="no compiled equations .*exit status 1"):
        loop = kernel(adding(5.0))
    assert first(loop, 1.0) == 5.0


def test_the_cache_is_where_the_user_wants_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DRONE_BATTERY_HEALTH_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert cache_folder() == Path("/somewhere/drone-battery-health")


@needs_compiler
@pytest.mark.parametrize("steps", [1, 2, 511, 512, 1300])
def test_both_loops_carry_matrices_from_step_to_step(steps: int) -> None:
    """x (2, 3) goes on as x + a b' + c x, b (3,) new each step, a and c fixed."""
    x, b = ca.SX.sym("x", 2, 3), ca.SX.sym("b", 3)
    a, c = ca.SX.sym("a", 2), ca.SX.sym("c", 2, 2)
    new = x + a @ b.T + c @ x
    function = ca.Function("walk", [x, b, a, c], [new, ca.sum1(new)])
    rng = np.random.default_rng(1)
    start, each = rng.normal(size=6), rng.normal(size=(steps, 3))
    fixed = [rng.normal(size=2), 0.01 * rng.normal(size=4)]
    expected, state = [], start.reshape(2, 3, order="F")
    for row in each:
        state = state + np.outer(fixed[0], row) + fixed[1].reshape(2, 2, order="F") @ state
        expected.append(state.ravel(order="F"))
    for loop in (kernel(function), VirtualLoop(function)):
        states, out = loop(start, [each], fixed)
        assert states == pytest.approx(np.array(expected), rel=1e-9)
        assert out == pytest.approx(states.reshape(steps, 3, 2).sum(axis=2), rel=1e-9, abs=1e-12)
    assert isinstance(kernel(function), CompiledLoop)
