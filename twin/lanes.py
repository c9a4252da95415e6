"""C code of a tangent that goes along LANES directions at once, in the processor's vectors.

A change along a direction is sums, products and quotients, the same in every direction; what is
shared by all directions (`Tangent.split`) is worked out once. CasADi writes the operations for one
number at a time, so here they are written anew, from its list of instructions, for vectors as GCC
and clang have them: https://gcc.gnu.org/onlinedocs/gcc/Vector-Extensions.html. Where the processor
has none the compiler takes them apart.
"""

from collections.abc import Iterator

import casadi as ca

from twin.chain_rule import instructions
from twin.kernel import c_of
from twin.tangent import NAME

LANES = 4
"""As many doubles as AVX2 holds. Eight take 1.6 times as long as four on such a processor."""
BINARY = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}

HEAD = f"""
typedef double lanes __attribute__((vector_size({8 * LANES})));
typedef long long words __attribute__((vector_size({8 * LANES})));
#define ALL(v) ((lanes){{{", ".join(["v"] * LANES)}}})
#define EACH(v, n) ((lanes){{{", ".join(f"(v)[{k}*n]" for k in range(LANES))}}})
#define IF(a, b) ((lanes)((words)(b) & ((a) != ALL(0.))))
#define PUT(a, v, n) {" ".join(f"(v)[{k}*n]=a[{k}];" for k in range(LANES))}
"""

STEP = """
static int %(name)s(const casadi_real** arg, casadi_real** res, casadi_int* iw, casadi_real* w,
                    int mem) {
  /* behind the seven inputs and the two outputs is scratch, which what is shared may use */
  const casadi_real **in = arg + 7, *d_state = arg[0] + %(state)d;
  casadi_real known[%(known)d], **out = res + 2, *d_after = res[0] + %(state)d;
  in[0] = arg[1]; in[1] = arg[0]; in[2] = arg[2]; in[3] = arg[3];
  out[0] = known;
  if (shared(in, out, iw, w, mem)) return 1;
  for (casadi_int i = 0; i < %(state)d; ++i) res[0][i] = arg[1][i];
  for (casadi_int k = 0; k < *arg[6]; k += %(lanes)d)
    along(known, d_state + k * %(state)d, arg[4] + k * %(drive)d, arg[5] + k * %(p)d,
          d_after + k * %(state)d, res[1] + k * %(shown)d);
  return 0;
}
"""


def source(shared: ca.Function, along: ca.Function) -> str:
    """C of `tangent_step` along as many directions as its last input says, whole LANES."""
    sizes = {
        "known": along.numel_in(0), "state": along.numel_in(1), "drive": along.numel_in(2),
        "p": along.numel_in(3), "shown": along.numel_out(1),
    }  # fmt: skip
    own = STEP % {"name": NAME, "lanes": LANES, **sizes}
    return c_of(shared) + HEAD + _along(along) + own


def _along(along: ca.Function) -> str:
    """C of a function of scalars, for LANES directions; the first input is what they share."""
    inputs = ", ".join(f"const double* x{i}" for i in range(along.n_in()))
    outputs = ", ".join(f"double* y{i}" for i in range(along.n_out()))
    registers = ", ".join(f"a{k}" for k in range(along.sz_w()))
    body = "\n".join(_statements(along))
    return f"static void along({inputs}, {outputs}) {{\nlanes {registers};\n{body}\n}}\n"


def _statements(along: ca.Function) -> Iterator[str]:
    """One for each instruction."""
    for op, of, to, constant, _ in instructions(along):
        if op == ca.OP_OUTPUT:
            yield f"PUT(a{of[0]}, y{to[0]}+{to[1]}, {along.numel_out(to[0])})"
        elif op == ca.OP_INPUT:
            direction = f"EACH(x{of[0]}+{of[1]}, {along.numel_in(of[0])})"
            yield f"a{to[0]}={direction if of[0] else f'ALL(x0[{of[1]}])'};"
        elif op == ca.OP_CONST:
            yield f"a{to[0]}=ALL({constant!r});"
        elif op == ca.OP_NEG:
            yield f"a{to[0]}=-a{of[0]};"
        elif op == ca.OP_IF_ELSE_ZERO:
            yield f"a{to[0]}=IF(a{of[0]}, a{of[1]});"
        else:  # KeyError of what is not linear in a direction
            yield f"a{to[0]}=a{of[0]}{BINARY[op]}a{of[1]};"
