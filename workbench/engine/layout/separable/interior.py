"""The separable subproblem by a primal-dual interior point: for models that are flat in places.

Where a variable enters objective and constraints linearly the dual has kinks and the minimiser of the
Lagrangian jumps; the interior point does not mind. Conditions of

    min f~_0(x) + sum_j cap_j z_j   subject to   f~_j(x) - z_j + s_j = 0,   s, z >= 0,   lower <= x <= upper

are relaxed by mu and solved by damped Newton steps while mu falls, as Svanberg 2002 does for MMA; z are the
elastic variables. Each step costs O(n m^2).
"""

import numpy as np
from numpy.typing import NDArray

from .model import SeparableModel

__all__ = ["interior_point"]

Array = NDArray[np.float64]


@np.errstate(all="ignore")  # next to a mechanism gradients overflow; what is not finite ends the steps
def interior_point(model: SeparableModel, caps: Array) -> tuple[Array, Array]:
    """x (n,) and multipliers (m,) of the subproblem with elastic price caps (m,)."""
    free = model.upper > model.lower
    lo, hi, m = model.lower[free], model.upper[free], model.constraints
    reach = np.maximum(np.abs(model.gradients) @ (model.upper - model.lower), 1e-300)
    unit, size = max(float(reach[0]), 1e-12 * float((caps * reach[1:]).max())), reach[1:]
    x = model.point.copy()
    x[~free] = model.lower[~free]
    width = hi - lo
    state = np.clip(x[free], lo + 0.05 * width, hi - 0.05 * width)
    top = caps * size / unit  # caps in scaled units
    y = np.minimum(np.ones(m), 0.5 * top)
    s, z, e = np.ones(m), np.ones(m) * 0.1, top - y
    below, above = 1 / (state - lo), 1 / (hi - state)
    mu, failures = 1.0, 0

    def conditions(
        state: Array, y: Array, s: Array, z: Array, e: Array, below: Array, above: Array, mu: float
    ) -> tuple[list[Array], Array, Array]:
        x[free] = state
        values, gradients = model.at(x)
        G = gradients[:, free]
        J = G[1:] / size[:, None]
        rd = G[0] / unit + y @ J - below + above
        residuals = [
            rd * width, values[1:] / size - z + s, top - y - e, y * s - mu, e * z - mu,
            below * (state - lo) - mu, above * (hi - state) - mu,
        ]  # fmt: skip
        return residuals, J, G

    for _ in range(150):
        residuals, J, _ = conditions(state, y, s, z, e, below, above, mu)
        error = max(float(np.abs(r).max(initial=0)) for r in residuals)
        if error < 0.5 * mu or (mu <= 1e-14 and error < 1e-13):
            if mu <= 1e-14:
                break
            mu = max(0.1 * mu, 1e-15)
            residuals, J, _ = conditions(state, y, s, z, e, below, above, mu)
        rd, rp, rz, _, _, _, _ = residuals
        rd = rd / width
        bend = model.second_derivatives(x)[:, free]
        sl, su = np.maximum(state - lo, 1e-16 * width), np.maximum(hi - state, 1e-16 * width)
        theta = bend[0] / unit + (y / size) @ bend[1:] + below / sl + above / su
        first = -(rd + below - above) + mu / sl - mu / su
        right = -rp + (z / e) * (mu / z - e - rz) - (mu / y - s)
        scaled = J / theta
        matrix = scaled @ J.T + np.diag(z / e + s / y)
        if not np.isfinite(matrix).all():
            break
        try:
            dy = np.linalg.solve(matrix, scaled @ first - right)
        except np.linalg.LinAlgError:
            break
        if not np.isfinite(dy).all():
            break
        dx = (first - dy @ J) / theta
        dz = (dy + mu / z - e - rz) * z / e
        ds = mu / y - s - s / y * dy
        de = rz - dy
        dbelow = mu / sl - below - below / sl * dx
        dabove = mu / su - above + above / su * dx
        length = 1.0
        for v, dv in (
            (y, dy),
            (s, ds),
            (z, dz),
            (e, de),
            (below, dbelow),
            (above, dabove),
            (sl, dx),
            (su, -dx),
        ):
            inward = dv < 0
            if inward.any():
                length = min(length, 0.995 * float((-v[inward] / dv[inward]).min()))
        norm = sum(float(r @ r) for r in residuals)
        for _ in range(20):
            new = (state + length * dx, y + length * dy, s + length * ds, z + length * dz, e + length * de,
                   below + length * dbelow, above + length * dabove)  # fmt: skip
            if sum(float(r @ r) for r in conditions(*new, mu)[0]) <= norm:
                break
            length *= 0.5
        else:  # rounding: what is left is for Newton on the active set
            failures += 1
            if failures > 2 or error < 1e-11:
                break
            mu *= 10
        state, y, s, z, e, below, above = new
    x[free] = np.clip(state, lo, hi)
    # the smaller of the two factors of a complementary pair is the one that is zero
    x[free] = np.where(state - lo < below * width**2, lo, x[free])
    x[free] = np.where(hi - state < above * width**2, hi, x[free])
    return x, np.where(y < s, 0.0, y) * unit / size
