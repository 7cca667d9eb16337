"""What a plain search would have found at the same cost, so that a reader sees what the search bought.

On an expensive model the plain searches are played on the Kriging of all runs: a Latin hypercube, corners
in random order and a full grid, each of as many runs as the search made, repeated over draws. They are
predictions and say so.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import doe
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.success import SuccessChance

__all__ = ["Baseline", "predicted_baselines"]

REPLICATES = 100
LARGEST_GRID = 20_000
LIKELY = 0.5  # chance from which a run counts as one with a value


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseline:
    """The best of `runs` runs of a plain search: median and 90 % range over draws, in the response's sign."""

    runs: int
    median: float
    low: float
    high: float
    kind: str

    def to_dict(self) -> dict[str, float | int | str]:
        """For the JSON document."""
        return {
            "runs": self.runs,
            "median": self.median,
            "low": self.low,
            "high": self.high,
            "kind": self.kind,
        }


def predicted_baselines(
    where: SearchSpace,
    model: SearchModel,
    *,
    success: SuccessChance,
    u: np.ndarray,
    v: np.ndarray,
    runs: int,
    sign: float,
    rng: np.random.Generator,
) -> dict[str, Baseline]:
    """Plain searches of `runs` runs played on the Kriging; at one of the points u (n, d) that were run its
    signed value v (n,) counts, which a Kriging with a nugget need not meet. A run that would rather fail
    brings nothing."""
    out = {}
    for name, designs in _designs(where, runs, rng).items():
        best = np.array([_values(where, model, points, success, u, v).max() for points in designs])
        best = best[np.isfinite(best)]
        if not len(best):
            continue
        low, median, high = sign * np.quantile(best, [0.05, 0.5, 0.95])
        out[name] = Baseline(
            runs=max(len(u) for u in designs),
            median=float(median),
            low=float(low),
            high=float(high),
            kind="predicted by the Kriging",
        )
    return out


def _values(
    where: SearchSpace,
    model: SearchModel,
    points: np.ndarray,
    success: SuccessChance,
    u: np.ndarray,
    v: np.ndarray,
) -> np.ndarray:
    features = where.features(points)
    values = np.where(success.probability(features) >= LIKELY, model.mean(features), -np.inf)
    at, run = np.nonzero((points[:, None] == u).all(axis=2))
    values[at] = v[run]
    return values


def _designs(where: SearchSpace, runs: int, rng: np.random.Generator) -> Mapping[str, list[np.ndarray]]:
    """Unit points of every plain search; a grid is drawn once, and left out below 2 levels per axis."""
    d = where.dimension

    def allowed(u: np.ndarray) -> np.ndarray:
        snapped = where.snap(u)
        kept: np.ndarray = snapped[where.allowed(snapped)]
        return kept

    designs = {
        "Latin hypercube": [allowed(doe.lhs(runs, d, rng=rng)) for _ in range(REPLICATES)],
        "random corners": [allowed(_corners(where, runs, rng)) for _ in range(REPLICATES)],
    }
    levels = int(np.floor(runs ** (1 / d) + 1e-9))
    if levels >= 2 and levels**d <= LARGEST_GRID:
        axes = np.meshgrid(*[np.linspace(0, 1, levels)] * d, indexing="ij")
        designs["grid"] = [allowed(np.column_stack([axis.ravel() for axis in axes]))]
    kept = {name: [u for u in drawn if len(u)] for name, drawn in designs.items()}
    return {name: drawn for name, drawn in kept.items() if drawn}


def _corners(where: SearchSpace, runs: int, rng: np.random.Generator) -> np.ndarray:
    """Corners without repetition; all of them when there are no more than `runs`."""
    all_corners = where.corners()
    if all_corners is not None:
        return all_corners[rng.permutation(len(all_corners))[:runs]]
    return rng.integers(0, 2, (runs, where.dimension)).astype(float)
