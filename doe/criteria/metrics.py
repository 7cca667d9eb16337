"""All metrics of a design at once, from as few passes over its pairs of runs as they share.

Large designs (n^2 d > 5e8) are measured on a sample of their runs, with 95 % bounds of what was sampled.
"""

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

__all__ = ["cost", "metrics", "probe_points", "projection_cd2"]

Floats = NDArray[np.float64]

# n^2 d up to which a design is measured on all pairs; beyond, SAMPLE / (n d) of its runs stand for all
EXACT = 5e8
SAMPLE = 1.6e8
SUBSET = 1024
ROWS = 65536  # of the points of which there may be a copy
PROBES = 512
# n^2 d^2 / 4 up to which all two-dimensional projections are looked at
PAIRS = 2e8
# smallest over largest eigenvalue above which the inverse of X'X is good to 1e-12
WELL = 1e-4
NORMAL_95 = 1.959963984540054


def probe_points(n: int, d: int) -> Floats:
    """(k, d) Sobol' points whose distance to the nearest run is measured; fewer for large designs."""
    return np.asarray(qmc.Sobol(d, scramble=False).random(PROBES)[: max(1, int(SAMPLE / (2 * n * d)))])


def cost(n: int, d: int, model: Model) -> float:
    """Element operations of one set of metrics, roughly."""
    terms = model_matrix(np.full((1, d), 0.5), model=model).shape[1]
    pairs = 2.0 * min(float(n) ** 2 * d, SAMPLE)
    if _all_projections(n, d):
        pairs += n * n * d * d / 8
    probing = min(float(PROBES) * n * d, SAMPLE) / 2
    return float(pairs + probing + n * d * 20 + n * terms**2 / 2 + 20.0 * terms**3 + 2e5)


def _all_projections(n: int, d: int) -> bool:
    return d > 1 and n * n * d * d / 4 <= PAIRS


def metrics(
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
    products = np.zeros((d, d))
    for begin in range(0, n, ROWS):
        centred = points[begin : begin + ROWS] - mean
        products += centred.T @ centred
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
