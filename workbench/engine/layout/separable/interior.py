"""The separable subproblem by a primal-dual interior point: for models that are flat in places.

Where a variable enters objective and constraints linearly the dual has kinks and the minimiser of the
Lagrangian jumps; the interior point does not mind. Conditions of

    min f~_0(x) + sum_j cap_j z_j   subject to   f~_j(x) - z_j + s_j = 0,   s, z >= 0,   lower <= x <= upper

are relaxed by mu and solved by damped Newton steps while mu falls, as Svanberg 2002 does for MMA; z are the
elastic variables. mu falls faster the smaller it is (Waechter and Biegler 2006). Each step costs O(n m^2), in
three compiled passes over the variables.
"""

import numpy as np
from numpy.typing import NDArray

from . import _kernels_interior as kernels
from .model import SeparableModel

__all__ = ["interior_point"]

Array = NDArray[np.float64]

_STEPS = 150
_MET = 3.0  # residual in units of mu at which mu falls
_FALL, _POWER = 0.2, 1.5  # of mu


@np.errstate(all="ignore")  # next to a mechanism gradients overflow; what is not finite ends the steps
def interior_point(model: SeparableModel, caps: Array, *, last: float = 1e-14) -> tuple[Array, Array]:
    """x (n,) and multipliers (m,) of the subproblem with elastic price caps (m,).

    last: mu, in units of the objective's reach, at which the steps end.
    """
    free = model.upper > model.lower
    x = np.where(free, model.point, model.lower)
    base, _ = model.at(x)  # at the point the free variables add nothing
    m = model.constraints
    tables = model.gradients, model.distances, model.exponents, model.curvatures
    point, lo, hi = model.point, model.lower, model.upper
    if not free.all():
        gradients, distances, exponents, curvatures = (np.ascontiguousarray(t[:, free]) for t in tables)
        tables = gradients, distances, exponents, curvatures
        point, lo, hi = point[free], lo[free], hi[free]
    reach = np.maximum(np.abs(model.gradients) @ (model.upper - model.lower), 1e-300)
    unit, size = max(float(reach[0]), 1e-12 * float((caps * reach[1:]).max())), reach[1:]
    width = hi - lo
    state = np.clip(point, lo + 0.05 * width, hi - 0.05 * width)
    top = caps * size / unit  # caps in scaled units
    y = np.minimum(np.ones(m), 0.5 * top)
    s, z, e = np.ones(m), np.ones(m) * 0.1, top - y
    n = max(len(state), 1)
    mu, failures = 1.0 / n, 0  # a variable is worth so much of the whole
    below, above = mu / (state - lo), mu / (hi - state)
    theta, first = np.empty(n), np.empty(n)
    dx, dbelow, dabove = np.empty(n), np.empty(n), np.empty(n)
    work = np.empty((m + 1, n)), np.empty(n), np.empty(n)
    spare = np.empty((m + 1, n)), np.empty(n), np.empty(n)

    def rows(
        values: Array, y: Array, s: Array, z: Array, e: Array, mu: float
    ) -> tuple[Array, Array, Array, Array]:
        return values[1:] / size - z + s, top - y - e, y * s - mu, e * z - mu

    def look(
        state: Array, y: Array, below: Array, above: Array, out: tuple[Array, Array, Array]
    ) -> tuple[Array, float, float]:
        g, d, p, q = tables
        slopes, bend, rest = out
        values = kernels.conditions(
            state, y, below, above, base, g, d, p, q, point, unit, size, slopes, bend, rest
        )
        return values, *kernels.residuals(state, below, above, mu, lo, hi, rest)

    values, squares, largest = look(state, y, below, above, work)
    for _ in range(_STEPS):
        residuals = rows(values, y, s, z, e, mu)
        error = max(largest, *(float(np.abs(r).max(initial=0)) for r in residuals))
        if error < _MET * mu or (mu <= last and error < 10 * last):
            if mu <= last:
                break
            mu = max(min(_FALL * mu, mu**_POWER), 0.1 * last)
            squares, largest = kernels.residuals(state, below, above, mu, lo, hi, work[2])
            residuals = rows(values, y, s, z, e, mu)
        slopes, bend, rest = work
        matrix, right = kernels.assemble(
            state, below, above, mu, lo, hi, size, slopes, bend, rest, theta, first
        )
        rp, rz = residuals[:2]
        matrix += np.diag(z / e + s / y)
        right = right + rp - (z / e) * (mu / z - e - rz) + (mu / y - s)
        if not np.isfinite(matrix).all():
            break
        try:
            dy = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            break
        if not np.isfinite(dy).all():
            break
        length = kernels.directions(
            state, below, above, mu, lo, hi, size, slopes, theta, first, dy, dx, dbelow, dabove
        )
        dz = (dy + mu / z - e - rz) * z / e
        ds = mu / y - s - s / y * dy
        de = rz - dy
        for v, dv in ((y, dy), (s, ds), (z, dz), (e, de)):
            inward = dv < 0
            if inward.any():
                length = min(length, 0.995 * float((-v[inward] / dv[inward]).min()))
        norm = squares + sum(float(r @ r) for r in residuals)
        for _ in range(20):
            new = (state + length * dx, y + length * dy, below + length * dbelow, above + length * dabove)
            others = (s + length * ds, z + length * dz, e + length * de)
            seen = look(*new, spare)
            if seen[1] + sum(float(r @ r) for r in rows(seen[0], new[1], *others, mu)) <= norm:
                break
            length *= 0.5
        else:  # rounding: what is left is for Newton on the active set
            failures += 1
            if failures > 2 or error < 1e-11:
                break
            mu *= 10
            seen = (seen[0], *kernels.residuals(new[0], *new[2:], mu, lo, hi, spare[2]))
        state, y, below, above = new
        s, z, e = others
        values, squares, largest = seen
        work, spare = spare, work
    x[free] = np.clip(state, lo, hi)
    # the smaller of the two factors of a complementary pair is the one that is zero
    x[free] = np.where(state - lo < below * width**2, lo, x[free])
    x[free] = np.where(hi - state < above * width**2, hi, x[free])
    return x, np.where(y < s, 0.0, y) * unit / size
