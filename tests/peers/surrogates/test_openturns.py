"""The best linear unbiased prediction against OpenTURNS at equal parameters."""

import numpy as np
import pytest

from surrogates import Kriging

pytestmark = pytest.mark.peer
ot = pytest.importorskip("openturns")

MEAN, VARIANCE = 1e-8, 1e-8  # absolute for responses of size 1; relative to sigma^2


@pytest.mark.parametrize("trend", ["constant", "linear", "quadratic"])
@pytest.mark.parametrize("kind", ["gaussian", "matern52"])
def test_mean_variance_and_sigma(trend, kind):
    rng = np.random.default_rng(0)
    x, new = rng.random((40, 2)), rng.random((30, 2))
    y = np.sin(5 * x[:, 0]) + x[:, 0] * x[:, 1] ** 2
    kriging = Kriging(
        trend=trend,
        correlation=kind,
        theta=[6.0, 3.0],
        nugget=0.0 if kind != "gaussian" else 1e-10,
        intervals="plug-in",
    )
    kriging.fit(x, y)
    scale = kriging.theta_**-0.5 * (2**-0.5 if kind == "gaussian" else 1.0)
    if kind == "gaussian":
        covariance = ot.SquaredExponential(list(scale), [1.0])
    else:
        covariance = ot.ProductCovarianceModel([ot.MaternModel([s], [1.0], 2.5) for s in scale])
    basis = {
        "constant": ot.ConstantBasisFactory,
        "linear": ot.LinearBasisFactory,
        "quadratic": ot.QuadraticBasisFactory,
    }[trend](2).build()
    if kind == "gaussian":
        covariance.setNuggetFactor(1e-10)
    fitter = ot.GaussianProcessFitter(ot.Sample(x), ot.Sample(y[:, None]), covariance, basis)
    fitter.setOptimizeParameters(False)
    fitter.run()
    regression = ot.GaussianProcessRegression(fitter.getResult())
    regression.run()
    result = regression.getResult()
    theirs = np.array(result.getMetaModel()(ot.Sample(new)))[:, 0]
    mean, std = kriging.predict(new, return_std=True)
    assert mean == pytest.approx(theirs, abs=MEAN)
    conditional = ot.GaussianProcessConditionalCovariance(result)
    variance = np.array(conditional.getConditionalMarginalVariance(ot.Sample(new))).ravel()
    amplitude2 = result.getCovarianceModel().getAmplitude()[0] ** 2
    print(
        trend,
        kind,
        np.abs(mean - theirs).max(),
        np.abs(std**2 / kriging.sigma2_ - variance / amplitude2).max(),
    )
    assert std**2 / kriging.sigma2_ == pytest.approx(variance / amplitude2, abs=VARIANCE)
