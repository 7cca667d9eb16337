"""The value that a response exceeds with a small chance only: a quantile over the uncertainty.

The worst case asks what could happen; the worst quantile what happens in one case of twenty. For a response y
that is bad when large, t with P(y <= t) = share, the parameters drawn from their distributions (uniform where
none is given).

The search draws a large sample of the uncertainty, predicts it with the Kriging of all runs, and runs the
model where the sample's membership in the tail is least certain:

    score(u) = s(u) phi((m(u) - t) / s(u))        the deviation that matters at the contour m = t

(in the spirit of Echard, Gayton and Lemaire 2011 and Bichon et al. 2008). The interval is that of the order
statistics of m - 2 kappa s and m + 2 kappa s over the sample, kappa from leave-one-out: it holds the
prediction's error, taken as if all errors had one sign, and the sampling error of a quantile.

Where runs fail the quantile is that of the cases that give a value, since a Kriging has a number for cases
that have none: of those likelier to give one than not (`surrogates.analysis.success`). The interval holds
what comes out when a case counts from a chance of 0.3 or of 0.7 on, too.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist
from scipy.stats import binom

import doe
from surrogates.analysis.success import SuccessChance
from workbench.errors import StudyError
from workbench.models.evaluator import (
    Evaluator,
    Reading,
    evaluator_of,
    response_name,
)
from workbench.search.arguments import Arguments
from workbench.search.runs.given_runs import Start
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger
from workbench.search.start import begin
from workbench.search.surrogate.feasibility import Feasibility
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.model import SearchModel
from workbench.space.box import Space
from workbench.space.streams import stream

__all__ = ["WorstQuantile", "worst_quantile"]

SAMPLE = 4000
FEWEST_IN_TAIL = 40  # sample points beyond the quantile, or the sample says nothing about it
DEVIATIONS = 2.0
CLOSEST = 1e-3  # of the unit cube
QUIET_BATCHES = 3
COUNTED = (0.3, 0.5, 0.7)  # chance to give a value from which a case counts: of the value the middle one


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstQuantile:
    """`value` is the quantile predicted over the sample, `lower` and `upper` its interval; `parameters` and
    `run_value` belong to the true run nearest to it, `run_key` names that run. It is the quantile of the
    cases that give a value, by the classifier of success the share `answered` of all: too small a one where
    the runs crowd the border of failures.
    """

    response: str
    sense: str
    share: float
    value: float
    lower: float
    upper: float
    parameters: Mapping[str, Any]
    run_value: float
    run_key: str
    evaluations: int
    failed: int
    sample: int
    answered: float = 1.0

    @property
    def sentence(self) -> str:
        """What to tell a reader."""
        side = "above" if self.sense == "max" else "below"
        cases = "all cases" if not self.failed else "the cases that give a value"
        return (
            f"{self.response} lies {side} {self.value:.6g} in {1 - self.share:.3g} of {cases} "
            f"(between {self.lower:.6g} and {self.upper:.6g}, by the Kriging of {self.evaluations} runs)"
        )

    def to_dict(self) -> dict[str, Any]:
        """For a JSON document."""
        return {**asdict(self), "parameters": dict(self.parameters), "sentence": self.sentence}


def worst_quantile(
    function: Callable[..., Any] | None,
    space: Space,
    *,
    share: float = 0.95,
    response: str | Reading | None = None,
    sense: str = "max",
    budget: int = 40,
    seed: int = 0,
    start: Start = (),
    workers: int = 1,
    tolerance: float = 1e-2,
    evaluator: Evaluator | None = None,
) -> WorstQuantile:
    """Estimate the quantile that `function(**parameters)` keeps to with the chance `share`.

    Args:
        share: chance of a value no worse, between 0.5 and 0.99.
        budget: true runs at most, the start design included; see `worst_case` for the other arguments.
        tolerance: stop when the interval is narrower than this share of the range of the values seen.
        evaluator: runs rows and stores them, in place of `function`, which may be None then.

    Raises:
        StudyError: share outside its range, and what `worst_case` raises.
        NotEnoughRuns: too few runs gave a value.

    >>> from workbench import Parameter
    >>> space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    >>> found = worst_quantile(lambda a, b: a + b, space, budget=15)
    >>> abs(found.value - (2 - 0.1**0.5)) < 0.02
    True
    """
    evaluate = evaluator_of(function, evaluator)
    most = 1 - FEWEST_IN_TAIL / SAMPLE
    if not 0.5 <= share <= most:
        raise StudyError(f"share needs a chance from 0.5 to {most:g}, got {share}; beyond it use worst_case")
    Arguments(sense=sense, budget=budget, seed=seed, workers=workers, tolerance=tolerance)
    ledger = Ledger.opened(space, response=response, sense=sense, start=start, progress=None)
    where = ledger.where
    begin(evaluate, ledger, budget=budget, seed=seed, workers=workers)
    ledger.require_values(FEWEST_RUNS)
    sample = _sample(ledger, seed)
    model: SearchModel | None = None
    quiet = 0
    while True:
        model = fit_search_model(where.features(ledger.u_ok), ledger.v, previous=model, seed=seed)
        chance = SuccessChance.of(where.features(ledger.u), ledger.ok).probability(where.features(sample))
        value, lower, upper = _quantile(ledger, model, sample, share, chance)
        quiet = quiet + 1 if upper - lower <= tolerance * float(np.ptp(ledger.v)) else 0
        if ledger.spent >= budget or quiet >= QUIET_BATCHES:
            break
        new = _next(ledger, model, sample, value, size=min(workers, budget - ledger.spent), seed=seed)
        if not len(new):
            break
        ledger.run(evaluate, new, purpose="quantile")
    nearest = int(np.argmin(np.abs(ledger.v - value)))
    run = [run for run in ledger.runs if run.value is not None][nearest]
    low, high = sorted((ledger.sign * lower, ledger.sign * upper))
    return WorstQuantile(
        response=response_name(response),
        sense=sense,
        share=share,
        value=float(ledger.sign * value),
        lower=float(low),
        upper=float(high),
        parameters=run.parameters,
        run_value=float(ledger.sign * ledger.v[nearest]),
        run_key=run.key,
        evaluations=ledger.spent,
        failed=sum(run.value is None for run in ledger.runs),
        sample=len(sample),
        answered=float(chance.mean()),
    )


def _sample(ledger: Ledger, seed: int) -> np.ndarray:
    """Unit points (n, d) drawn from the distributions, those that break a constraint left out."""
    space = ledger.where.space
    u = doe.lhs(SAMPLE, space.dimension, rng=stream(seed, "quantile sample"))
    values = space.quantile(u)
    points = ledger.where.unit([dict(zip(space.names, row.tolist(), strict=True)) for row in values])
    kept: np.ndarray = points[ledger.where.allowed(points)]
    if len(kept) < SAMPLE // 10:
        raise StudyError(
            f"only {len(kept)} of {SAMPLE} samples meet the constraints of the space; loosen them"
        )
    return kept


def _quantile(
    ledger: Ledger, model: SearchModel, sample: np.ndarray, share: float, chance: np.ndarray
) -> tuple[float, float, float]:
    """Quantile of the signed response over the sample, of the cases whose `chance` (n,) to give a value is
    large enough, and its interval."""
    mean, std = (model.cautious or model).predict(ledger.where.features(sample))
    spread = DEVIATIONS * (model.cautious or model).inflation * std
    n = max(round(float(chance.sum())), 1)
    first = np.clip(binom.ppf(0.025, n, share) - 1, 0, n - 1) / n
    last = np.clip(binom.ppf(0.975, n, share) + 1, 0, n) / n
    counted = [(chance >= least).astype(float) for least in COUNTED if (chance >= least).any()] or [chance]
    lower = min(_weighted(mean - spread, first, weights) for weights in counted)
    upper = max(_weighted(mean + spread, last, weights) for weights in counted)
    ends = np.array([_weighted(mean, share, counted[len(counted) // 2]), lower, upper])
    value, low, high = model.transform.inverse(ends)
    return float(value), float(low), float(high)


def _weighted(values: np.ndarray, share: float, weights: np.ndarray) -> float:
    """The quantile of values (n,) that count by weights (n,), linear between the middles of the weights.

    >>> _weighted(np.arange(5.0), 0.5, np.ones(5))
    2.0
    >>> _weighted(np.arange(5.0), 0.5, np.array([0.0, 0.0, 0.0, 1.0, 1.0]))
    3.5
    """
    order = np.argsort(values, kind="stable")
    order = order[weights[order] > 0]
    ordered = weights[order]
    middles = (np.cumsum(ordered) - 0.5 * ordered) / ordered.sum()
    return float(np.interp(share, middles, values[order]))


def _next(
    ledger: Ledger, model: SearchModel, sample: np.ndarray, value: float, *, size: int, seed: int
) -> np.ndarray:
    """Up to `size` sample points (m, d) whose side of the quantile is least certain."""
    judge = model.cautious or model
    features = ledger.where.features(sample)
    mean, std = judge.predict(features)
    distance = mean - float(judge.transform.forward(np.array([value]))[0])
    z = np.clip(distance / np.maximum(std, 1e-12 * judge.scale), -30.0, 30.0)
    chance = Feasibility.of(ledger.where.features(ledger.u), ledger.ok, seed=seed).probability(features)
    score = std * np.exp(-0.5 * z * z) * chance
    score[cdist(sample, ledger.u, "chebyshev").min(axis=1) <= CLOSEST] = 0.0
    chosen: list[np.ndarray] = []
    for _ in range(size):
        best = int(np.argmax(score))
        if score[best] <= 0:
            break
        chosen.append(sample[best])
        # points near a chosen one will be known when it has been run
        distance = np.abs(sample - sample[best]).max(axis=1)
        score *= np.clip(distance / 0.1, 0.0, 1.0)
    return np.array(chosen).reshape(-1, ledger.where.dimension)
