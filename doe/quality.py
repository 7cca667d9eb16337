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
from scipy.stats import qmc

from doe.criteria import _kernels_spread as kernels
from doe.criteria.regression import (
    Model,
    a_efficiency,
    d_efficiency,
    i_efficiency,
    model_matrix,
    moment_matrix,
    variance_inflation,
)
from doe.criteria.spread import (
    P,
    columns_of,
    discrepancy_singles,
    unit_points,
)
from doe.latin.lhs import lhs

__all__ = ["BETTER", "Quality", "projection_cd2", "quality"]

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
# n^2 d up to which a design is measured on all pairs; beyond, SAMPLE / (n d) of its runs stand for all
EXACT = 5e8
SAMPLE = 1.6e8
SUBSET = 1024
PROBES = 512
# n^2 d^2 / 4 up to which all two-dimensional projections are looked at
PAIRS = 2e8
# smallest over largest eigenvalue above which the inverse of X'X is good to 1e-12
WELL = 1e-4
NORMAL_95 = 1.959963984540054


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
        references = int(np.clip(BUDGET / _cost(n, d, model), FEWEST, REFERENCES))
    elif references < 1:
        raise ValueError(f"references needs a whole number >= 1, got {references}")
    probes = qmc.Sobol(d, scramble=False).random(PROBES)[: max(1, int(SAMPLE / (2 * n * d)))]
    own, worst_pair, intervals = _metrics(array, model, probes, rng)
    rows = [_metrics(_random_design(n, d, drawn, rng), model, probes, rng)[0] for _ in range(references)]
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


def _cost(n: int, d: int, model: Model) -> float:
    """Element operations of one set of metrics, roughly."""
    terms = model_matrix(np.full((1, d), 0.5), model=model).shape[1]
    pairs = 2.0 * min(float(n) ** 2 * d, SAMPLE)
    if _all_projections(n, d):
        pairs += n * n * d * d / 8
    probing = min(float(PROBES) * n * d, SAMPLE) / 2
    return float(pairs + probing + n * d * 20 + n * terms**2 / 2 + 20.0 * terms**3 + 2e5)


def _all_projections(n: int, d: int) -> bool:
    return d > 1 and n * n * d * d / 4 <= PAIRS


def _metrics(
    points: Floats, model: Model, probes: Floats, rng: np.random.Generator
) -> tuple[dict[str, float], tuple[int, ...], dict[str, tuple[float, float]]]:
    """All metrics, the worst pair of columns, and 95 % bounds of what was sampled."""
    n, d = points.shape
    columns = columns_of(points)
    found, intervals = _pair_metrics(points, columns, rng)
    linear, matrix = _linear_information(points)
    off = np.abs(matrix[np.triu_indices(d, 1)])
    found["max_correlation"] = float(off.max(initial=0.0))
    found["rms_correlation"] = float(np.sqrt(np.mean(off**2))) if off.size else 0.0
    found.update(_efficiencies(points, model, linear, matrix))
    reach = np.empty(len(probes))
    kernels.probe_distances(columns, probes, reach)
    found["fill_distance"] = float(np.sqrt(reach.max()))
    found["worst_pair_cd2"] = float("nan")
    worst: tuple[int, ...] = ()
    if _all_projections(n, d):
        values = projection_cd2(points)
        k, l = np.unravel_index(int(np.nanargmax(values)), values.shape)
        found["worst_pair_cd2"], worst = float(values[k, l]), (int(l), int(k))
    return found, worst, intervals


def projection_cd2(points: ArrayLike) -> Floats:
    """Squared centred discrepancy of every two-dimensional projection: (d, d), NaN on and above the diagonal.

    >>> projection_cd2([[0.25, 0.25], [0.75, 0.75]]).round(4).tolist()
    [[nan, nan], [0.0623, nan]]
    """
    array = unit_points(points)
    n, d = array.shape
    sums = np.zeros((d, d))
    kernels.pair_projections(columns_of(array), sums)
    z = np.abs(array - 0.5)
    single = 1.0 + 0.5 * z - 0.5 * z**2
    diagonal = 1.0 + z
    values = (13 / 12) ** 2 - 2.0 / n * (single.T @ single) + (2.0 * sums + diagonal.T @ diagonal) / n**2
    values[np.triu_indices(d)] = np.nan
    return np.asarray(values)


