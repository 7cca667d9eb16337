"""How well a Kriging predicts the mean at each point from the runs at all other points.

    e_I = (Q_II)^-1 (Q y)_I,   Q = C^-1 - C^-1 F (F' C^-1 F)^-1 F' C^-1,   I the runs of a point
    Q2 = 1 - sum_I (mean e_I)^2 / sum_I (mean y_I - mean of these)^2

Dubrule (1983), Mathematical Geology 15, 687-699; theta, sigma^2 and the nugget stay.
Where runs are repeated, leaving out one run tells nothing: its twins predict it, and a response of which the
others know nothing looks explained.
"""

import numpy as np
from scipy.linalg import solve_triangular

from workbench.search.surrogate.model import SearchModel

__all__ = ["q2_of_points"]


def q2_of_points(model: SearchModel, u: np.ndarray, v: np.ndarray) -> float:
    """Q2 of the means at the different points among u (n, d), whose runs gave the values v (n,) that `model`
    was fitted to; 1 where all means agree.
    """
    posterior = model.kriging.posterior_
    factor = posterior.factor
    half = solve_triangular(factor.lower, np.eye(len(v)), lower=True)
    half -= factor.q @ (factor.q.T @ half)
    precision = half.T @ half  # Q
    owner = np.unique(np.round(u, 9), axis=0, return_inverse=True)[1].ravel()
    groups = [np.flatnonzero(owner == k) for k in range(int(owner.max()) + 1)]
    weights = precision @ ((model.transform.forward(v) - posterior.shift) / posterior.scale)
    errors = [np.linalg.solve(precision[np.ix_(i, i)], weights[i]).mean() * posterior.scale for i in groups]
    means = np.array([model.transform.forward(v)[i].mean() for i in groups])
    spread = float(((means - means.mean()) ** 2).sum())
    return 1.0 - float(np.square(errors).sum()) / spread if spread > 0.0 else 1.0
