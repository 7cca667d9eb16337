"""Published Kriging fits: the two cases of the DiceKriging test suite (Roustant, Ginsbourger, Deville 2012).

Branin on a 4 x 4 grid, Matern 5/2, full likelihood, range = theta^(-1/2) at most 2. That package's Branin has
5 / (4 pi^2), where the usual one has 5.1 / (4 pi^2).
"""

import numpy as np
import pytest

from tests.plain_kriging import plain

PRINTED = 1e-5  # seven digits are printed; the constant case has a flat optimum
GRID = np.linspace(0, 1, 4)
X = np.array([(a, b) for b in GRID for a in GRID])


def branin(x):
    a, b = 15 * x[:, 0] - 5, 15 * x[:, 1]
    return (
        (b - 5 / (4 * np.pi**2) * a**2 + 5 / np.pi * a - 6) ** 2 + 10 * (1 - 1 / (8 * np.pi)) * np.cos(a) + 10
    )


@pytest.mark.parametrize(
    ("trend", "ranges", "sigma2", "beta"),
    [
        ("constant", (0.8254355, 2.0), 145556.6, [306.5783]),
        ("interactions", (0.7917705, 2.0), 87350.78, [579.5111, -402.8916, -362.0008, 431.2314]),
    ],
)
def test_branin_on_a_grid(trend, ranges, sigma2, beta):
    kriging = plain(
        criterion="ml", trend=trend, correlation="matern52", nugget=0.0, theta_bounds=(0.25, 1e6)
    ).fit(X, branin(X))
    assert kriging.theta_**-0.5 == pytest.approx(ranges, rel=PRINTED)
    assert kriging.sigma2_ == pytest.approx(sigma2, rel=PRINTED)
    assert kriging.beta_ == pytest.approx(beta, rel=PRINTED)
    assert kriging.diagnosis_.at_lower_bound == (1,)
