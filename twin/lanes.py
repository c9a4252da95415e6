"""C code that works on LANES numbers at once, in the processor's vectors.

CasADi writes the operations of a function for one number at a time; here they are written anew,
from its list of instructions, for vectors as GCC and clang have them:
https://gcc.gnu.org/onlinedocs/gcc/Vector-Extensions.html. Where the processor has none the compiler
takes them apart. What the lanes are is the caller's: directions (`tangent.py`), or whole cells
(`abreast.py`).
"""

from collections.abc import Collection, Sequence
from math import isfinite, isnan

import casadi as ca
import numpy as np

from twin.chain_rule import Operation, instructions

LANES = 4
"""As many doubles as AVX2 holds. Eight take 1.6 times as long as four on such a processor."""

# CasADi's operations, of one or two vectors: those of the step and its derivatives, and what a BPX
# file may say. Truth is 1 or 0; of two numbers one of which is NaN the other is the least and the
# most, as in C.
OPERATIONS = {
    ca.OP_ADD: "{0}+{1}",
    ca.OP_SUB: "{0}-{1}",
    ca.OP_MUL: "{0}*{1}",
    ca.OP_DIV: "{0}/{1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0}*{0}",
    ca.OP_TWICE: "{0}+{0}",
    ca.OP_INV: "1/{0}",
    ca.OP_SQRT: "root({0})",
    ca.OP_EXP: "exponential({0})",
    ca.OP_LOG: "logarithm({0})",
    ca.OP_TANH: "tangent_h({0})",
    ca.OP_SINH: "sine_h({0})",
    ca.OP_COSH: "cosine_h({0})",
    ca.OP_ASINH: "area_sine_h({0})",
    ca.OP_POW: "power({0}, {1})",
    ca.OP_CONSTPOW: "power({0}, {1})",
    ca.OP_FABS: "size({0})",
    ca.OP_SIGN: "SELECT((words)({0}!={0}), {0}, TRUTH({0}>0)-TRUTH({0}<0))",
    ca.OP_FMIN: "SELECT((words)({0}<{1})|(words)({1}!={1}), {0}, {1})",
    ca.OP_FMAX: "SELECT((words)({0}>{1})|(words)({1}!={1}), {0}, {1})",
    ca.OP_LT: "TRUTH({0}<{1})",
    ca.OP_LE: "TRUTH({0}<={1})",
    ca.OP_EQ: "TRUTH({0}=={1})",
    ca.OP_NE: "TRUTH({0}!={1})",
    ca.OP_NOT: "TRUTH({0}==0)",
    ca.OP_AND: "TRUTH((words)({0}!=0)&(words)({1}!=0))",
    ca.OP_OR: "TRUTH((words)({0}!=0)|(words)({1}!=0))",
    ca.OP_IF_ELSE_ZERO: "(lanes)((words)({0}!=0)&(words){1})",
}

HEAD = f"""
#include <math.h>
#ifndef casadi_real
#define casadi_real double
#define casadi_int long long int
#endif
enum {{ LANES = {LANES} }};
typedef double lanes __attribute__((vector_size({8 * LANES})));
typedef lanes loose __attribute__((aligned(8), may_alias)); /* as they lie in arrays of doubles */
typedef long long words __attribute__((vector_size({8 * LANES})));
#define ALL(v) ((lanes){{{", ".join(["v"] * LANES)}}})
"""

MATHS = """
#define SELECT(m, a, b) ((lanes)(((m) & (words)(a)) | (~(m) & (words)(b))))
#define TRUTH(m) ((lanes)((words)(m) & (words)ALL(1.)))
#define SIGN ((words)ALL(-0.))
/* lanes that do nothing hold what the one before them does */
#define OF_EACH(name, f) static lanes name(lanes a) { \\
  lanes r; r[0] = f(a[0]); \\
  for (int k = 1; k < LANES; ++k) r[k] = a[k] == a[k-1] ? r[k-1] : f(a[k]); \\
  return r; }
#if defined(__AVX2__) && defined(__GLIBC__)
/* the C library's own for four at once, right to 4 units in the last place */
lanes _ZGVdN4v_exp(lanes);
lanes _ZGVdN4v_log(lanes);
#define exponential _ZGVdN4v_exp
#define logarithm _ZGVdN4v_log
#else
OF_EACH(exponential, exp)
OF_EACH(logarithm, log)
#endif
OF_EACH(sine_h, sinh)
OF_EACH(cosine_h, cosh)
static lanes power(lanes a, lanes b) {
  for (int k = 0; k < LANES; ++k) a[k] = pow(a[k], b[k]);
  return a;
}
static inline lanes root(lanes a) {
  for (int k = 0; k < LANES; ++k) a[k] = sqrt(a[k]);
  return a;
}
static inline lanes size(lanes a) { return (lanes)((words)a & ~SIGN); }
static inline lanes signed_as(lanes a, lanes b) {
  return (lanes)((words)size(a) | ((words)b & SIGN));
}
/* 1e-16 in absolute terms, which a potential needs, in a third of the time */
static lanes tangent_h(lanes x) {
  lanes e = exponential(-2 * size(x));
  return signed_as((1 - e) / (1 + e), x);
}
static lanes area_sine_h(lanes x) {
  lanes a = size(x);
  return signed_as(logarithm(a + root(a * a + 1)), x);
}
"""


