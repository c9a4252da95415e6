"""A step function, repeated: as compiled C where there is a compiler, in CasADi's VM elsewhere.

`kernel(function)` takes a function (carried, each..., fixed...) -> (carried, out) and gives a loop
over it: what is carried goes from step to step, `each` changes from step to step, `fixed` does not.
"""

import ctypes
import re
import subprocess
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import compiled

FloatArray = npt.NDArray[np.float64]
Code = Callable[[], str]

UNCOMPILED = (
    "no compiled equations ({why}): CasADi's virtual machine gives the same numbers, ten times "
    "slower; see that the compiler works, and set DRONE_BATTERY_HEALTH_CACHE to a folder that can "
    "be written"
)
CHUNK = 256  # steps a call: of the virtual machine's loop, and of a simulation


class Backend(Enum):
    """What runs the kernel; both give the same numbers (tests/twin/test_kernel.py)."""

    AUTO = "compiled where a C compiler is found"
    VIRTUAL_MACHINE = "CasADi's virtual machine"


class Kernel(Protocol):
    """A loop over a function (carried, each..., fixed...) -> (carried, out).

    Attributes:
        at_once: steps a call that suit it, where the caller is free to choose.
    """

    at_once: int

    def __call__(
        self, carried: FloatArray, each: Sequence[FloatArray], fixed: Sequence[FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """All steps.

        Args:
            carried: (s,) before the first step; a matrix column by column.
            each: one (m, r) for each such input, a row a step.
            fixed: one for each such input, a matrix column by column.

        Returns:
            (m, s) what is carried after each step, and (m, o) what each gives out.
        """
        ...


def kernel(
    function: ca.Function, backend: Backend = Backend.AUTO, code: Code | None = None
) -> Kernel:
    """The loop over `function`; in the virtual machine where no compiled code can be had.

    `code` gives C that does the same under its name, in the place of CasADi's.
    """
    return begun(function, backend, code)()


def begun(
    function: ca.Function, backend: Backend = Backend.AUTO, code: Code | None = None, *,
    virtual: ca.Function | None = None,
) -> Callable[[], Kernel]:  # fmt: skip
    """`kernel`, compiled while the caller does something else; calling it waits for the loop.

    Only the compiler runs beside the caller: CasADi's symbols belong to one thread. `virtual` is
    what goes through the virtual machine, if that is another function.
    """
    virtual = virtual or function
    if backend is not Backend.AUTO or not (found := compiled.compiler()):
        return lambda: VirtualLoop(virtual)
    pool = ThreadPoolExecutor(1)
    library = pool.submit(compiled.library, _source(function, code), found)
    pool.shutdown(wait=False)

    def made() -> Kernel:
        try:
            return CompiledLoop(library.result(), function)
        except (OSError, subprocess.SubprocessError) as e:  # read-only home, full disk, no headers
            warnings.warn(UNCOMPILED.format(why=e), RuntimeWarning, stacklevel=2)
            return VirtualLoop(virtual)

    return made


PRELUDE = """
#include <math.h>
#define CASADI_SYMBOL_EXPORT static  /* a name such as step is one of the C library's too */
/* 1e-16 in absolute terms, which a potential needs, in a third of the time */
static double tanh_by_exp(double x) {
  double e = exp(-2 * fabs(x));
  return copysign((1 - e) / (1 + e), x);
}
static double asinh_by_log(double x) {
  double a = fabs(x);
  return copysign(log(a + sqrt(a * a + 1)), x);
}
#define tanh tanh_by_exp
#define asinh asinh_by_log
"""

LOOP = """
/* stride[i]: doubles from step to step of input i, 0 if it is fixed; 0 if all steps were made */
int loop(casadi_int steps, const casadi_real** in, const casadi_int* stride, casadi_int inputs,
         casadi_real** out, const casadi_int* width, const casadi_real** arg, casadi_real** res,
         casadi_int* iw, casadi_real* w) {
  for (casadi_int k = 0; k < steps; ++k) {
    for (casadi_int i = 0; i < inputs; ++i) arg[i] = in[i] + k * stride[i];
    if (k) arg[0] = out[0] + (k - 1) * width[0];
    for (casadi_int i = 0; i < 2; ++i) res[i] = out[i] + k * width[i];
    if (NAME(arg, res, iw, w, 0)) return 1;
  }
  return 0;
}
"""


def _source(function: ca.Function, code: Code | None) -> str:
    loop = LOOP.replace("NAME", function.name())
    return f"{PRELUDE}{_trusting(code() if code else c_of(function))}{loop}"


def c_of(function: ca.Function) -> str:
    """What CasADi writes."""
    generator = ca.CodeGenerator(function.name(), {"with_header": False})
    generator.add(function)
    return str(generator.dump())


def _trusting(source: str) -> str:
    """Without asking before every access whether an input or output is there: all are.

    Half the time to compile. A call in which one is left out (a null pointer) keeps the questions.
    """
    if re.search(r"\b(arg|res)\d*\[\d+\] ?= ?0;", source):
        return source
    source = re.sub(r"if \(res\[\d+\](!=0)?\) (?=res\[)", "", source)
    return re.sub(r"arg\[\d+\] ?\? (arg\[\d+\]\[\d+\]) : 0", r"\1", source)


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """Where all of a call of some steps lies in one block of memory, in doubles.

    Attributes:
        inputs: each input's part.
        outputs: states after the steps, and what they give out.
        offsets: (inputs + 2,) starts of both [bytes].
        pointers: where their addresses are written, then the scratch of the generated code.
        scratch: starts of its four parts [bytes].
        stride: (inputs,) see LOOP.
        size: of the block.
    """

    inputs: tuple[slice, ...]
    outputs: tuple[slice, slice]
    offsets: npt.NDArray[np.uint64]
    pointers: slice
    scratch: tuple[int, ...]
    stride: npt.NDArray[np.int64]
    size: int


class CompiledLoop:
    """Calls the C loop; other threads run meanwhile.

    One block of memory a call holds all there is: a step takes less time than asking numpy for the
    addresses of a dozen arrays.
    """

    at_once = 64  # what is carried stays in the processor's cache

    def __init__(self, library: Path, function: ca.Function) -> None:
        self._loop = ctypes.CDLL(str(library)).loop
        self._loop.argtypes = [ctypes.c_longlong, *[ctypes.c_void_p] * 2, ctypes.c_longlong,
                               *[ctypes.c_void_p] * 6]  # fmt: skip
        self._inputs = [function.numel_in(i) for i in range(function.n_in())]
        self._outputs = [function.numel_out(i) for i in range(function.n_out())]
        self._scratch = [function.sz_arg(), function.sz_res(), function.sz_iw(), function.sz_w()]
        self._width = np.array(self._outputs, dtype=np.int64)
        self._plans: dict[tuple[int, int], _Plan] = {}

    def __call__(
        self, carried: FloatArray, each: Sequence[FloatArray], fixed: Sequence[FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """As `Kernel`."""
        steps = each[0].shape[0]
        if not (plan := self._plans.get((steps, len(each)))):
            plan = self._plans[steps, len(each)] = self._planned(steps, len(each))
        block = np.empty(plan.size)
        for span, given in zip(plan.inputs, (carried, *each, *fixed), strict=True):
            block[span] = given.reshape(-1)
        base = block.ctypes.data
        block[plan.pointers].view(np.uint64)[:] = plan.offsets + np.uint64(base)
        first = base + 8 * plan.pointers.start
        count = len(self._inputs)
        failed = self._loop(
            steps, first, plan.stride.ctypes.data, count, first + 8 * count,
            self._width.ctypes.data, *(base + start for start in plan.scratch),
        )  # fmt: skip
        assert not failed, "generated code reports failure only where it calls outside code"
        states, out = (block[span].reshape(steps, -1) for span in plan.outputs)
        return states, out

    def _planned(self, steps: int, moving: int) -> _Plan:
        times = [steps if 0 < i <= moving else 1 for i in range(len(self._inputs))]
        sizes = [n * k for n, k in zip(self._inputs, times, strict=True)]
        sizes += [steps * n for n in self._outputs]
        sizes += [len(sizes), *(n + 1 for n in self._scratch)]
        ends = np.cumsum(sizes).tolist()
        spans = [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]
        known = len(self._inputs) + 2
        strides = [n if k > 1 else 0 for n, k in zip(self._inputs, times, strict=True)]
        return _Plan(
            inputs=tuple(spans[: known - 2]),
            outputs=(spans[known - 2], spans[known - 1]),
            offsets=np.array([8 * s.start for s in spans[:known]], dtype=np.uint64),
            pointers=spans[known],
            scratch=tuple(8 * s.start for s in spans[known + 1 :]),
            stride=np.array(strides, dtype=np.int64),
            size=ends[-1],
        )


class VirtualLoop:
    """CHUNK steps a call of CasADi's own loop."""

    at_once = CHUNK

    def __init__(self, function: ca.Function) -> None:
        self._one, self._many = function, function.mapaccum(CHUNK)

    def __call__(
        self, carried: FloatArray, each: Sequence[FloatArray], fixed: Sequence[FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """As `Kernel`."""
        steps, parts = each[0].shape[0], []
        count, function = (1, self._one) if steps == 1 else (CHUNK, self._many)
        constant = [
            ca.repmat(self._beside(a[None], 1 + len(each) + i), 1, count)
            for i, a in enumerate(fixed)
        ]
        for first in range(0, steps, count):
            rows = [a[first : first + count] for a in each]
            done = rows[0].shape[0]
            filled = [np.concatenate([a, np.repeat(a[-1:], count - done, axis=0)]) for a in rows]
            moving = [self._beside(a, 1 + i) for i, a in enumerate(filled)]
            results = function(self._beside(carried[None], 0), *moving, *constant)
            parts.append([r.full().T.reshape(count, -1)[:done] for r in results])
            carried = parts[-1][0][-1]
        states, outs = (np.concatenate(part) for part in zip(*parts, strict=True))
        return states, outs

    def _beside(self, rows: FloatArray, index: int) -> ca.DM:
        """(m, r) rows, a matrix each, as the input of m steps side by side."""
        height, width = self._one.size_in(index)
        m = rows.shape[0]
        return ca.DM(rows.reshape(m, width, height).transpose(2, 0, 1).reshape(height, m * width))
