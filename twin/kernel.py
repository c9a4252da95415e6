"""A step function, repeated: as compiled C where there is a compiler, in CasADi's VM elsewhere.

`kernel(function)` takes a function (carried, each..., fixed...) -> (carried, out) and gives a loop
over it: what is carried goes from step to step, `each` changes from step to step, `fixed` does not.
"""

import ctypes
import subprocess
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Protocol

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import compiled

FloatArray = npt.NDArray[np.float64]

CHUNK = 512  # steps a call of the virtual machine's loop


class Backend(Enum):
    """What runs the kernel; both give the same numbers (tests/twin/test_kernel.py)."""

    AUTO = "compiled where a C compiler is found"
    VIRTUAL_MACHINE = "CasADi's virtual machine"


class Kernel(Protocol):
    """A loop over a function (carried, each..., fixed...) -> (carried, out)."""

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


def kernel(function: ca.Function, backend: Backend = Backend.AUTO) -> Kernel:
    """The loop over `function`; in the virtual machine where no compiled code can be had."""
    if backend is Backend.AUTO and (found := compiled.compiler()):
        try:
            return CompiledLoop(compiled.library(_source(function), found), function)
        except (OSError, subprocess.SubprocessError):
            pass  # read-only home, full disk, broken compiler: the same numbers, slower
    return VirtualLoop(function)


def _sizes(function: ca.Function) -> tuple[list[int], list[int]]:
    """Lengths of the inputs and outputs."""
    inputs = [function.numel_in(i) for i in range(function.n_in())]
    return inputs, [function.numel_out(i) for i in range(function.n_out())]


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


def _source(function: ca.Function) -> str:
    generator = ca.CodeGenerator(function.name(), {"with_header": False})
    generator.add(function)
    loop = LOOP.replace("NAME", function.name())
    return f"{PRELUDE}{generator.dump()}{loop}"


class CompiledLoop:
    """Calls the C loop; other threads run meanwhile."""

    def __init__(self, library: Path, function: ca.Function) -> None:
        self._loop = ctypes.CDLL(str(library)).loop
        self._inputs, self._outputs = _sizes(function)
        self._scratch = [function.sz_arg(), function.sz_res(), function.sz_iw(), function.sz_w()]
        self._width = np.array(self._outputs, dtype=np.int64)

    def __call__(
        self, carried: FloatArray, each: Sequence[FloatArray], fixed: Sequence[FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """As `Kernel`."""
        steps = each[0].shape[0]
        given = [np.ascontiguousarray(a, dtype=float) for a in (carried, *each, *fixed)]
        lengths = [a.size // (steps if 0 < i <= len(each) else 1) for i, a in enumerate(given)]
        assert lengths == self._inputs, f"inputs of {lengths}, expected {self._inputs}"
        moving = [lengths[i] if 0 < i <= len(each) else 0 for i in range(len(given))]
        stride = np.array(moving, dtype=np.int64)
        states, out = (np.empty((steps, width)) for width in self._outputs)
        pointers = np.array([a.ctypes.data for a in given], dtype=np.uint64)
        results = np.array([states.ctypes.data, out.ctypes.data], dtype=np.uint64)
        scratch = [np.empty(size + 1) for size in self._scratch]
        tail = [a.ctypes.data for a in (results, self._width, *scratch)]
        count = ctypes.c_longlong(steps), ctypes.c_longlong(len(given))
        failed = self._loop(
            count[0], *map(ctypes.c_void_p, (pointers.ctypes.data, stride.ctypes.data)), count[1],
            *map(ctypes.c_void_p, tail),
        )  # fmt: skip
        assert not failed, "generated code reports failure only where it calls outside code"
        return states, out


class VirtualLoop:
    """CHUNK steps a call of CasADi's own loop."""

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