def c_of_lanes(functions: Sequence[ca.Function], alike: Collection[int] = ()) -> str:
    """C of functions of scalars for a lane of each number: void name(inputs, outputs).

    Those of the inputs `alike` are plain numbers, the same in every lane.
    """
    tables = _Tables()
    parts = [_c_of(f, alike, tables) for f in functions]
    return "".join([HEAD, MATHS, tables.code(), *parts])


def _c_of(f: ca.Function, alike: Collection[int], tables: "_Tables") -> str:
    inputs = [f"const {'double' if i in alike else 'loose'}* x{i}" for i in range(f.n_in())]
    outputs = [f"loose* y{i}" for i in range(f.n_out())]
    registers = ", ".join(f"a{k}" for k in range(f.sz_w()))
    body = "\n".join(_statement(o, alike, tables) for o in instructions(f))
    head = f"static void {f.name()}({', '.join(inputs + outputs)})"
    return f"{head} {{\nlanes {registers};\n{body}\n}}\n"


def _statement(own: Operation, alike: Collection[int], tables: "_Tables") -> str:
    """Of one instruction; KeyError of an operation that is not among OPERATIONS."""
    op, of, to, constant, called = own
    if op == ca.OP_OUTPUT:
        return f"y{to[0]}[{to[1]}]=a{of[0]};"
    if op == ca.OP_INPUT:
        given = f"x{of[0]}[{of[1]}]"
        return f"a{to[0]}={f'ALL({given})' if of[0] in alike else given};"
    if op == ca.OP_CONST:
        return f"a{to[0]}=ALL({_number(constant)});"
    if called:
        arguments = ", ".join(f"a{k}" for k in of)
        return f"a{to[0]}={tables.name(called)}_of_lanes({arguments});"
    return f"a{to[0]}={OPERATIONS[op].format(*(f'a{k}' for k in of))};"


def _number(value: float) -> str:
    """As C writes it."""
    if isfinite(value):
        return repr(value)
    return "NAN" if isnan(value) else f"({'-' if value < 0 else ''}INFINITY)"


class _Tables:
    """Functions that are called, each with one number as its result: in CasADi's own code."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[str, ca.Function]] = {}  # by what CasADi tells them apart by

    def name(self, called: ca.Function) -> str:
        """In C."""
        name = f"table_{len(self._known)}"
        return self._known.setdefault(hash(called), (name, called))[0]

    def code(self) -> str:
        """Of each number by itself, then of lanes."""
        if not self._known:
            return ""
        generator, own = ca.CodeGenerator("tables", {"with_header": False}), []
        for name, called in self._known.values():
            given = called.mx_in()
            wrapped = ca.Function(name, given, called.call(given))
            generator.add(wrapped)
            own.append(_of_each_lane(wrapped))
        return f"{generator.dump()}{''.join(own)}"


def _of_each_lane(table: ca.Function) -> str:
    """Lanes that do nothing hold what the one before them does, and are not looked up."""
    sizes = [table.nnz_in(i) for i in range(table.n_in())]
    names = [f"x{k}" for k in range(sum(sizes))]
    first = np.cumsum([0, *sizes[:-1]]).tolist()
    given = ", ".join(f"x + {k}" if n else "0" for k, n in zip(first, sizes, strict=True))
    same = " && ".join(f"{x}[k] == {x}[k-1]" for x in names)
    scratch = [max(n, 1) for n in (table.sz_arg(), table.sz_res(), table.sz_iw(), table.sz_w())]
    return f"""
static lanes {table.name()}_of_lanes({", ".join(f"lanes {x}" for x in names)}) {{
  lanes y;
  for (int k = 0; k < LANES; ++k) {{
    double x[] = {{{", ".join(f"{x}[k]" for x in names)}}}, one, w[{scratch[3]}];
    const double* arg[{scratch[0]}] = {{{given}}};
    double* res[{scratch[1]}] = {{&one}};
    long long int iw[{scratch[2]}];
    if (k && {same}) {{ y[k] = y[k-1]; continue; }}
    {table.name()}(arg, res, iw, w, 0);
    y[k] = one;
  }}
  return y;
}}
"""
