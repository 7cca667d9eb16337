"""Re-evaluate two or more designs over the whole uncertainty, with the same draws for all of them.

    result = re_evaluate(function, {"old": {...}, "new": {...}}, uncertainty, samples=1000, limit=40.0)

`function(design, uncertainty)` takes two mappings. All designs meet the same uncertainty points (common
random numbers), so differences between designs are not blurred by the sampling: the paired difference has
its own interval. Points are a Latin hypercube through the parameters' distributions (uniform where none is
given).

The comparison rests on the scenarios in which every design gave a value (`workbench.robust.statistics`);
failures are counted against the design that failed and what they may hide is said
(`workbench.robust.failures`).
"""

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.models.evaluator import (
    Evaluator,
    FunctionEvaluator,
    Outcome,
    Reading,
    response_name,
    response_reader,
)
from workbench.robust.failures import failure_warnings
from workbench.robust.record import ReEvaluation, Summary
from workbench.robust.statistics import (
    FEWEST,
    common,
    paired_differences,
    summaries,
    wilson,
)
from workbench.space.box import Space
from workbench.space.common_ground import Ground
from workbench.space.streams import stream

if TYPE_CHECKING:
    from workbench.screening.rescreening import Rescreening

__all__ = ["ReEvaluation", "Summary", "re_evaluate", "wilson"]

LONGEST = 200  # characters of a failure that are quoted


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
    constraints: Sequence[str] = (),
) -> ReEvaluation:
    """Run every design at the same `samples` points of the uncertainty and compare.

    Scenarios in which a design gave no value are left out of the comparison for all designs.

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
        constraints: conditions that tie uncertain parameters to those of the design, such as "k + f <= 3". A
            sample that breaks one with a design is left out for all designs and counted as inadmissible.

    Raises:
        StudyError: no design, fewer than 10 samples, an extra scenario or nominal point outside the space or
            its constraints, fewer than 10 samples that meet the constraints.
        NotEnoughRuns: fewer than 10 scenarios in which every design gave a value.

    >>> from workbench import Parameter
    >>> result = re_evaluate(lambda x, u: x["k"] * u["f"], {"soft": {"k": 1.0}, "stiff": {"k": 2.0}},
    ...                      Space([Parameter("f", lower=0, upper=1, unit="N")]), samples=100)
    >>> [round(s.mean, 2) for s in result.summaries]
    [0.5, 1.0]
    """
    _check(
        designs,
        uncertainty,
        samples=samples,
        screened=screened,
        sense=sense,
        limit=limit,
        evaluators=evaluators,
    )
    ground = Ground.of(uncertainty, designs, constraints)
    ground.check(extra_scenarios, nominal)
    drawn, inadmissible = _drawn(ground, samples, seed)
    rows = [*drawn, *extra_scenarios, *([nominal] if nominal is not None else [])]
    names = tuple(designs)
    if evaluators is None:
        evaluators = {name: _calls(function, design) for name, design in designs.items()}
    values, errors = _run({name: evaluators[name] for name in names}, rows, response_reader(response))
    n, at_nominal = len(drawn), None if nominal is None else values[-1]
    rows, values = rows[: n + len(extra_scenarios)], values[: n + len(extra_scenarios)]
    sign = 1.0 if sense == "max" else -1.0
    together = common(names, values[:n], errors)
    return ReEvaluation(
        designs=names,
        scenarios=tuple(rows),
        values=values,
        drawn=n,
        inadmissible=inadmissible,
        nominal=None if nominal is None else dict(nominal),
        left_out=int(n - together.sum()),
        summaries=summaries(names, rows, values, together, at_nominal, sign=sign, limit=limit),
        paired=paired_differences(names, values[:n], together),
        warnings=failure_warnings(names, values, n, at_nominal, sign=sign, unit=unit),
        sense=sense,
        limit=limit,
        unit=unit,
        response=response_name(response),
        screenings=_screened(names, drawn, values, together, uncertainty, most=screened, seed=seed),
    )


