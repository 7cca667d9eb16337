"""Which trend: the one whose leave-one-out predictions score best.

Restricted likelihoods of different trends are densities of different contrasts and must not be compared; the
leave-one-out log density is a score of predictions, comparable, and punishes a trend too large for the runs.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from ..errors import TooFewRuns
from .estimator import Kriging

PLAIN = Kriging(correlation="gaussian", intervals="plug-in")

__all__ = ["TrendChoice", "TrendScore", "choose_trend"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrendScore:
    """One candidate: trend, number of terms, leave-one-out mean log density and Q2, restricted likelihood."""

    trend: str
    n_terms: int
    log_score: float
    q2: float
    log_likelihood: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TrendChoice:
    """The best trend, its fitted model, the scores of all candidates, and those with too few runs."""

    trend: str
    kriging: Kriging
    scores: tuple[TrendScore, ...]
    skipped: tuple[str, ...]


def choose_trend(
    X: ArrayLike,
    y: ArrayLike,
    *,
    trends: Sequence[str] = ("constant", "linear", "quadratic"),
    kriging: Kriging | None = None,
    by: str = "log_score",
    run_ids: Sequence[Hashable] | None = None,
) -> TrendChoice:
    """Fit `kriging` with each trend and keep the best by "log_score" or "q2".

    Without one it is Gaussian, with plug-in intervals. A larger trend must beat a smaller one by more than
    0.01. Trends with too few runs are skipped.

    >>> x = np.random.default_rng(0).random((30, 2))
    >>> y = 4 * x[:, 0] + 0.2 * np.sin(9 * x[:, 1])
    >>> choice = choose_trend(x, y)
    >>> print(choice.trend, choice.skipped, len(choice.scores))
    linear () 3
    """
    if by not in ("log_score", "q2"):
        raise ValueError(f"by needs 'log_score' or 'q2', got {by!r}")
    if not trends:
        raise ValueError("trends needs at least one trend, got none")
    scores, skipped = [], []
    best: tuple[float, Kriging] | None = None
    refusal: TooFewRuns | None = None
    for trend in trends:
        model = clone(PLAIN if kriging is None else kriging).set_params(trend=trend)
        try:
            model.fit(X, y, run_ids=run_ids)
        except TooFewRuns as error:
            skipped.append(trend)
            refusal = error
            continue
        loo = model.leave_one_out()
        scores.append(
            TrendScore(
                trend=trend,
                n_terms=len(model.beta_),
                log_score=loo.log_score,
                q2=loo.q2,
                log_likelihood=model.log_likelihood_,
            )
        )
        score = loo.log_score if by == "log_score" else loo.q2
        if model.diagnosis_.degenerate:
            score = np.inf  # nothing can predict better than a trend that is exact
        if best is None or score > best[0] + 0.01 or (np.isnan(best[0]) and not np.isnan(score)):
            best = score, model
    if best is None:
        assert refusal is not None
        raise refusal
    return TrendChoice(
        trend=str(best[1].trend), kriging=best[1], scores=tuple(scores), skipped=tuple(skipped)
    )
