"""Re-evaluate two or more designs over the whole uncertainty, with the same draws for all of them.

    result = re_evaluate(function, {"old": {...}, "new": {...}}, uncertainty, samples=1000, limit=40.0)

`function(design, uncertainty)` takes two mappings. All designs meet the same uncertainty points (common
random numbers), so differences between designs are not blurred by the sampling: the paired difference has
its own interval. Points are a Latin hypercube through the parameters' distributions (uniform where none is
given).

    share beyond the limit    k/n with the Wilson interval (Wilson 1927)
    quantile q                the order statistics whose ranks hold the binomial 95 % interval of q n
    regret of a scenario      value of the design minus the best of all designs in that scenario
    price of robustness       value at nominal minus the best value at nominal
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import binom

import doe
from workbench.errors import NotEnoughRuns, StudyError
from workbench.evaluator import Evaluator, FunctionEvaluator, Reading, response_name, response_reader
from workbench.scenarios import scenario_points
from workbench.space import Space
from workbench.streams import stream

if TYPE_CHECKING:
    import pandas as pd

    from workbench.rescreening import Rescreening

__all__ = ["ReEvaluation", "Summary", "re_evaluate", "wilson"]

Z95 = 1.959963984540054
QUANTILES = (0.05, 0.5, 0.95)
FEWEST = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """One design over the uncertainty. Intervals are 95 %; `worst` is the worst sampled, a lower bound of
    the worst.
    """

    design: str
    n: int
    failed: int
    mean: float
    mean_interval: tuple[float, float]
    quantiles: Mapping[str, tuple[float, float, float]]  # "P95": (value, lower, upper)
    worst: float
    worst_scenario: Mapping[str, Any]
    beyond_limit: tuple[float, float, float] | None  # share, lower, upper
    largest_regret: float
    mean_regret: float
    nominal: float | None
    price_of_robustness: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReEvaluation:
    """`values` (samples, designs): NaN where a run failed. `scenarios`: the rows that all designs met."""

    designs: tuple[str, ...]
    scenarios: tuple[Mapping[str, Any], ...]
    values: np.ndarray
    summaries: tuple[Summary, ...]
    paired: Mapping[str, tuple[float, float, float]]  # "new - old": mean difference and its interval
    sense: str
    limit: float | None
    unit: str
    response: str = "y"
    screenings: "tuple[Rescreening, ...]" = ()

    def frame(self) -> "pd.DataFrame":
        """One row per scenario: its parameters, then one column per design."""
        import pandas as pd

        table = pd.DataFrame(list(self.scenarios))
        for j, name in enumerate(self.designs):
            table[f"value: {name}"] = self.values[:, j]
        return table

    def to_dict(self) -> dict[str, Any]:
        """The document `robust.json`."""
        return {
            "designs": list(self.designs),
            "response": self.response,
            "sense": self.sense,
            "unit": self.unit,
            "limit": self.limit,
            "samples": len(self.scenarios),
            "scenarios": [dict(row) for row in self.scenarios],
            "values": {
                name: [None if np.isnan(v) else float(v) for v in self.values[:, j]]
                for j, name in enumerate(self.designs)
            },
            "paired": {name: list(interval) for name, interval in self.paired.items()},
            "screenings": [screening.to_dict() for screening in self.screenings],
            "summaries": [
                {
                    "design": s.design,
                    "n": s.n,
                    "failed": s.failed,
                    "mean": s.mean,
                    "mean_interval": list(s.mean_interval),
                    "quantiles": {name: list(triple) for name, triple in s.quantiles.items()},
                    "worst": s.worst,
                    "worst_scenario": dict(s.worst_scenario),
                    "beyond_limit": None if s.beyond_limit is None else list(s.beyond_limit),
                    "largest_regret": s.largest_regret,
                    "mean_regret": s.mean_regret,
                    "nominal": s.nominal,
                    "price_of_robustness": s.price_of_robustness,
                }
                for s in self.summaries
            ],
        }


def wilson(k: int, n: int, z: float = Z95) -> tuple[float, float]:
    """The Wilson interval of a share k/n.

    >>> low, high = wilson(9, 10)
    >>> print(f"{low:.3f} {high:.3f}")
    0.596 0.982
    """
    if n == 0:
        return 0.0, 1.0
    p, z2 = k / n, z * z
    centre = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = z / (1 + z2 / n) * np.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
    return float(max(centre - half, 0.0)), float(min(centre + half, 1.0))


def re_evaluate(
    function: Callable[[Mapping[str, Any], Mapping[str, Any]], Any],
    designs: Mapping[str, Mapping[str, Any]],
    uncertainty: Space,
    *,
    response: str | Reading | None = None,
    unit: str = "1",
    sense: str = "max",
    samples: int = 1000,
    seed: int = 0,
    limit: float | None = None,
    nominal: Mapping[str, Any] | None = None,
    extra_scenarios: Sequence[Mapping[str, Any]] = (),
    evaluators: Mapping[str, Evaluator] | None = None,
    screened: int = 0,
) -> ReEvaluation:
    """Run every design at the same `samples` points of the uncertainty and compare.

    Args:
        function: takes a design and an uncertainty point as mappings; returns a float or a mapping of
            responses.
        designs: name -> design, in the order of the tables; the first is the reference of the paired
            differences.
        uncertainty: the uncertain parameters; their distributions are used where given.
        response: a name or a function of the mapping of outputs.
        sense: "max" when large is bad, "min" when small is bad.
        samples: Latin hypercube points, at least 10.
        limit: the value not to exceed ("max") or to fall below ("min").
        nominal: the uncertainty point at which the price of robustness is read.
        extra_scenarios: further rows that every design meets, the known worst cases for instance; they
            enter the worst value and the regret, not the mean, the quantiles or the share beyond the limit.
        evaluators: name -> evaluator that stores its runs; the function is called in this process otherwise.
        screened: how many of the samples to screen for every design, at least 10, which tells which
            parameters matter to it and what changed; 0 does not screen.

    Raises:
        StudyError: no design, fewer than 10 samples, an extra scenario or nominal point outside the space.
        NotEnoughRuns: a design failed in all but nine of its runs.

    >>> from workbench import Parameter
    >>> result = re_evaluate(lambda x, u: x["k"] * u["f"], {"soft": {"k": 1.0}, "stiff": {"k": 2.0}},
    ...                      Space([Parameter("f", lower=0, upper=1, unit="N")]), samples=100)
    >>> [round(s.mean, 2) for s in result.summaries]
    [0.5, 1.0]
    """
    if not designs:
        raise StudyError("re_evaluate needs at least one design, got none")
    if samples < FEWEST:
        raise StudyError(f"samples needs at least {FEWEST}, got {samples}")
    if screened and not FEWEST <= screened <= samples:
        raise StudyError(f"screened needs 0 or {FEWEST} to samples={samples}, got {screened}")
    if sense not in ("max", "min"):
        raise StudyError(f"sense needs 'max' or 'min', got {sense!r}")
    read = response_reader(response)
    drawn = _scenarios(uncertainty, samples, seed)
    scenario_points(uncertainty, extra_scenarios)  # refuses what lies outside, with the reason
    if nominal is not None:
        uncertainty.unit([nominal])
    rows = [*drawn, *extra_scenarios, *([nominal] if nominal is not None else [])]
    names = tuple(designs)
    values = np.full((len(rows), len(names)), np.nan)
    for j, name in enumerate(names):
        design = designs[name]

        def with_design(_design: Mapping[str, Any] = design, **u: Any) -> Any:
            return function(_design, u)

        evaluate = evaluators[name] if evaluators is not None else FunctionEvaluator(with_design)
        outcomes = evaluate(rows, purpose=f"robust {name}")
        values[:, j] = [read(o.outputs) if o.status == "ok" else np.nan for o in outcomes]
    result = _compared(
        names, rows, values, n_drawn=len(drawn), sense=sense, unit=unit, limit=limit, nominal=nominal
    )
    result = replace(result, response=response_name(response))
    if not screened:
        return result
    from workbench.rescreening import re_screen  # brings pandas and xarray

    kept = min(screened, len(drawn))
    by_design = {name: values[:kept, j] for j, name in enumerate(names)}
    return replace(result, screenings=re_screen(drawn[:kept], by_design, uncertainty, seed=seed))


def _scenarios(uncertainty: Space, samples: int, seed: int) -> list[dict[str, Any]]:
    """Latin hypercube rows through the distributions; points that break a constraint are left out."""
    u = doe.lhs(samples, uncertainty.dimension, rng=stream(seed, "robust"))
    values = uncertainty.quantile(u)
    rows = [dict(zip(uncertainty.names, row.tolist(), strict=True)) for row in values]
    kept = [row for row in rows if uncertainty.violated(row) is None]
    if len(kept) < FEWEST:
        raise StudyError(
            f"only {len(kept)} of {samples} samples meet the constraints of the uncertainty; draw more"
        )
    return kept


def _compared(
    names: tuple[str, ...],
    rows: Sequence[Mapping[str, Any]],
    values: np.ndarray,
    *,
    n_drawn: int,
    sense: str,
    unit: str,
    limit: float | None,
    nominal: Mapping[str, Any] | None,
) -> ReEvaluation:
    sign = 1.0 if sense == "max" else -1.0
    drawn = values[:n_drawn]
    scenarios = values[: len(values) - 1] if nominal is not None else values
    at_nominal = values[-1] if nominal is not None else None
    complete = ~np.isnan(scenarios).any(axis=1)
    regret = sign * scenarios[complete] - (sign * scenarios[complete]).min(axis=1, keepdims=True)
    summaries = []
    for j, name in enumerate(names):
        sample = drawn[~np.isnan(drawn[:, j]), j]
        if len(sample) < FEWEST:
            raise NotEnoughRuns(
                f"design {name!r} gave a value in {len(sample)} of {n_drawn} runs; "
                f"at least {FEWEST} are needed"
            )
        half = Z95 * sample.std(ddof=1) / np.sqrt(len(sample))
        worst = int(np.nanargmax(sign * scenarios[:, j]))
        price = None
        if at_nominal is not None and not np.isnan(at_nominal[j]):
            price = float(sign * at_nominal[j] - np.nanmin(sign * at_nominal))
        summaries.append(
            Summary(
                design=name,
                n=len(sample),
                failed=n_drawn - len(sample),
                mean=float(sample.mean()),
                mean_interval=(float(sample.mean() - half), float(sample.mean() + half)),
                quantiles={f"P{round(100 * q)}": _quantile(sample, q) for q in QUANTILES},
                worst=float(scenarios[worst, j]),
                worst_scenario=dict(rows[worst]),
                beyond_limit=_beyond(sample, limit, sign),
                largest_regret=float(regret[:, j].max()) if len(regret) else float("nan"),
                mean_regret=float(regret[:, j].mean()) if len(regret) else float("nan"),
                nominal=None if at_nominal is None else float(at_nominal[j]),
                price_of_robustness=price,
            )
        )
    paired = {}
    for j, name in enumerate(names[1:], start=1):
        both = ~np.isnan(drawn[:, [0, j]]).any(axis=1)
        difference = drawn[both, j] - drawn[both, 0]
        half = Z95 * difference.std(ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else np.nan
        middle = float(difference.mean())
        paired[f"{name} - {names[0]}"] = (middle, float(middle - half), float(middle + half))
    return ReEvaluation(
        designs=names,
        scenarios=tuple(rows[: len(scenarios)]),
        values=scenarios,
        summaries=tuple(summaries),
        paired=paired,
        sense=sense,
        limit=limit,
        unit=unit,
    )


def _quantile(sample: np.ndarray, q: float) -> tuple[float, float, float]:
    """Sample quantile with its distribution-free 95 % interval from order statistics."""
    ordered = np.sort(sample)
    n = len(ordered)
    low = int(np.clip(binom.ppf(0.025, n, q) - 1, 0, n - 1))
    high = int(np.clip(binom.ppf(0.975, n, q), 0, n - 1))
    return float(np.quantile(ordered, q)), float(ordered[low]), float(ordered[high])


def _beyond(sample: np.ndarray, limit: float | None, sign: float) -> tuple[float, float, float] | None:
    if limit is None:
        return None
    k = int((sign * sample > sign * limit).sum())
    low, high = wilson(k, len(sample))
    return k / len(sample), low, high
