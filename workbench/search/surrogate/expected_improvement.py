"""Expected improvement, by its logarithm, which neither underflows nor loses its slope far from the optimum.

With m(u) and s(u) the predicted mean and standard deviation of the quantity to be maximised, b the best value
seen and z = (m - b)/s,

    EI(u) = s (z Phi(z) + phi(z))            Jones, Schonlau and Welch 1998
"""

import numpy as np
from scipy.special import erfcx, log_ndtr

__all__ = ["log_expected_improvement"]


def log_expected_improvement(mean: np.ndarray, std: np.ndarray, best: float) -> np.ndarray:
    """log EI for arrays (n,); -inf where the standard deviation is zero and nothing is gained.

    >>> float(np.round(np.exp(log_expected_improvement(np.zeros(1), np.ones(1), 0.0))[0], 6))
    0.398942
    """
    std = np.maximum(std, 1e-100)
    z = (mean - best) / std
    log_phi = -0.5 * z * z - 0.5 * np.log(2 * np.pi)
    # z Phi + phi = phi (1 + z Phi/phi), and Phi/phi = sqrt(pi/2) erfcx(-z/sqrt 2), which stays finite
    # for z < 0
    low = z < -1
    inner = np.empty_like(z)
    inner[~low] = np.log(z[~low] * np.exp(log_ndtr(z[~low])) + np.exp(log_phi[~low]))
    tail = 1 + z[low] * np.sqrt(np.pi / 2) * erfcx(-z[low] / np.sqrt(2))
    # for very negative z the bracket cancels to 1/z^2
    tail = np.where(z[low] < -1e4, 1 / z[low] ** 2, np.maximum(tail, 1e-300))
    inner[low] = log_phi[low] + np.log(tail)
    return np.log(std) + inner
