"""How many runs to plan for a screening, by simulation on functions like the user's.

Beside the simulation stand the runs below which no screening is called resolved, and, where the question is
like it, what was measured on Welch's function.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import pandas as pd

import doe
from surrogates import Recovery, fewest_runs, recovery
from workbench.errors import StudyError
from workbench.space.streams import stream

__all__ = ["RunPlan", "plan_runs", "run_plan_lines"]

DEFAULT_ACTIVE = 6
MOST_INPUTS = 60  # a simulated screening of more takes many seconds
FEWEST_RUNS = 3
# runs, samples with exactly the six selected, samples: docs/explanation/sampler-question.md, Latin hypercubes
# (40 runs: improved ones)
MEASURED = ((40, 31, 200), (50, 194, 200), (64, 200, 200), (80, 198, 200))
LIKE_WELCH, LIKE_SIX = range(15, 26), range(5, 8)  # inputs and active ones of which that says something


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """Recovery by number of runs, and the advice.

    Attributes:
        inputs, active, noise, target: what was asked.
        table: a `Recovery` per number of runs.
        needed: with fewer runs no screening is called resolved.
        runs: the smallest number tried, not below `needed`, that reaches the target; None if none does.
        found_from: the smallest number tried that reaches the target, whatever the verdict says.
        measured: what was counted on Welch's function where that is like what was asked; else "".
        advice: a sentence.
    """

    inputs: int
    active: int
    noise: float
    target: float
    table: tuple[Recovery, ...]
    needed: int
    runs: int | None
    found_from: int | None
    measured: str
    advice: str

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and strings."""
        document = asdict(self)
        document["table"] = [
            {
                **row,
                "exact_when_resolved": None
                if math.isnan(row["exact_when_resolved"])
                else row["exact_when_resolved"],
            }
            for row in document["table"]
        ]
        return document

    def to_frame(self) -> pd.DataFrame:
        """The table, one row per number of runs."""
        return pd.DataFrame([asdict(row) for row in self.table]).set_index("n")


def plan_runs(
    inputs: int,
    active: int = DEFAULT_ACTIVE,
    *,
    noise: float = 0.0,
    target: float = 0.9,
    runs: Sequence[int] = (),
    trials: int = 20,
    seed: int = 0,
) -> RunPlan:
    """Simulate screenings of `inputs` parameters of which about `active` matter.

    >>> plan = plan_runs(4, 1, runs=[10, 24], trials=4)
    >>> plan.runs in (10, 24)
    True

    Args:
        noise: standard deviation of the noise relative to that of the response.
        target: share of screenings that should find exactly the active parameters.
        runs: numbers to try; by default from 3 to 16 runs per active parameter, and the number from which on
            a screening may be called resolved. Ends at the first of these that reaches the target.
        trials: simulated screenings per number of runs (an interval of +-0.2 with 20, +-0.1 with 100).
    """
    if not 1 <= active <= inputs:
        raise StudyError(f"plan needs 1 <= active <= inputs, got active={active} and inputs={inputs}")
    if inputs > MOST_INPUTS:
        raise StudyError(
            f"plan simulates at most {MOST_INPUTS} inputs, got {inputs}; more inputs need little more runs"
        )
    if not 0.0 < target < 1.0:
        raise StudyError(f"target needs a share between 0 and 1, got {target}")
    if not 0.0 <= noise < math.inf:
        raise StudyError(f"noise needs a finite number >= 0, relative to the response, got {noise}")
    if trials < 1:
        raise StudyError(f"plan needs at least 1 trial, got {trials}")
    if runs and min(runs) < FEWEST_RUNS:
        raise StudyError(f"a screening needs at least {FEWEST_RUNS} runs, got {min(runs)} to try")
    needed = fewest_runs(inputs)
    steps = {needed, *(max(8, math.ceil(active * m)) for m in (3, 5, 7, 10, 13, 16))}
    ladder = sorted(runs or steps)
    table = []
    for n in ladder:
        table += recovery(
            inputs,
            active,
            [n],
            sampler=lambda n, d, rng: doe.lhs(n, d, rng=rng),
            noise=noise,
            trials=trials,
            rng=stream(seed, "plan"),  # the same problems for every n
        )
        if n >= needed and table[-1].exact >= target:
            break
    good = [row for row in table if row.exact >= target]
    reached = next((row for row in good if row.n >= needed), None)
    return RunPlan(
        inputs=inputs,
        active=active,
        noise=noise,
        target=target,
        table=tuple(table),
        needed=needed,
        runs=reached.n if reached else None,
        found_from=good[0].n if good else None,
        measured=_measured() if inputs in LIKE_WELCH and active in LIKE_SIX else "",
        advice=_advice(f"{inputs} parameters with about {active} that matter", needed, table, good, reached),
    )


def _advice(
    what: str, needed: int, table: Sequence[Recovery], good: Sequence[Recovery], reached: Recovery | None
) -> str:
    rule = f"with fewer than {needed} runs (10, and 2 per parameter) no screening is called resolved"
    if reached is None and good:
        return f"{good[0].n} runs find them for {what}: {_rate(good[0])}; but {rule}: plan at least {needed}"
    if reached is None:
        last = table[-1]
        more = f"plan more than {last.n}" if last.n >= needed else f"plan {needed} or more, as {rule}"
        return f"{last.n} runs are not enough for {what}: {_rate(last)}; {more}, or screen in two stages"
    said = (
        f"plan {reached.n} runs for {what}: {_rate(reached)}, and {reached.resolved:.0%} are called resolved"
    )
    if good[0].n < needed:
        said += f"; {good[0].n} runs find them, too ({good[0].exact:.0%}), but {rule}"
    return said


def _rate(row: Recovery) -> str:
    low, high = row.exact_interval
    return f"{row.exact:.0%} of simulated screenings find exactly those ({low:.0%} to {high:.0%})"


def _measured() -> str:
    counts = ", ".join(f"{found} of {tried} samples of {n} runs" for n, found, tried in MEASURED)
    return (
        "measured on Welch's function (20 inputs, 6 of them active, no noise): exactly the six selected in "
        f"{counts}; see docs/explanation/sampler-question.md"
    )


def run_plan_lines(document: dict[str, Any]) -> list[str]:
    """The plan for a person: recovery by number of runs, then the advice."""
    noise = f", noise {document['noise']:.0%} of the response" if document["noise"] else ""
    lines = [f"{document['inputs']} parameters, about {document['active']} of them active{noise}"]
    lines.append("  runs   exactly right (95 % interval)   missed   false   resolved")
    for row in document["table"]:
        low, high = row["exact_interval"]
        lines.append(
            f"  {row['n']:4d}   {row['exact']:13.0%} ({low:.0%} to {high:.0%})".ljust(41)
            + f"{row['missed']:6.2f}   {row['false']:5.2f}   {row['resolved']:8.0%}"
        )
    tried = document["table"][0]["trials"]
    lines.append(f"from {tried} simulated screenings of smooth functions on Latin hypercubes per line")
    if document["measured"]:
        lines.append(document["measured"])
    return [*lines, document["advice"]]