def _check(
    designs: Mapping[str, Mapping[str, Any]],
    uncertainty: Space,
    *,
    samples: int,
    screened: int,
    sense: str,
    limit: float | None,
    evaluators: Mapping[str, Evaluator] | None,
) -> None:
    if not designs:
        raise StudyError("re_evaluate needs at least one design, got none")
    if not isinstance(designs, Mapping):
        raise StudyError(f"designs needs a mapping of names to designs, got {type(designs).__name__}")
    if not isinstance(uncertainty, Space):
        raise StudyError(f"uncertainty needs a Space of parameters, got {type(uncertainty).__name__}")
    if not isinstance(samples, int) or samples < FEWEST:
        raise StudyError(f"samples needs a whole number of at least {FEWEST}, got {samples}")
    if screened and not FEWEST <= screened <= samples:
        raise StudyError(f"screened needs 0 or {FEWEST} to samples={samples}, got {screened}")
    if sense not in ("max", "min"):
        raise StudyError(f"sense needs 'max' or 'min', got {sense!r}")
    if limit is not None and not (isinstance(limit, int | float) and isfinite(limit)):
        raise StudyError(f"limit needs a finite number, got {limit!r}; leave it out to have no limit")
    lacking = [name for name in designs if evaluators is not None and name not in evaluators]
    if lacking:
        raise StudyError(f"evaluators lacks design {lacking[0]!r}; give one for every design, or none at all")


def _drawn(ground: Ground, samples: int, seed: int) -> tuple[list[dict[str, Any]], dict[str, int]]:
    """Latin hypercube rows through the distributions that every design may meet, and how many of the
    `samples` each design may not.
    """
    space = ground.uncertainty
    u = doe.lhs(samples, space.dimension, rng=stream(seed, "robust"))
    values = [dict(zip(space.names, row.tolist(), strict=True)) for row in space.quantile(u)]
    kept, inadmissible = [], dict.fromkeys(ground.designs, 0)
    for row in space.canonical_rows(values):
        broken = ground.broken(row)
        for name in broken:
            inadmissible[name] += 1
        if not broken:
            kept.append(row)
    if len(kept) < FEWEST:
        each = ", ".join(f"{name} breaks one in {count}" for name, count in inadmissible.items())
        raise StudyError(
            f"only {len(kept)} of {samples} samples meet the constraints with every design ({each}); at "
            f"least {FEWEST} are needed. Draw more, or compare designs that share admissible points"
        )
    return kept, inadmissible


def _run(
    evaluators: Mapping[str, Evaluator], rows: list[Mapping[str, Any]], read: Reading
) -> tuple[np.ndarray, dict[str, str]]:
    """Values (n, m) of n scenarios under m designs, NaN without one; what the last failure of each said."""
    values, errors = np.full((len(rows), len(evaluators)), np.nan), {}
    for j, (name, evaluate) in enumerate(evaluators.items()):
        outcomes = evaluate(rows, purpose=f"robust {name}")
        values[:, j] = [_value(read, outcome) for outcome in outcomes]
        errors[name] = next((_first_line(o) for o in reversed(outcomes) if o.status != "ok"), "")
    return values, errors


def _calls(function: Callable[[Mapping[str, Any], Mapping[str, Any]], Any], design: Any) -> Evaluator:
    return FunctionEvaluator(lambda **u: function(design, u))


def _value(read: Reading, outcome: Outcome) -> float:
    """The response of a run, NaN where there is none; a combination may be without a value, too."""
    value = read(outcome.outputs) if outcome.status == "ok" else np.nan
    return value if isfinite(value) else np.nan


def _first_line(outcome: Outcome) -> str:
    return (outcome.error or outcome.status).strip().split("\n")[0][:LONGEST]


def _screened(
    names: Sequence[str],
    drawn: Sequence[Mapping[str, Any]],
    values: np.ndarray,
    together: np.ndarray,
    uncertainty: Space,
    *,
    most: int,
    seed: int,
) -> "tuple[Rescreening, ...]":
    """Every design screened on the first `most` of the common scenarios, so that samples do not differ."""
    if not most:
        return ()
    from workbench.screening.rescreening import re_screen  # brings pandas and xarray

    kept = np.flatnonzero(together)[:most]
    by_design = {name: values[kept, j] for j, name in enumerate(names)}
    return re_screen([drawn[k] for k in kept], by_design, uncertainty, seed=seed)
