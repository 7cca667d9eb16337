"""Which correlation and which trend: four candidates, within the cost of about one more fit.

    correlation   Gaussian where its likelihood leads those of Matern 5/2 and 7/2 by 1, else the likelier one
    trend         linear where its leave-one-out log density leads that of the constant by 0.3 per run, and
                  there are at least two runs per term, else constant

The likelihoods of correlations with one trend are densities of the same contrasts and may be compared; those
of two trends may not. A tie goes to Matern 5/2: it promises least, and its intervals hold most. Every
candidate but the first starts from the ranges of one before. Above 250 runs 150 of them choose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import NotPositiveDefinite, TooFewRuns
from ..likelihood.starts import canonical_rows
from .fitted import Fitted
from .fitting import MANY_RUNS, SUBSAMPLE
from .trend import TrendFunction
from .validation import left_out

__all__ = ["AUTO", "Chosen", "Form", "FormScore", "choose_form"]

Array = NDArray[np.float64]
Rows = slice | NDArray[np.intp]

AUTO = "auto"
SMOOTH_LEAD = 1.0  # log-likelihood by which the Gaussian correlation must lead the others
LINEAR_LEAD = 0.3  # leave-one-out log density per run by which the linear trend must lead
RUNS_PER_TERM = 2.0  # that a linear trend needs to be tried
MOST_STARTS, MATERN_STARTS, NEAR_STARTS, LINEAR_STARTS, FULL_STARTS = 20, 8, 2, 3, 4
BY_LIKELIHOOD = ("gaussian", "matern52", "matern72")


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """Correlation and trend by name, or a trend function."""

    correlation: str
    trend: str | TrendFunction


@dataclass(frozen=True, slots=True, kw_only=True)
class FormScore:
    """What one candidate scored: log-likelihood, leave-one-out mean log density and Q2."""

    correlation: str
    trend: str
    log_likelihood: float
    log_score: float
    q2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A form and the model fitted with it."""

    form: Form
    fitted: Fitted


class Attempt(Protocol):
    """A fit of one form to some of the runs, from given starts; may raise TooFewRuns, NotPositiveDefinite."""

    def __call__(
        self, form: Form, rows: Rows, *, theta_start: Array | None = None, n_starts: int | None = None
    ) -> Fitted:
        """The fitted model."""
        ...


def choose_form(
    wanted: Form, attempt: Attempt, x: Array, y: Array, *, theta_given: bool
) -> tuple[Chosen, tuple[FormScore, ...]]:
    """The best of the forms that `wanted` leaves open ("auto") for runs x (n, d), y (n,), and all scores.

    A named form is fitted as it is. `theta_given`: nothing can be compared, "auto" is Gaussian and constant.
    Raises what the last attempt raised when none is fitted.
    """
    everything: Rows = slice(None)
    correlations = BY_LIKELIHOOD if wanted.correlation == AUTO else (wanted.correlation,)
    trends = ("constant", "linear") if wanted.trend == AUTO else (wanted.trend,)
    if theta_given or len(correlations) == len(trends) == 1:
        form = Form(correlation=correlations[0], trend=trends[0])
        return Chosen(form=form, fitted=attempt(form, everything)), ()
    n, d = x.shape
    rows: Rows = everything
    if n > MANY_RUNS:
        picked = np.random.default_rng(0).permutation(n)[:SUBSAMPLE]
        # in an order of the values, so that another order of the rows gives the same runs
        rows = canonical_rows(x, y[:, None])[np.sort(picked)]
    tried = _tried(correlations, trends, attempt, rows, n if n <= MANY_RUNS else SUBSAMPLE, d)
    best = _best(tried)
    if n > MANY_RUNS:
        full = attempt(best.form, everything, theta_start=best.fitted.theta, n_starts=FULL_STARTS)
        best = Chosen(form=best.form, fitted=full)
    return best, tuple(_score(each) for each in tried)


def _tried(
    correlations: Sequence[str],
    trends: Sequence[str | TrendFunction],
    attempt: Attempt,
    rows: Rows,
    n: int,
    d: int,
) -> list[Chosen]:
    """The candidates that can be fitted: the correlations with one trend, then the best with the other."""
    sampled = not isinstance(rows, slice)
    starts = {
        "gaussian": int(np.clip(d, 5, MOST_STARTS)),
        "matern52": int(np.clip(d // 3, 3, MATERN_STARTS)),
        "matern72": NEAR_STARTS,
    }
    tried: list[Chosen] = []
    refusal: Exception | None = None

    def fit(form: Form, near: Chosen | None, n_starts: int | None) -> None:
        nonlocal refusal
        if sampled:
            n_starts = LINEAR_STARTS
        theta = None if near is None else near.fitted.theta
        try:
            fitted = attempt(form, rows, theta_start=theta, n_starts=n_starts)
        except (TooFewRuns, NotPositiveDefinite) as error:
            refusal = error
        else:
            tried.append(Chosen(form=form, fitted=fitted))

    for correlation in correlations:
        near = tried[-1] if tried else None
        count = None if len(correlations) == 1 else starts[correlation]
        fit(Form(correlation=correlation, trend=trends[0]), near, count)
        if tried and tried[0].fitted.runs.degenerate:
            return tried  # any correlation will do
    if len(trends) > 1 and tried and n >= RUNS_PER_TERM * (d + 1):
        near = _likeliest(tried)
        fit(Form(correlation=near.form.correlation, trend=trends[1]), near, LINEAR_STARTS)
    if not tried:
        assert refusal is not None
        raise refusal
    return tried


def _likeliest(tried: Sequence[Chosen]) -> Chosen:
    """The Gaussian correlation where its likelihood leads, else the likelier other, the first on a tie."""

    def likelihood(one: Chosen) -> float:
        return one.fitted.log_likelihood - SMOOTH_LEAD * (one.form.correlation == "gaussian")

    return max(tried, key=likelihood)


def _best(tried: Sequence[Chosen]) -> Chosen:
    first = tried[0].form.trend
    constant = _likeliest([each for each in tried if each.form.trend == first])
    larger = [each for each in tried if each.form.trend != first]
    if not larger or constant.fitted.runs.degenerate:
        return constant
    linear = larger[0]
    lead = _score(linear).log_score - _score(constant).log_score
    return linear if linear.fitted.runs.degenerate or lead > LINEAR_LEAD else constant


def _score(each: Chosen) -> FormScore:
    left = left_out(each.fitted.posterior, each.fitted.runs)
    return FormScore(
        correlation=each.form.correlation,
        trend=str(each.form.trend) if not callable(each.form.trend) else "function",
        log_likelihood=each.fitted.log_likelihood,
        log_score=left.log_score,
        q2=left.q2,
    )
