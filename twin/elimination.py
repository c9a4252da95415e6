"""Gaussian elimination written out once, symbolically, for a matrix of fixed sparsity.

No pivoting: the caller says why every pivot is safe (newton.py: an electrode's reactions;
electrolyte.py: the salt). The result is straight-line code without index arithmetic.
"""

import casadi as ca

Row = dict[int, ca.SX]


def solve(matrix: ca.SX, rhs: ca.SX) -> ca.SX:
    """Solution x (n, k) of matrix (n, n) @ x = rhs (n, k), touching structural non-zeros only."""
    rows: list[Row] = [{} for _ in range(matrix.shape[0])]
    for i, k in zip(*matrix.sparsity().get_triplet(), strict=True):
        rows[i][k] = matrix[i, k]
    b = [rhs[i, :] for i in range(len(rows))]
    for k in range(len(rows)):
        _eliminate(rows, b, k)
    x: list[ca.SX] = [ca.SX(0)] * len(rows)
    for k in reversed(range(len(rows))):
        for column, value in rows[k].items():
            if column > k:
                b[k] -= value * x[column]
        x[k] = b[k] / rows[k][k]
    return ca.vertcat(*x)


def _eliminate(rows: list[Row], b: list[ca.SX], k: int) -> None:
    """Take unknown k out of all rows below row k."""
    right = [(column, value) for column, value in rows[k].items() if column > k]
    inverse = 1 / rows[k][k]
    for i in range(k + 1, len(rows)):
        if k not in rows[i]:
            continue
        factor = rows[i].pop(k) * inverse
        b[i] -= factor * b[k]
        for column, value in right:
            rows[i][column] = rows[i].get(column, 0) - factor * value