def _pair_metrics(
    points: Floats, columns: Floats, rng: np.random.Generator
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Distances, discrepancies and MaxPro: from all pairs, or estimated from a sample of the runs.

    The sample: some runs against all others for the distances, and for the products all pairs of SUBSET
    random runs, whose mean is an unbiased estimate of that over all pairs; its error follows from the spread
    of the run means (Hoeffding 1948).
    """
    n, d = points.shape
    exact = float(n) ** 2 * d <= EXACT
    if exact:
        rows, inner, part = np.arange(n), np.arange(n), columns
    else:
        rows = np.sort(rng.choice(n, size=max(2, min(n, int(SAMPLE / (n * d)))), replace=False))
        part = np.ascontiguousarray(columns[:, rng.choice(n, size=min(n, SUBSET), replace=False)])
        inner = np.arange(part.shape[1])
    nearest, powers = np.full(len(rows), 1e300), np.empty(len(rows))
    products = np.empty((4, len(inner)))
    kernels.distances(columns, rows, exact, P // 2, nearest, powers)
    kernels.discrepancies(part, inner, exact, products[1:])
    kernels.projections(part, inner, exact, products[0])
    nearest = np.sqrt(np.where(nearest >= 1e300, np.nan, nearest))
    singles = discrepancy_singles(points)
    pairs = n * (n - 1) / 2

    def from_totals(power: float, product: Floats) -> dict[str, float]:
        spread = singles[0] - 2.0 / n * singles[1] + (2.0 * product[1:] + singles[2]) / n**2
        return {
            "phi_p": float(max(power, 0.0) ** (1.0 / P)),
            "maxpro": float((max(product[0], 0.0) / max(pairs, 1.0)) ** (1.0 / d)),
            "cd2": float(spread[0]),
            "wd2": float(spread[1]),
            "md": float(spread[2]),
        }

    if exact:
        power, product = float(powers.sum()), products.sum(axis=1)
        if n > 1 and np.min(nearest) == 0.0:
            power = np.inf
    else:
        power, product = float(powers.mean() * n / 2), products.mean(axis=1) / (len(inner) - 1) * pairs
    found = from_totals(power, product)
    found["min_distance"] = float(np.min(nearest))
    found["nearest_mean"] = float(np.mean(nearest))
    spaced = n > 1 and np.min(nearest) > 0.0
    found["mesh_ratio"] = float(np.max(nearest) / np.min(nearest)) if spaced else float("nan")
    if exact:
        return found, {}
    with np.errstate(over="ignore"):
        off = NORMAL_95 * float(powers.std(ddof=1)) / np.sqrt(len(rows)) * n / 2
        slack = 2 * NORMAL_95 * products.std(axis=1, ddof=1) / np.sqrt(len(inner)) / (len(inner) - 1) * pairs
    lower, upper = from_totals(power - off, product - slack), from_totals(power + off, product + slack)
    intervals = {name: (lower[name], upper[name]) for name in lower}
    margin = float(NORMAL_95 * nearest.std(ddof=1) / np.sqrt(len(rows)))
    intervals["nearest_mean"] = (found["nearest_mean"] - margin, found["nearest_mean"] + margin)
    intervals["min_distance"] = (0.0, found["min_distance"])
    return found, intervals


def _linear_information(points: Floats) -> tuple[Floats, Floats]:
    """X'X of the linear model on [-1, 1] and the correlation matrix, from one product of the points."""
    n, d = points.shape
    mean = points.mean(axis=0)
    centred = points - mean
    products = centred.T @ centred
    information = np.empty((d + 1, d + 1))
    coded = 2.0 * mean - 1.0
    information[0, 0] = n
    information[0, 1:] = information[1:, 0] = n * coded
    information[1:, 1:] = 4.0 * products + n * np.outer(coded, coded)
    scale = np.sqrt(np.diag(products))
    scale[scale == 0.0] = 1.0
    matrix = np.clip(products / np.outer(scale, scale), -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return information, matrix


def _efficiencies(points: Floats, model: Model, linear: Floats, matrix: Floats) -> dict[str, float]:
    """Inflation and D-, A- and I-efficiency from one information matrix; the careful way when it is singular.

    linear, matrix: X'X of the linear model, and the correlations of the columns.
    """
    n, d = points.shape
    if isinstance(model, str) and model == "linear":
        information = linear
        constant = bool((np.ptp(points, axis=0) == 0.0).any())
    else:
        x = model_matrix(points, model=model)
        information, constant = x.T @ x, True
    p = len(information)
    values = np.linalg.eigvalsh(information)
    if n < p or values[0] <= WELL * values[-1]:
        inflation = variance_inflation(points, model=model) if n >= p else np.array([np.inf])
        return {
            "max_vif": float(inflation.max(initial=1.0)),
            "d_efficiency": d_efficiency(points, model=model),
            "a_efficiency": a_efficiency(points, model=model),
            "i_efficiency": i_efficiency(points, model=model),
        }
    if constant:
        inflation = variance_inflation(points, model=model)
    else:
        inflation = np.diag(np.linalg.inv(matrix))
    inverse = np.linalg.inv(information)
    return {
        "max_vif": float(inflation.max(initial=1.0)),
        "d_efficiency": float(np.exp(np.log(values).mean()) / n),
        "a_efficiency": float(p / (n * np.trace(inverse))),
        "i_efficiency": float(p / (n * np.sum(inverse * moment_matrix(model, d)))),
    }
