"""Gaussian elimination written out once, symbolically, for a matrix of fixed sparsity.

No pivoting: the caller orders the unknowns so that every pivot is safe (twin/step.py says why its
pivots are). The result is straight-line code without index arithmetic.
"""

import casadi as ca


def solve(matrix: ca.SX, rhs: ca.SX) -> ca.SX:
    """x (n,) with matrix (n, n) @ x = rhs (n,), touching structural non-zeros only."""
    n = matrix.shape[0]
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    for i, k in zip(*matrix.sparsity().get_triplet(), strict=True):
        rows[i][k] = matrix[i, k]
    b = [rhs[i] for i in range(n)]
    below: list[list[int]] = [[] for _ in range(n)]
    for i, row in enumerate(rows):
        for k in row:
            if k < i:
                below[k].append(i)
    for k in range(n):
        inverse = 1 / rows[k][k]
        upper = [(c, v) for c, v in rows[k].items() if c > k]
        for i in sorted(set(below[k])):
            factor = rows[i].pop(k) * inverse
            b[i] -= factor * b[k]
            for c, v in upper:
                if c in rows[i]:
                    rows[i][c] -= factor * v
                else:
                    rows[i][c] = -factor * v
                    if c < i:
                        below[c].append(i)
        rows[k][k] = inverse
    x: list[ca.SX] = [ca.SX(0)] * n
    for k in reversed(range(n)):
        total = b[k]
        for c, v in rows[k].items():
            if c > k:
                total -= v * x[c]
        x[k] = total * rows[k][k]
    return ca.vertcat(*x)
