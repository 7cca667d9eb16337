"""Other ways to rank the inputs of given runs, side by side with the likelihood.

    linear      sparse linear regression, LARS with cross-validation                  Efron et al. 2004
    quadratic   the same over all linear, square and product terms
    forest      permutation importance of a random forest                             Breiman 2001
    sobol       total Sobol' indices of a Kriging with one theta per input

A user will ask for them, so they are one call away and run on the same data. Scores of different methods
are not comparable; rankings are.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.ensemble import RandomForestRegressor
from sklearn.inspection import permutation_importance
from sklearn.linear_model import LassoLarsCV
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from .kriging import Kriging
from .screening import KrigingScreener
from .sobol import sobol_indices

__all__ = ["RIVALS", "Ranking", "compare_rankings"]

Array = NDArray[np.float64]

TREES = 200
MOST_QUADRATIC_TERMS = 6000


@dataclass(frozen=True, slots=True, kw_only=True)
class Ranking:
    """One method's view.

    Attributes:
        method: its name.   ranking: (d,) inputs, most important first.   score: (d,) what it ranked by.
        selected: what the method itself would keep; None where it has no rule.
        cpu_seconds: what it took.
    """

    method: str
    ranking: NDArray[np.intp]
    score: Array
    selected: tuple[int, ...] | None
    cpu_seconds: float


def _lars(x: Array, y: Array, owners: list[tuple[int, ...]], d: int) -> tuple[Array, tuple[int, ...]]:
    """Each input's largest standardised coefficient over the terms that it is part of."""
    folds = min(5, len(y))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # LARS drops degenerate regressors one warning at a time
        fit = LassoLarsCV(cv=folds).fit(StandardScaler().fit_transform(x), y)
    score = np.zeros(d)
    for coefficient, inputs in zip(np.abs(fit.coef_), owners, strict=True):
        for k in inputs:
            score[k] = max(score[k], coefficient)
    return score, tuple(int(k) for k in np.flatnonzero(score))


def _linear(x: Array, y: Array, rng: np.random.Generator) -> tuple[Array, tuple[int, ...] | None]:
    d = x.shape[1]
    return _lars(x, y, [(k,) for k in range(d)], d)


def _quadratic(x: Array, y: Array, rng: np.random.Generator) -> tuple[Array, tuple[int, ...] | None]:
    d = x.shape[1]
    if d * (d + 3) // 2 > MOST_QUADRATIC_TERMS:
        raise ValueError(f"method 'quadratic' takes at most 108 inputs, got {d}")
    terms = PolynomialFeatures(2, include_bias=False)
    z = terms.fit_transform(x - x.mean(axis=0))
    owners = [tuple(int(k) for k in np.flatnonzero(p)) for p in terms.powers_]
    return _lars(z, y, owners, d)


def _forest(x: Array, y: Array, rng: np.random.Generator) -> tuple[Array, tuple[int, ...] | None]:
    seed = int(rng.integers(2**31))
    forest = RandomForestRegressor(TREES, random_state=seed).fit(x, y)
    found = permutation_importance(forest, x, y, n_repeats=5, random_state=seed)
    return np.asarray(found.importances_mean), None


def _sobol(x: Array, y: Array, rng: np.random.Generator) -> tuple[Array, tuple[int, ...] | None]:
    kriging = Kriging(correlation="gaussian", nugget="ladder").fit(x, y)
    return np.asarray(sobol_indices(kriging, draws=30, rng=rng).total.mean), None


def _likelihood(method: str) -> "Rival":
    def rank(x: Array, y: Array, rng: np.random.Generator) -> tuple[Array, tuple[int, ...] | None]:
        screener = KrigingScreener(method=method, seed=int(rng.integers(2**31))).fit(x, y)
        score = np.zeros(x.shape[1])
        score[screener.ranking_] = np.arange(x.shape[1], 0, -1)
        return score, tuple(int(k) for k in screener.selected_)

    return rank


Rival = Callable[[Array, Array, np.random.Generator], tuple[Array, tuple[int, ...] | None]]

RIVALS: dict[str, Rival] = {
    "default": _likelihood("default"),
    "forward": _likelihood("forward"),
    "linear": _linear,
    "quadratic": _quadratic,
    "forest": _forest,
    "sobol": _sobol,
}


def compare_rankings(
    X: ArrayLike,
    y: ArrayLike,
    *,
    methods: Sequence[str] = tuple(RIVALS),
    rng: np.random.Generator,
) -> list[Ranking]:
    """Rank the inputs of runs X (n, d), y (n,) by several methods.

    >>> rng = np.random.default_rng(0)
    >>> x = rng.random((40, 5))
    >>> for r in compare_rankings(x, 3 * x[:, 1] + x[:, 3], methods=["default", "linear"], rng=rng):
    ...     print(r.method, r.ranking[:2])
    default [1 3]
    linear [1 3]
    """
    unknown = [m for m in methods if m not in RIVALS]
    if unknown:
        raise ValueError(f"methods needs names out of {', '.join(RIVALS)}, got {unknown[0]!r}")
    x, y = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
    found = []
    for method in methods:
        start = process_time()
        score, selected = RIVALS[method](x, y, rng)
        found.append(
            Ranking(
                method=method,
                ranking=np.argsort(-score, kind="stable").astype(np.intp),
                score=score,
                selected=selected,
                cpu_seconds=process_time() - start,
            )
        )
    return found
