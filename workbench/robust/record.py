"""What a re-evaluation of designs found: one summary per design, and the values it rests on."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from workbench.screening.rescreening import Rescreening

__all__ = ["ReEvaluation", "Share", "Summary"]

Share = tuple[float, float, float]  # a share and its Wilson interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """One design over the uncertainty. Intervals are 95 %.

    What is compared (mean, quantiles, worst, share beyond the limit, regret) rests on the scenarios in which
    every design gave a value; `n` of them were drawn. What failed is told beside it: `failed` of the drawn
    scenarios, `failed_share` with its interval, and `beyond_or_failed` counts a failure as beyond the limit.
    `worst` is the worst met in common, a lower bound of the worst; `worst_run` that of all the design's own
    runs, where others failed, too.
    """

    design: str
    n: int
    failed: int
    failed_share: Share
    mean: float
    mean_interval: tuple[float, float]
    quantiles: Mapping[str, tuple[float, float | None, float | None]]  # "P95": (value, lower, upper)
    worst: float
    worst_scenario: Mapping[str, Any]
    worst_run: float
    worst_run_scenario: Mapping[str, Any]
    beyond_limit: Share | None
    beyond_or_failed: Share | None
    largest_regret: float
    mean_regret: float
    nominal: float | None
    price_of_robustness: float | None

    def to_dict(self) -> dict[str, Any]:
        """Plain types."""
        return {
            "design": self.design,
            "n": self.n,
            "failed": self.failed,
            "failed_share": list(self.failed_share),
            "mean": self.mean,
            "mean_interval": list(self.mean_interval),
            "quantiles": {name: list(triple) for name, triple in self.quantiles.items()},
            "worst": self.worst,
            "worst_scenario": dict(self.worst_scenario),
            "worst_run": self.worst_run,
            "worst_run_scenario": dict(self.worst_run_scenario),
            "beyond_limit": None if self.beyond_limit is None else list(self.beyond_limit),
            "beyond_or_failed": None if self.beyond_or_failed is None else list(self.beyond_or_failed),
            "largest_regret": self.largest_regret,
            "mean_regret": self.mean_regret,
            "nominal": self.nominal,
            "price_of_robustness": self.price_of_robustness,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ReEvaluation:
    """`values` (scenarios, designs): NaN where a run failed. `scenarios`: the rows that all designs met, the
    `drawn` ones first, then those given; `left_out` of the drawn ones lack a value of some design.
    `inadmissible`: design -> how many samples break a constraint with it; those were drawn for nobody.
    `warnings` are sentences on what the failures may hide, or why there is no price of robustness.
    """

    designs: tuple[str, ...]
    scenarios: tuple[Mapping[str, Any], ...]
    values: np.ndarray
    drawn: int
    left_out: int
    inadmissible: Mapping[str, int]
    nominal: Mapping[str, Any] | None  # the scenario at which the price of robustness is read
    summaries: tuple[Summary, ...]
    paired: Mapping[str, tuple[float, float, float]]  # "new - old": mean difference and its interval
    warnings: tuple[str, ...]
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
            "drawn": self.drawn,
            "left_out": self.left_out,
            "inadmissible": dict(self.inadmissible),
            "nominal": None if self.nominal is None else dict(self.nominal),
            "scenarios": [dict(row) for row in self.scenarios],
            "values": {
                name: [None if np.isnan(v) else float(v) for v in self.values[:, j]]
                for j, name in enumerate(self.designs)
            },
            "paired": {name: list(interval) for name, interval in self.paired.items()},
            "warnings": list(self.warnings),
            "screenings": [screening.to_dict() for screening in self.screenings],
            "summaries": [summary.to_dict() for summary in self.summaries],
        }
