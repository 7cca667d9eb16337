"""Other ways to rank the inputs of given runs, side by side with the likelihood.

    linear      sparse linear regression, LARS with cross-validation                  Efron et al. 2004
    quadratic   the same over all linear, square and product terms
    forest      permutation importance of a random forest                             Breiman 2001
    sobol       total Sobol' indices of a Kriging with one theta per input
    welch       the screening of sets.welch                                           Welch et al. 1992

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
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, PolynomialFeatures, StandardScaler

from ..analysis.sobol import sobol_indices
from ..errors import TooFewRuns
from ..kriging.diagnosis import varying
from ..kriging.estimator import Kriging
from ..kriging.given_runs import (
    LabelCodes,
    check_finite,
    check_response,
    refuse_text,
)
from .screener import KrigingScreener

__all__ = ["RIVALS", "Ranking", "compare_rankings"]

Array = NDArray[np.float64]

TREES = 200
MOST_QUADRATIC_TERMS = 6000
MOST_WELCH_RUNS = 300
FEWEST_RUNS = 5


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


def _columns(x: Array, labels: tuple[int, ...]) -> tuple[Array, list[tuple[int, ...]]]:
    """A column per number and per label, 1 where a run has it; the input of each column.

    Labels have no order that a regression or a tree could use.
    """
    parts: list[Array] = []
    owners: list[tuple[int, ...]] = []
    for k in range(x.shape[1]):
        found = np.unique(x[:, k]) if k in labels else None
        # of two labels one column tells both
        part = x[:, [k]] if found is None else (x[:, [k]] == found[len(found) == 2 :]).astype(float)
        parts.append(part)
        owners += [(k,)] * part.shape[1]
    return np.hstack(parts), owners


def _lars(x: Array, y: Array, owners: list[tuple[int, ...]], d: int) -> tuple[Array, tuple[int, ...]]:
    """Each input's largest standardised coefficient over the terms that it is part of."""
    if not varying(x).any():
        return np.zeros(d), ()
    folds = min(5, len(y))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # LARS drops degenerate regressors one warning at a time
        fit = LassoLarsCV(cv=folds).fit(StandardScaler().fit_transform(x), y)
    score = np.zeros(d)
    for coefficient, inputs in zip(np.abs(fit.coef_), owners, strict=True):
        for k in inputs:
            score[k] = max(score[k], coefficient)
    return score, tuple(int(k) for k in np.flatnonzero(score))


def _linear(x: Array, y: Array, labels: tuple[int, ...], rng: np.random.Generator) -> "Scores":
    columns, owners = _columns(x, labels)
    return _lars(columns, y, owners, x.shape[1])


def _quadratic(x: Array, y: Array, labels: tuple[int, ...], rng: np.random.Generator) -> "Scores":
    columns, owners = _columns(x, labels)
    terms = PolynomialFeatures(2, include_bias=False)
    z = terms.fit_transform(columns - columns.mean(axis=0))
    inputs = [tuple(sorted({owners[int(c)][0] for c in np.flatnonzero(p)})) for p in terms.powers_]
    return _lars(z, y, inputs, x.shape[1])


def _forest(x: Array, y: Array, labels: tuple[int, ...], rng: np.random.Generator) -> "Scores":
    seed = int(rng.integers(2**31))
    trees = RandomForestRegressor(TREES, random_state=seed)
    # permuting a label moves all of its columns
    forest = make_pipeline(FunctionTransformer(lambda given: _columns(given, labels)[0]), trees).fit(x, y)
    found = permutation_importance(forest, x, y, n_repeats=5, random_state=seed)
    return np.asarray(found.importances_mean), None


def _sobol(x: Array, y: Array, labels: tuple[int, ...], rng: np.random.Generator) -> "Scores":
    kriging = Kriging(
        correlation="gaussian",
        trend="constant",
        nugget="ladder",
        categorical=labels or None,
        intervals="plug-in",
    ).fit(x, y)
    return np.asarray(sobol_indices(kriging, draws=30, thetas=0, rng=rng).total.mean), None


