# mypy: ignore-errors
"""Small linear algebra with the same bits on every processor.

A library picks its kernels by the processor and adds in an order of its own; fused multiply-adds round once
where two operations round twice. Here every operation is rounded on its own (no fastmath) and every sum has
one order: along the vectors nothing is summed, or four partial sums are kept as in `dot`.
"""

import numpy as np

from doe._kernel_cache import kernel

LANES = 64


@kernel(allocates=False)
def dot(a, b):
    """Inner product in four partial sums."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    whole = a.size - a.size % 4
    for k in range(0, whole, 4):
        s0 += a[k] * b[k]
        s1 += a[k + 1] * b[k + 1]
        s2 += a[k + 2] * b[k + 2]
        s3 += a[k + 3] * b[k + 3]
    for k in range(whole, a.size):
        s0 += a[k] * b[k]
    return (s0 + s2) + (s1 + s3)


@kernel(allocates=False)
def times(matrix, vector, out):
    """out = matrix @ vector."""
    for r in range(matrix.shape[0]):
        out[r] = dot(matrix[r], vector)


@kernel()
def quadratic_forms(f, matrix, out):
    """out[i] = f_i' matrix f_i for the rows of f and a symmetric matrix, LANES rows at a time."""
    n, p = f.shape
    turned, inner = np.empty((p, LANES)), np.empty(LANES)
    for start in range(0, n, LANES):
        m = min(LANES, n - start)
        for q in range(p):
            for i in range(m):
                turned[q, i] = f[start + i, q]
        values = out[start : start + m]
        for i in range(m):
            values[i] = 0.0
        for q in range(p):
            row, s = turned[q], 0.5 * matrix[q, q]
            for i in range(m):
                inner[i] = s * row[i]
            for r in range(q):
                s, other = matrix[q, r], turned[r]
                for i in range(m):
                    inner[i] += s * other[i]
            for i in range(m):
                values[i] += 2.0 * row[i] * inner[i]


@kernel()
def product(a, b, out):
    """out = a @ b."""
    for i in range(a.shape[0]):
        row = out[i]
        for q in range(row.size):
            row[q] = 0.0
        for k in range(a.shape[1]):
            s = a[i, k]
            for q in range(row.size):
                row[q] += s * b[k, q]


@kernel()
def add_gram(x, p, out):
    """out += x[:, :p]' x[:, :p]."""
    for i in range(x.shape[0]):
        for a in range(p):
            s = x[i, a]
            row = out[a]
            for b in range(p):
                row[b] += s * x[i, b]


@kernel()
def cholesky_root(a, root):
    """root = L^-1 for the symmetric a = L L' (overwritten); False when a is not positive definite."""
    p = a.shape[0]
    for i in range(p):
        for q in range(p):
            root[i, q] = 1.0 if i == q else 0.0
    for k in range(p):
        if not a[k, k] > 0.0:
            return False
        scale = 1.0 / np.sqrt(a[k, k])
        for q in range(p):
            a[k, q] *= scale
            root[k, q] *= scale
        for i in range(k + 1, p):
            s = a[k, i]
            row, ground = a[i], root[i]
            for q in range(k + 1, p):
                row[q] -= s * a[k, q]
            for q in range(k + 1):
                ground[q] -= s * root[k, q]
    return True
