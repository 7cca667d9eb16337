"""The update (7.11) where it is legal, and what to do where it is not: the printed form, not a tool.

    alpha_i = c_i + B_i^eta_i (alpha_i^k - c_i),   eta_i = 1/(zeta_i - xi_i),
    B_i = -f_{0,i} / sum_j l_j f_{j,i}

It needs one centre c_i for all functions and B_i > 0. The printed (7.11) mixes g and G, drops the index of
zeta_ji and is a negative number to a fractional power on the dissertation's own energy example. With the
centre below, xi <= 1 and zeta >= 1 the other signs are settled without it:

| f_0,i | sum_j l_j f_j,i | update |
|---|---|---|
| < 0 | > 0 | closed form |
| >= 0 | >= 0, not both zero | lower end of the move box |
| <= 0 | <= 0, not both zero | upper end (members in no budget: the printed formula divides by zero) |
| > 0 | < 0 | not legal: the stationary point is a maximum; the general subproblem decides |
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["closed_form_update"]

Array = NDArray[np.float64]


def closed_form_update(
    x: Array,
    objective: Array,
    priced: Array,
    *,
    centre: Array,
    xi: Array,
    zeta: Array,
    lower: Array,
    upper: Array,
) -> tuple[Array, NDArray[np.bool_]]:
    """The new density and a mask of the members whose update is not legal (they keep their density).

    x, objective (f_0,i), priced (sum_j l_j f_j,i), centre < x, xi <= 1, zeta >= 1, xi < zeta; all (n,).

    >>> import numpy as np
    >>> one = np.ones(1)
    >>> none = 0 * one
    >>> closed_form_update(one, -4 * one, one, centre=none, xi=-one, zeta=one, lower=none, upper=9 * one)[0]
    array([2.])
    """
    legal = (objective < 0) & (priced > 0)
    ratio = np.where(legal, -objective / np.where(legal, priced, 1.0), 1.0)
    new = centre + ratio ** (1 / (zeta - xi)) * (x - centre)
    still = (objective == 0) & (priced == 0)
    new = np.where(~legal & (objective >= 0) & (priced >= 0) & ~still, lower, new)
    new = np.where(~legal & (objective <= 0) & (priced <= 0) & ~still, upper, new)
    maximum = (objective > 0) & (priced < 0)
    return np.clip(np.where(maximum | still, x, new), lower, upper), maximum