def _likelihood(method: str) -> "Rival":
    def rank(x: Array, y: Array, labels: tuple[int, ...], rng: np.random.Generator) -> "Scores":
        screener = KrigingScreener(method=method, categorical=labels, seed=int(rng.integers(2**31)))
        screener.fit(x, y)
        score = np.zeros(x.shape[1])
        score[screener.ranking_] = np.arange(x.shape[1], 0, -1)
        return score, tuple(int(k) for k in screener.selected_)

    return rank


Scores = tuple[Array, tuple[int, ...] | None]
Rival = Callable[[Array, Array, tuple[int, ...], np.random.Generator], Scores]

RIVALS: dict[str, Rival] = {
    "default": _likelihood("default"),
    "forward": _likelihood("forward"),
    "linear": _linear,
    "quadratic": _quadratic,
    "forest": _forest,
    "sobol": _sobol,
    "welch": _likelihood("welch"),
}


def _quadratic_terms(x: Array, labels: tuple[int, ...]) -> int:
    p = _columns(x, labels)[0].shape[1]
    return p * (p + 3) // 2


def _in_reach(x: Array, labels: tuple[int, ...]) -> tuple[str, ...]:
    """The methods that take these runs in seconds."""
    dear = {
        "quadratic": _quadratic_terms(x, labels) > MOST_QUADRATIC_TERMS,
        "welch": len(x) > MOST_WELCH_RUNS,
    }
    return tuple(m for m in RIVALS if not dear.get(m, False))


def compare_rankings(
    X: ArrayLike,
    y: ArrayLike,
    *,
    methods: Sequence[str] | None = None,
    categorical: Sequence[int] = (),
    rng: np.random.Generator,
) -> list[Ranking]:
    """Rank the inputs of runs X (n, d), y (n,) by several methods.

    >>> rng = np.random.default_rng(0)
    >>> x = rng.random((40, 5))
    >>> for r in compare_rankings(x, 3 * x[:, 1] + x[:, 3], methods=["default", "linear"], rng=rng):
    ...     print(r.method, r.ranking[:2])
    default [1 3]
    linear [1 3]

    Args:
        methods: names out of RIVALS. None takes all, but "quadratic" where it has more than 6000 terms and
            "welch" above 300 runs, which would take minutes. Elementary effects and the hybrid of them and
            the likelihood need runs on trajectories: see `morris_points` and `hybrid_screening`.
        categorical: columns that hold labels (numbers or strings), which no method takes as ordered.

    Raises:
        TooFewRuns: fewer than five runs.
        ValueError: an unknown method, or text, NaN or infinity in a run, which is named; a response that is
            the same in all runs.
    """
    unknown = [m for m in methods or () if m not in RIVALS]
    if unknown:
        raise ValueError(f"methods needs names out of {', '.join(RIVALS)}, got {unknown[0]!r}")
    x, target, labels = _checked(X, y, categorical)
    chosen = _in_reach(x, labels) if methods is None else methods
    if "quadratic" in chosen and _quadratic_terms(x, labels) > MOST_QUADRATIC_TERMS:
        raise ValueError(
            f"method 'quadratic' takes at most 108 inputs, got {_columns(x, labels)[0].shape[1]}"
        )
    found = []
    for method in chosen:
        start = process_time()
        score, selected = RIVALS[method](x, target, labels, rng)
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


def _checked(X: ArrayLike, y: ArrayLike, categorical: Sequence[int]) -> tuple[Array, Array, tuple[int, ...]]:
    """X with codes for labels, y, and the label columns."""
    if len(categorical):
        X = LabelCodes(categorical, X)(X)
    else:
        refuse_text(X)
    check_response(y)
    x, target = np.asarray(X, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] == 0 or target.shape != x.shape[:1]:
        raise ValueError(f"rankings need X (n, d) and y (n,), got shapes {x.shape} and {target.shape}")
    if len(x) < FEWEST_RUNS:
        raise TooFewRuns(f"rankings need at least {FEWEST_RUNS} runs, got {len(x)}: add runs")
    check_finite(x, target, range(len(x)))
    if not varying(target[:, None])[0]:
        raise ValueError(
            f"y is {target[0]:g} in all {len(target)} runs, so there is nothing to rank: check the response, "
            "or widen the bounds"
        )
    return x, target, tuple(sorted({int(k) % x.shape[1] for k in categorical}))
