"""The quality of a design on a scale: every metric beside random Latin hypercubes of the same size.

A raw CD2 says nothing across dimensions (0.03 for eight factors, 5e5 for a hundred); its percentile among
random Latin hypercubes of the same n and d does. Levels and words are compared with random designs on the
same ones: among continuous points any design of three levels looks clustered and uneven.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.criteria.metrics import cost, metrics, probe_points
from doe.criteria.regression import Model
from doe.criteria.spread import unit_points
from doe.latin.lhs import lhs

__all__ = ["BETTER", "Quality", "quality"]

Floats = NDArray[np.float64]

BETTER: Mapping[str, str] = {
    "min_distance": "high",
    "nearest_mean": "high",
    "phi_p": "low",
    "cd2": "low",
    "wd2": "low",
    "md": "low",
    "maxpro": "low",
    "max_correlation": "low",
    "rms_correlation": "low",
    "max_vif": "low",
    "d_efficiency": "high",
    "a_efficiency": "high",
    "i_efficiency": "high",
    "mesh_ratio": "low",
    "fill_distance": "low",
    "worst_pair_cd2": "low",
}
"""Which way each metric is better."""

REFERENCES = 300
FEWEST = 8
# element operations that all reference designs together may cost: about two seconds
BUDGET = 4e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """Metrics of a design of n runs in d factors, and where each stands among random Latin hypercubes.

    Attributes:
        n, d: runs and factors.   model: name of the regression model.   references: random designs drawn.
        min_distance: smallest distance of two runs.   nearest_mean: mean distance to the nearest run.
        distance_bound_share: min_distance as a share of the bound of Latin hypercubes,
            sqrt(floor(n (n + 1) d / 6)) / n.
        phi_p, cd2, wd2, md, maxpro: see `doe.criteria.spread`; phi_p with p = 10.
        max_correlation, rms_correlation: of two columns.   max_vif: largest variance inflation factor.
        d_efficiency, a_efficiency, i_efficiency: of the regression model on [-1, 1].
        mesh_ratio: largest over smallest nearest-neighbour distance.
        fill_distance: largest distance from 512 Sobol' points of the cube to the nearest run (fewer points
            for large designs).
        worst_pair_cd2, worst_pair: CD2 of the least even projection on two factors, and these.
        percentiles: share in per cent of the random designs with a smaller value, ties halved. A metric that
            does not exist, or has the same value for all of them and the design, has none.
        intervals: 95 % bounds of the metrics that were estimated from a sample of the runs; empty when all
            are exact.
    """

    n: int
    d: int
    model: str
    references: int
    min_distance: float
    nearest_mean: float
    distance_bound_share: float
    phi_p: float
    cd2: float
    wd2: float
    md: float
    maxpro: float
    max_correlation: float
    rms_correlation: float
    max_vif: float
    d_efficiency: float
    a_efficiency: float
    i_efficiency: float
    mesh_ratio: float
    fill_distance: float
    worst_pair_cd2: float
    worst_pair: tuple[int, ...]
    percentiles: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]

    def beats(self, metric: str) -> float:
        """Share in per cent of random Latin hypercubes that this design is better than.

        Raises: ValueError for a metric that has no percentile.
        """
        if metric not in self.percentiles:
            raise ValueError(f"metric needs one of {', '.join(self.percentiles)}, got {metric!r}")
        below = self.percentiles[metric]
        return below if BETTER[metric] == "high" else 100.0 - below

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """{metric: {value, percentile, better}} in plain types; numbers that do not exist are None."""
        return {
            name: {
                "value": _plain(getattr(self, name)),
                "percentile": _plain(self.percentiles.get(name, float("nan"))),
                "better": better,
            }
            for name, better in BETTER.items()
        }


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def quality(
    points: ArrayLike,
    model: Model = "linear",
    *,
    references: int | None = None,
    drawn: Callable[[np.random.Generator], ArrayLike] | None = None,
    rng: np.random.Generator,
) -> Quality:
    """Measure a design (n, d) in [0, 1] and compare it with random Latin hypercubes of the same n and d.

    model: of the efficiencies and the variance inflation
    references: random designs to compare with; by default 300, fewer when they would take more than seconds
    drawn: gives a random design (n, d) of the same kind, such as one on the same levels; a random Latin
        hypercube by default

    Large designs (n^2 d > 5e8) are measured on a sample of their runs; `intervals` then holds 95 % bounds,
    and the sampled min_distance is an upper bound.

    >>> found = quality([[0.1, 0.5], [0.5, 0.9], [0.9, 0.1]], rng=np.random.default_rng(1))
    >>> round(found.min_distance, 4), sorted(found.percentiles)[:2]
    (0.5657, ['a_efficiency', 'cd2'])

    Raises: ValueError for points outside [0, 1] or not finite, references < 1, and a design `drawn` that has
    another shape.
    """
    array = unit_points(points)
    n, d = array.shape
    if references is None:
        references = int(np.clip(BUDGET / cost(n, d, model), FEWEST, REFERENCES))
    elif references < 1:
        raise ValueError(f"references needs a whole number >= 1, got {references}")
    probes = probe_points(n, d)
    own, worst_pair, intervals = metrics(array, model, probes, rng)
    rows = [metrics(_random_design(n, d, drawn, rng), model, probes, rng)[0] for _ in range(references)]
    percentiles = {}
    for name in BETTER:
        reference = np.array([row[name] for row in rows])
        if not (np.isnan(own[name]) or np.isnan(reference).any() or (reference == own[name]).all()):
            percentiles[name] = _percentile(own[name], reference)
    bound = np.sqrt(np.floor(n * (n + 1) * d / 6)) / n
    return Quality(
        n=n,
        d=d,
        model=model if isinstance(model, str) else "custom",
        references=references,
        distance_bound_share=float(own["min_distance"] / bound),
        worst_pair=worst_pair,
        percentiles=percentiles,
        intervals=intervals,
        **own,
    )


def _random_design(
    n: int, d: int, drawn: Callable[[np.random.Generator], ArrayLike] | None, rng: np.random.Generator
) -> Floats:
    if drawn is None:
        return lhs(n, d, rng=rng)
    points = unit_points(drawn(rng))
    if points.shape != (n, d):
        raise ValueError(f"drawn needs to give designs of shape ({n}, {d}), got {points.shape}")
    return points


def _percentile(value: float, reference: Floats) -> float:
    """Share of the reference below the value, ties halved, in per cent."""
    below = np.count_nonzero(reference < value) + 0.5 * np.count_nonzero(reference == value)
    return float(100.0 * below / len(reference))
