"""How many runs to plan for a screening, by simulation on functions like the user's."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import pandas as pd

import doe
from surrogates import Recovery, recovery
from workbench.errors import StudyError
from workbench.streams import stream

__all__ = ["RunPlan", "plan_runs", "run_plan_lines"]

DEFAULT_ACTIVE = 6
MOST_INPUTS = 60  # a simulated screening of more takes many seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """Recovery by number of runs, and the advice.

    Attributes:
        inputs, active, noise, target: what was asked.
        table: a `Recovery` per number of runs.
        runs: the smallest number tried that reaches the target; None if none does.
        advice: a sentence.
    """

    inputs: int
    active: int
    noise: float
    target: float
    table: tuple[Recovery, ...]
    runs: int | None
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
        runs: numbers to try; by default from 3 to 16 runs per active parameter.
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
    ladder = tuple(runs) or tuple(dict.fromkeys(max(8, math.ceil(active * m)) for m in (3, 5, 7, 10, 13, 16)))
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
        if table[-1].exact >= target:
            break
    reached = next((row.n for row in table if row.exact >= target), None)
    last = table[-1]
    low, high = last.exact_interval
    what = f"{inputs} parameters with about {active} that matter"
    rate = f"{last.exact:.0%} of simulated screenings find exactly those ({low:.0%} to {high:.0%})"
    advice = (
        f"plan {reached} runs for {what}: {rate}"
        if reached
        else f"{last.n} runs are not enough for {what}: {rate}; plan more, or screen in two stages"
    )
    return RunPlan(
        inputs=inputs,
        active=active,
        noise=noise,
        target=target,
        table=tuple(table),
        runs=reached,
        advice=advice,
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
    return [*lines, document["advice"]]
