"""The scale on which a response is screened: its own, its logarithm, or its ranks.

A response over two decades is a few large values and noise to a Kriging, and its logarithm may be smooth;
one that jumps has ranks (Iman and Conover, Technometrics 21, 1979). What a scale is worth is judged on the
response's own one: left-out runs are predicted on it, carried back, and compared with what was run.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

from .metamodel import selected_kriging
from .screener import KrigingScreener

__all__ = ["RESPONSE_SCALES", "ScaleChoice", "choose_scale", "on_scale"]

Array = NDArray[np.float64]

RESPONSE_SCALES = ("none", "log", "ranks")
CLEARLY = 0.8  # of the squared error of the response itself: what another scale must stay below


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleChoice:
    """The scale chosen, and what each leaves unexplained of left-out runs, a share of the variance of y."""

    scale: str
    unexplained: dict[str, float]

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        shares = ", ".join(f"{name} {100 * share:.3g} %" for name, share in self.unexplained.items())
        return f"left unexplained of left-out runs, on the response's own scale: {shares}"


def on_scale(y: ArrayLike, scale: str) -> Array:
    """The responses y (n,) on one of RESPONSE_SCALES.

    >>> on_scale([1.0, 8.0, 4.0], "ranks").tolist()
    [1.0, 3.0, 2.0]

    Raises ValueError: another scale, or the logarithm of a response that is not positive.
    """
    values = np.asarray(y, dtype=np.float64)
    if scale not in RESPONSE_SCALES:
        raise ValueError(f"scale needs one of {', '.join(RESPONSE_SCALES)}, got {scale!r}")
    if scale == "none":
        return values
    if scale == "ranks":
        return np.asarray(rankdata(values))
    if not (values > 0.0).all():
        raise ValueError(
            f"the logarithm needs responses above 0, got {values.min():g}: take 'ranks', or shift y"
        )
    return np.log(values)


def _back(w: Array, y: Array, scale: str) -> Array:
    """Values of a scale as responses; beyond the runs a rank stays at the outermost one."""
    if scale == "log":
        return np.exp(np.minimum(w, np.log(y.max()) + 3.0))  # an error beyond is as bad as can be
    if scale == "ranks":
        return np.interp(w, np.arange(1.0, len(y) + 1.0), np.sort(y))
    return w


def choose_scale(screener: KrigingScreener, X: ArrayLike, y: ArrayLike) -> ScaleChoice:
    """Screen runs X (n, d), y (n,) on every scale that y admits, by clones of `screener`, and compare.

    The response itself unless another scale leaves less than 0.8 of its squared error.

    >>> x = np.random.default_rng(0).random((40, 4))
    >>> choose_scale(KrigingScreener(), x, np.exp(6 * x[:, 1] + 3 * np.sin(5 * x[:, 2]))).scale
    'log'
    """
    from sklearn.base import clone

    values = np.asarray(y, dtype=np.float64)
    spread = float(((values - values.mean()) ** 2).mean())
    unexplained: dict[str, float] = {}
    for scale in RESPONSE_SCALES:
        if scale == "log" and not (values > 0.0).all():
            continue
        w = on_scale(values, scale)
        fitted = clone(screener).fit(X, w)
        if spread <= 0.0 or not len(fitted.selected_):
            unexplained[scale] = 1.0
            continue
        left = selected_kriging(fitted, X, w).leave_one_out()
        usable = np.isfinite(left.std)
        error = values[usable] - _back(left.prediction[usable], values, scale)
        unexplained[scale] = float((error**2).mean()) / spread
    best = min(unexplained, key=lambda scale: unexplained[scale])
    plain = unexplained["none"]
    return ScaleChoice(scale=best if unexplained[best] < CLEARLY * plain else "none", unexplained=unexplained)
