"""SMT's likelihood at a given theta is ours: what its search reaches may be compared with what ours does."""

import numpy as np
import pytest

from surrogates.likelihood.correlation import Correlation
from surrogates.likelihood.likelihood import Likelihood

pytestmark = pytest.mark.peer
models = pytest.importorskip("smt.surrogate_models")

SAME = 1e-6  # SMT adds a nugget of 100 rounding errors, which log|R| shows


@pytest.mark.filterwarnings("ignore")
def test_likelihoods_agree_at_a_given_theta():
    """SMT scales inputs and response by their standard deviations (n - 1) and reports
    -(n log10 s2 + log10 |R|) of the full likelihood."""
    rng = np.random.default_rng(0)
    x = rng.random((30, 4)) * np.array([1.0, 5.0, 0.1, 2.0])
    y = np.sin(3 * x[:, 0]) + x[:, 1]
    model = models.KRG(theta0=[1e-2] * 4, print_global=False)
    model.set_training_values(x, y)
    model.train()
    for theta in ([0.3, 0.02, 0.01, 0.5], [1.0, 2.0, 0.5, 0.1]):
        reported = float(np.ravel(model._reduced_likelihood_function(np.array(theta))[0])[0])
        ours = Likelihood(
            x=x,
            f=np.ones((30, 1)),
            y=y[:, None],
            correlation=Correlation(),
            groups=np.arange(4),
            restricted=False,
            nugget=float(model.options["nugget"]),
        ).value(np.log(np.array(theta) / np.ravel(model.X_scale) ** 2))
        ours += 0.5 * 30 + 30 * float(np.log(np.ravel(model.y_std)[0]))
        assert reported * np.log(10) / 2 == pytest.approx(ours, abs=SAME)
