"""A Kriging on the scale that predicts best, with mean, deviation and intervals on the user's scale.

    w = T(y),   w(x) ~ N(m(x), s(x)^2)
    mean and deviation of T^-1(w) by Gauss-Hermite quadrature,   interval [T^-1(m - z s), T^-1(m + z s)]

An interval is carried back exactly, since T is monotone; it is not symmetric about the mean.
"""

from collections.abc import Hashable, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import norm
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from ..kriging.estimator import Kriging
from .response_map import RESPONSE_SCALES, ResponseMap, admitted_scales, response_map

__all__ = ["ScaledKriging"]

Array = NDArray[np.float64]

CLEARLY = 0.8  # of the squared error of the response itself: what another scale must stay below
SMOOTH_SCALES = ("none", "log", "box-cox", "yeo-johnson")  # ranks predict nothing beyond the runs
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(24)


class ScaledKriging(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Kriging of a mapped response.

    Args:
        scale: one of RESPONSE_SCALES, or "auto": the response itself, its logarithm or a power (Box-Cox where
            it is positive, else Yeo-Johnson) by the squared error of left-out runs on the response's own
            scale, of which another one must leave less than 0.8.
        kriging: the model of the mapped response; None is `Kriging()`.

    Attributes:
        map_: a `ResponseMap`.   kriging_: the fitted model of the mapped response.
        unexplained_: scale -> squared error of left-out runs over the variance of y; {} for a named one.
        q2_: 1 - that of the scale taken.

    >>> x = np.random.default_rng(0).random((30, 2))
    >>> model = ScaledKriging().fit(x, np.exp(6 * x[:, 0] + np.sin(5 * x[:, 1])))
    >>> lower, upper = model.predict_interval([[0.5, 0.5]])
    >>> print(model.map_.scale, bool(lower[0] < np.exp(3 + np.sin(2.5)) < upper[0]))
    log True
    """

    map_: ResponseMap
    kriging_: Kriging
    unexplained_: dict[str, float]
    q2_: float

    def __init__(self, *, scale: str = "auto", kriging: Kriging | None = None) -> None:
        self.scale = scale
        self.kriging = kriging

    def fit(self, X: ArrayLike, y: ArrayLike, *, run_ids: Sequence[Hashable] | None = None) -> Self:
        """Choose the scale, and fit to runs X (n, d), y (n,).

        Raises ValueError: an unknown scale, one that y does not admit, or what `Kriging.fit` refuses.
        """
        if self.scale not in ("auto", *RESPONSE_SCALES):
            raise ValueError(f"scale needs one of auto, {', '.join(RESPONSE_SCALES)}, got {self.scale!r}")
        self.unexplained_ = {}
        if self.scale != "auto":
            self.map_, self.kriging_ = self._fitted(X, y, self.scale, run_ids)
        else:
            plain = self._fitted(X, y, "none", run_ids)
            found = {"none": plain}
            # what the plain fit has checked may be mapped
            values = np.asarray(y, dtype=np.float64).ravel()
            for scale in _other_scales(values):
                found[scale] = self._fitted(X, values, scale, run_ids)
            self.unexplained_ = {scale: _unexplained(*each) for scale, each in found.items()}
            best = min(found, key=lambda scale: self.unexplained_[scale])
            clearly = self.unexplained_[best] < CLEARLY * self.unexplained_["none"]
            self.map_, self.kriging_ = found[best if clearly else "none"]
        self.q2_ = 1.0 - _unexplained(self.map_, self.kriging_)
        self.n_features_in_ = self.kriging_.n_features_in_
        if hasattr(self.kriging_, "feature_names_in_"):
            self.feature_names_in_ = self.kriging_.feature_names_in_
        return self

    def _fitted(
        self, X: ArrayLike, y: ArrayLike, scale: str, run_ids: Sequence[Hashable] | None
    ) -> tuple[ResponseMap, Kriging]:
        model = Kriging() if self.kriging is None else clone(self.kriging)
        if scale == "none":
            model.fit(X, y, run_ids=run_ids)
            return response_map(model.leave_one_out().observed, scale), model
        mapped = response_map(y, scale)
        return mapped, model.fit(X, mapped.forward(y), run_ids=run_ids)

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Mean (m,) of the response at X (m, d), with `return_std` also its deviation (m,)."""
        check_is_fitted(self, "kriging_")
        if self.map_.scale == "none":
            return self.kriging_.predict(X, return_std=return_std)
        mean, std = self.kriging_.predict(X, return_std=True)
        weights = WEIGHTS / WEIGHTS.sum()
        values = self.map_.inverse(mean[:, None] + std[:, None] * NODES)
        first = values @ weights
        if not return_std:
            return first
        return first, np.sqrt(np.maximum((values - first[:, None]) ** 2 @ weights, 0.0))

    def predict_interval(self, X: ArrayLike, level: float = 0.95) -> tuple[Array, Array]:
        """Lower and upper end (m,) of the interval that holds a share `level` of new runs at X (m, d)."""
        check_is_fitted(self, "kriging_")
        if not 0.0 < level < 1.0:
            raise ValueError(f"level needs a share between 0 and 1, got {level}")
        mean, std = self.kriging_.predict(X, return_std=True)
        reach = float(norm.ppf(0.5 + 0.5 * level)) * std
        return self.map_.inverse(mean - reach), self.map_.inverse(mean + reach)


def _other_scales(y: Array) -> list[str]:
    """Scales beside the response itself that are worth a fit."""
    if np.ptp(y) == 0.0:
        return []
    admitted = [scale for scale in admitted_scales(y) if scale in SMOOTH_SCALES[1:]]
    return [scale for scale in admitted if scale != "yeo-johnson" or "box-cox" not in admitted]


def _unexplained(mapped: ResponseMap, kriging: Kriging) -> float:
    left = kriging.leave_one_out()
    usable = np.isfinite(left.std)
    q2 = mapped.q2(left.observed[usable], left.prediction[usable]) if usable.any() else 0.0
    return 1.0 - q2 if np.isfinite(q2) else 1.0
