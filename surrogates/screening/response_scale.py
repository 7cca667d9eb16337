"""The scale on which a response is screened: its own, its logarithm, a power of it, or its ranks.

A response over two decades is a few large values and noise to a Kriging, and its logarithm may be smooth;
one that jumps has ranks (Iman and Conover, Technometrics 21, 1979). What a scale is worth is judged on the
response's own one: left-out runs are predicted on it, carried back, and compared with what was run. The maps
stand in `surrogates.analysis.response_map`.

What stands apart from a list of drivers does so for its share of the response's variance, too, but by ranks
(`response_shares`): a logarithm folds large values away, and of a response over three decades an input with
4 % of the variance may have 0.7 % of that of the logarithm.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..analysis.response_map import RESPONSE_SCALES, admitted_scales, response_map
from .confirmation import SMOOTH
from .hidden_share import HiddenShare, hidden_share
from .listed_apart import DRAWS, LEAST_THETA, MOST_RUNS, SelectedShare, shares_of_units
from .metamodel import selected_kriging
from .partitions.anova import AnovaOptimum
from .partitions.anova_shares import as_product, drawn_total_indices
from .partitions.canonical import CanonicalRuns
from .screener import KrigingScreener

__all__ = [
    "RESPONSE_SCALES",
    "ScaleChoice",
    "choose_scale",
    "judged_on_response",
    "left_out_share",
    "on_scale",
    "response_shares",
]

Array = NDArray[np.float64]

NOTHING_TO_GAIN = 0.001  # of the variance: a response that leaves less needs no other scale
CLEARLY = 0.8  # of the squared error of a simpler scale: what another must stay below
POWERS = ("box-cox", "yeo-johnson")
NEAR = 0.1  # of a power: no other scale than the logarithm (0) or the response itself (1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleChoice:
    """The scale chosen, and what each leaves unexplained of left-out runs, a share of the variance of y."""

    scale: str
    unexplained: dict[str, float]

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        if list(self.unexplained) == ["none"]:
            share = self.unexplained["none"]
            return f"the response itself leaves {100 * share:.3g} % of left-out runs unexplained"
        shares = ", ".join(f"{name} {100 * share:.3g} %" for name, share in self.unexplained.items())
        return f"left unexplained of left-out runs, on the response's own scale: {shares}"


def on_scale(y: ArrayLike, scale: str) -> Array:
    """The responses y (n,) on one of RESPONSE_SCALES.

    >>> on_scale([1.0, 8.0, 4.0], "ranks").tolist()
    [1.0, 3.0, 2.0]

    Raises ValueError: another scale, or the logarithm or "box-cox" of a response that is not positive.
    """
    return response_map(y, scale).forward(y)


def choose_scale(screener: KrigingScreener, X: ArrayLike, y: ArrayLike) -> ScaleChoice:
    """Screen runs X (n, d), y (n,) on every scale that y admits, by clones of `screener`, and compare.

    The response itself unless another scale leaves less than 0.8 of its squared error; a power (Box-Cox, of
    responses that change sign Yeo-Johnson) where it leaves less than 0.8 of that of all others. No
    other is tried where the response itself leaves less than a thousandth.

    >>> x = np.random.default_rng(0).random((40, 4))
    >>> choose_scale(KrigingScreener(), x, np.exp(6 * x[:, 1] + 3 * np.sin(5 * x[:, 2]))).scale
    'log'
    """
    from sklearn.base import clone

    values = np.asarray(y, dtype=np.float64)
    unexplained: dict[str, float] = {}
    for scale in _candidates(values):
        fitted = clone(screener).fit(X, on_scale(values, scale))
        unexplained[scale] = left_out_share(fitted, X, values, scale).unexplained
        if unexplained["none"] < NOTHING_TO_GAIN:
            break
    simple = [scale for scale in unexplained if scale not in POWERS]
    best = min(simple, key=lambda scale: unexplained[scale])
    if not unexplained[best] < CLEARLY * unexplained["none"]:
        best = "none"
    for power in [scale for scale in unexplained if scale in POWERS]:
        if unexplained[power] < CLEARLY * min(unexplained[scale] for scale in simple):
            best = power
    return ScaleChoice(scale=best, unexplained=unexplained)


def left_out_share(fitted: KrigingScreener, X: ArrayLike, y: ArrayLike, scale: str) -> HiddenShare:
    """What the inputs selected on `scale` leave unexplained of left-out runs, on the own scale of y (n,).

    `fitted` is a screening of X (n, d) and `on_scale(y, scale)`. The share in its diagnosis is one of the
    scale screened on: a large value that a logarithm folds away counts there as little as a small one.
    """
    values = np.asarray(y, dtype=np.float64)
    if not len(fitted.selected_):
        return HiddenShare(unexplained=1.0, upper=1.0)
    mapped = response_map(values, scale)
    model = selected_kriging(fitted, X, mapped.forward(values), minor=True, calibrated=False)
    left = model.leave_one_out()
    error = values - mapped.inverse(left.prediction)
    return hidden_share(np.where(np.isfinite(left.std), error, np.nan), values)


def judged_on_response(fitted: KrigingScreener, X: ArrayLike, y: ArrayLike, scale: str) -> KrigingScreener:
    """Judge a screening of X (n, d) and `on_scale(y, scale)` by the response's own variance; returns it.

    What left-out runs leave unexplained may hide further inputs, and what has less than 1 % stands apart.
    Ranks keep the shares of their own variance, and the verdict says so: carried back, the bands of shares
    hold too few of the true ones.

    >>> x = np.random.default_rng(2).random((40, 4))
    >>> y = np.exp(6 * x[:, 1] + 0.8 * x[:, 2] * x[:, 1])
    >>> judged_on_response(KrigingScreener().fit(x, on_scale(y, "log")), x, y, "log").selected_
    array([1, 2])
    """
    if scale == "none":
        return fitted
    if scale == "ranks":
        return fitted.by_ranks(left_out_share(fitted, X, y, scale))
    fitted.allow_for(left_out_share(fitted, X, y, scale))
    return fitted.weigh(response_shares(fitted, X, y, scale))


def response_shares(
    fitted: KrigingScreener, X: ArrayLike, y: ArrayLike, scale: str
) -> tuple[SelectedShare, ...]:
    """Total indices of y of the inputs that `fitted`, of X (n, d) and `on_scale(y, scale)`, selects.

    Those that it lists apart are among them. Paths of the Kriging on the scale are drawn and carried back.

    >>> x = np.random.default_rng(2).random((40, 4))
    >>> y = np.exp(6 * x[:, 1] + 0.8 * x[:, 2] * x[:, 1])
    >>> found = response_shares(KrigingScreener().fit(x, on_scale(y, "log")), x, y, "log")
    >>> [share.column for share in found], bool(found[0].mean > 0.9)
    ([1, 2], True)
    """
    runs = fitted._runs
    if runs is None or not fitted.diagnosis_.shares:
        return ()
    values = np.asarray(y, dtype=np.float64)
    mapped = response_map(values, scale)
    # canonical responses ascend, or descend where they were turned round: the ends say how
    low, high = mapped.forward(values[runs.rows[[0, -1]]])
    slope = (high - low) / (runs.y[-1] - runs.y[0])
    first = runs.y[0]
    at = fitted._anova or _product(fitted, runs)
    drawn = drawn_total_indices(
        _few(runs, fitted.seed),
        at,
        eta=SMOOTH if fitted._anova is not None else fitted.eta_,
        given=fitted.columns(X, range(fitted.n_features_in_)),
        measures=fitted.measures,
        draws=DRAWS,
        rng=np.random.default_rng(fitted.seed),
        back=lambda paths: mapped.inverse(low + slope * (paths - first)),
    )
    return shares_of_units(runs, at.units, drawn)


def _product(fitted: KrigingScreener, runs: CanonicalRuns) -> AnovaOptimum:
    """The correlation of the selected set, with thetas of canonical columns."""
    kept = {*fitted.selected_.tolist(), *fitted.minor_.tolist()}
    units = [u for u in range(len(runs.units)) if kept & set(runs.given(u))]
    leading = [runs.units[u][0] for u in units]
    theta = fitted.theta_[runs.columns[leading]] * runs.span[leading] ** fitted.eta_
    return as_product(units, np.log(np.maximum(theta, LEAST_THETA)), fitted.nugget_)


def _few(runs: CanonicalRuns, seed: int) -> CanonicalRuns:
    """No more runs than a share of the variance needs."""
    if len(runs.y) <= MOST_RUNS:
        return runs
    some = np.sort(np.random.default_rng(seed).permutation(len(runs.y))[:MOST_RUNS])
    return replace(runs, x=runs.x[some], y=runs.y[some], rows=runs.rows[some])


def _candidates(y: Array) -> list[str]:
    """The scales worth a screening: one power at most, and none that is all but the logarithm or y itself."""
    found = []
    admitted = admitted_scales(y)
    for scale in admitted:
        if scale == "yeo-johnson" and "box-cox" in admitted:
            continue
        if scale in POWERS:
            power = response_map(y, scale).power
            if min(abs(power - 1.0), abs(power) if scale == "box-cox" else np.inf) < NEAR:
                continue
        found.append(scale)
    return found
