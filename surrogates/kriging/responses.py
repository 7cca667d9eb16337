"""Several responses of the same runs, with one theta for all of them.

The responses are independent processes with a common correlation, each with its own sigma^2 and trend
coefficients; their log-likelihoods are added, and one factor of the correlation matrix serves all. Worth
having when the responses are alike (a force at many times, a displacement at many points); else fit each
alone.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from .estimation import Estimate
from .estimator import Kriging
from .form_choice import AUTO

__all__ = ["SharedKriging"]

Array = NDArray[np.float64]


class SharedKriging(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Kriging of several responses with one theta, eta and nugget.

    Args:
        kriging: the model of every response, with plug-in intervals. Where its correlation and trend are
            "auto" they are Gaussian and constant. None is such a model.

    Attributes:
        krigings_: one fitted `Kriging` per response, sharing one factor.
        theta_: (d,) common.   log_likelihood_: sum over the responses.

    >>> x = np.random.default_rng(0).random((20, 2))
    >>> y = np.column_stack([np.sin(3 * x[:, 0]), 2 + np.sin(3 * x[:, 0] + x[:, 1])])
    >>> mean, std = SharedKriging().fit(x, y).predict(x[:4], return_std=True)
    >>> print(mean.shape, bool(np.allclose(mean, y[:4], atol=1e-4)))
    (4, 2) True
    """

    def __init__(self, kriging: Kriging | None = None) -> None:
        self.kriging = kriging

    def fit(self, X: ArrayLike, y: ArrayLike, *, run_ids: Sequence[Hashable] | None = None) -> Self:
        """Estimate from runs X (n, d) and responses y (n, q).

        Constant responses take no part in the search.

        Raises ValueError: a calibrated model, or responses of another shape.
        """
        targets = np.asarray(y, dtype=np.float64)
        if targets.ndim == 1:
            targets = targets[:, None]
        if targets.ndim != 2 or targets.shape[1] == 0:
            raise ValueError(f"y needs shape (n,) or (n, q) with q >= 1, got {np.shape(y)}")
        model = Kriging(intervals="plug-in") if self.kriging is None else clone(self.kriging)
        if model.intervals != "plug-in":
            raise ValueError(
                f"responses that share theta have plug-in intervals, got intervals={model.intervals!r}: "
                "name intervals='plug-in', or fit a Kriging for each response to have them calibrated"
            )
        if model.correlation == AUTO:
            model.set_params(correlation="gaussian")
        if model.trend == AUTO:
            model.set_params(trend="constant")
        krigings = [clone(model) for _ in range(targets.shape[1])]
        runs = [k._prepared(X, target, run_ids) for k, target in zip(krigings, targets.T, strict=True)]
        own = [k._likelihood(r, None) for k, r in zip(krigings, runs, strict=True)]
        live = [i for i, r in enumerate(runs) if not r.degenerate] or [0]
        # one response with noisy replicates is enough to free the nugget of all
        nugget = None if any(own[i].nugget is None for i in live) else own[live[0]].nugget
        z = np.concatenate([runs[i].z for i in live], axis=1)
        joint = replace(own[live[0]], y=z, nugget=nugget)
        found = krigings[live[0]]._estimated(runs[live[0]], joint)
        everything = replace(found.likelihood, y=np.concatenate([r.z for r in runs], axis=1))
        factor = everything.factor(found.parameters)
        for i, kriging in enumerate(krigings):
            single = Estimate(
                parameters=found.parameters,
                likelihood=replace(found.likelihood, y=runs[i].z),
                search=found.search,
            )
            part = None
            if factor is not None:
                part = replace(
                    factor,
                    residual=factor.residual[:, [i]],
                    weights=factor.weights[:, [i]],
                    quadratic=factor.quadratic[[i]],
                )
            kriging._finish(runs[i], single, part)
        self.krigings_ = tuple(krigings)
        self.theta_ = krigings[0].theta_
        self.log_likelihood_ = float(sum(k.log_likelihood_ for k in krigings))
        self.n_features_in_ = krigings[0].n_features_in_
        self._flat = np.ndim(y) == 1
        return self

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Mean (m, q) at X (m, d), with `return_std` also std (m, q); (m,) after a fit to a single y (n,)."""
        check_is_fitted(self)
        if not return_std:
            mean = np.stack([k.predict(X) for k in self.krigings_], axis=1)
            return mean[:, 0] if self._flat else mean
        both = [k.predict(X, return_std=True) for k in self.krigings_]
        mean, std = (np.stack([b[i] for b in both], axis=1) for i in (0, 1))
        return (mean[:, 0], std[:, 0]) if self._flat else (mean, std)
