# mypy: ignore-errors
"""The map from pair coordinates to bodies and back, compiled.

Pair coordinates X, U as in `members`; turn (2, bodies): cosine and sine of every body's angle. `spread` maps
the sums of a pair's elements to the bodies: F <- J^T F,  K <- J^T K J + F . d2X/dq2 + J^T C dU/dq.
"""

from numba import njit

from ...compiler.options import INNER

__all__ = ["pair_coordinates", "pair_covector", "pull_back", "spread"]


@njit(**INNER)
def pair_coordinates(qa, va, turn, i, j, big):
    """big[:3] = X and big[3:6] = U of body i seen from body j (indices into the full coordinate arrays)."""
    c, s = turn[0, j], turn[1, j]
    dx, dy = qa[3 * i] - qa[3 * j], qa[3 * i + 1] - qa[3 * j + 1]
    du, dv = va[3 * i] - va[3 * j], va[3 * i + 1] - va[3 * j + 1]
    speed = va[3 * j + 2]
    x = c * dx + s * dy
    y = c * dy - s * dx
    big[0] = x
    big[1] = y
    big[2] = qa[3 * i + 2] - qa[3 * j + 2]
    big[3] = c * du + s * dv + speed * y
    big[4] = c * dv - s * du - speed * x
    big[5] = va[3 * i + 2] - speed


@njit(**INNER)
def pair_covector(turn, i, j, free, mu, big, w):
    """w (3,) = J mu: how a virtual motion mu of the free bodies moves the pair's coordinates."""
    c, s = turn[0, j], turn[1, j]
    x = 0.0 * mu[0]
    y, turn_i, turn_j = x, x, x
    if i < free:
        x += mu[3 * i]
        y += mu[3 * i + 1]
        turn_i = mu[3 * i + 2]
    if j < free:
        x -= mu[3 * j]
        y -= mu[3 * j + 1]
        turn_j = mu[3 * j + 2]
    w[0] = c * x + s * y + big[1] * turn_j
    w[1] = c * y - s * x - big[0] * turn_j
    w[2] = turn_i - turn_j


@njit(**INNER)
def pull_back(turn, i, j, free, big, f0, f1, f2, out):
    """out (n,) += J^T f: a force in pair coordinates on the free bodies."""
    c, s = turn[0, j], turn[1, j]
    x, y = c * f0 - s * f1, s * f0 + c * f1
    if i < free:
        out[3 * i] += x
        out[3 * i + 1] += y
        out[3 * i + 2] += f2
    if j < free:
        out[3 * j] -= x
        out[3 * j + 1] -= y
        out[3 * j + 2] += big[1] * f0 - big[0] * f1 - f2


@njit(**INNER)
def add_blocks(i, j, free, c, s, x, y, a, b0, b1, b2, out):
    """out += J^T [a, -a + b e^T] of the free bodies, J = dX/d(q_i, q_j), e = (0, 0, 1).

    J_i turns by -theta_j and J_j = -J_i + t e^T with t = (y, -x, 0): four blocks from one turned matrix,
    two vectors and a number.
    """
    h0, h1 = c * b0 - s * b1, s * b0 + c * b1
    for col in range(3):
        g0 = c * a[0, col] - s * a[1, col]
        g1 = s * a[0, col] + c * a[1, col]
        g2 = a[2, col]
        turned = y * a[0, col] - x * a[1, col]
        if i < free:
            out[3 * i, 3 * i + col] += g0
            out[3 * i + 1, 3 * i + col] += g1
            out[3 * i + 2, 3 * i + col] += g2
            if j < free:
                out[3 * i, 3 * j + col] -= g0
                out[3 * i + 1, 3 * j + col] -= g1
                out[3 * i + 2, 3 * j + col] -= g2
                out[3 * j, 3 * i + col] -= g0
                out[3 * j + 1, 3 * i + col] -= g1
                out[3 * j + 2, 3 * i + col] += turned - g2
        if j < free:
            out[3 * j, 3 * j + col] += g0
            out[3 * j + 1, 3 * j + col] += g1
            out[3 * j + 2, 3 * j + col] += g2 - turned
    if j < free:
        at = 3 * j + 2
        out[at - 2, at] -= h0
        out[at - 1, at] -= h1
        out[at, at] += y * b0 - x * b1 - b2
        if i < free:
            out[3 * i, at] += h0
            out[3 * i + 1, at] += h1
            out[3 * i + 2, at] += b2


@njit(**INNER)
def spread(turn, va, i, j, free, big, fr, kr, cr, tangent, force, k, c_out, half):
    """Add the pair's F, K, C to the free bodies (index < free); half (3, 6) is work space."""
    c, s = turn[0, j], turn[1, j]
    x, y = big[0], big[1]
    gx = c * fr[0] - s * fr[1]
    gy = s * fr[0] + c * fr[1]
    turned = y * fr[0] - x * fr[1]
    if i < free:
        force[3 * i] += gx
        force[3 * i + 1] += gy
        force[3 * i + 2] += fr[2]
    if j < free:
        force[3 * j] -= gx
        force[3 * j + 1] -= gy
        force[3 * j + 2] += turned - fr[2]
    if not tangent:
        return
    speed = va[3 * j + 2]
    du, dv = va[3 * i] - va[3 * j], va[3 * i + 1] - va[3 * j + 1]
    u0, u1 = c * dv - s * du - speed * x, -c * du - s * dv - speed * y  # dU/dtheta_j of the x and y rates
    # dF/dq = K J + C dU/dq; the column of theta_j holds b beside minus that of theta_i
    for r in range(3):
        k0, k1, c0, c1 = kr[r, 0], kr[r, 1], cr[r, 0], cr[r, 1]
        half[r, 0] = c * k0 - s * k1 - speed * (s * c0 + c * c1)
        half[r, 1] = s * k0 + c * k1 + speed * (c * c0 - s * c1)
        half[r, 2] = kr[r, 2]
        half[r, 3] = k0 * y - k1 * x + c0 * u0 + c1 * u1
    add_blocks(i, j, free, c, s, x, y, half, half[0, 3], half[1, 3], half[2, 3], k)
    for r in range(3):
        c0, c1 = cr[r, 0], cr[r, 1]
        half[r, 0] = c * c0 - s * c1
        half[r, 1] = s * c0 + c * c1
        half[r, 2] = cr[r, 2]
        half[r, 3] = c0 * y - c1 * x
    add_blocks(i, j, free, c, s, x, y, half, half[0, 3], half[1, 3], half[2, 3], c_out)
    # F . d2X/dq2: only theta_j with the positions and with itself; gy, -gx is F turned by a right angle
    if j < free:
        t = 3 * j + 2
        k[t, t] -= fr[0] * x + fr[1] * y
        k[3 * j, t] += gy
        k[t, 3 * j] += gy
        k[3 * j + 1, t] -= gx
        k[t, 3 * j + 1] -= gx
        if i < free:
            k[3 * i, t] -= gy
            k[t, 3 * i] -= gy
            k[3 * i + 1, t] += gx
            k[t, 3 * i + 1] += gx
