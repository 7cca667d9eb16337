"""Shares of the variance of paths: main and total Sobol' indices and interactions of pairs, path by path.

A path is a sum of products over the inputs, so that its variances are quadratic forms of products of
one-dimensional sums (`exact_shares`). Of a response that was modelled on another scale, y = T^-1(path),
they are not (`carried_shares`). Points of all inputs but one, k, are drawn, each with all values of x_k:

    main_k = Var E[y | x_k] / Var y,     total_k = E Var[y | the others] / Var y

All three variances come from the same points: what they miss of a response over decades, of which a few
points hold most of the variance, cancels in the quotient. The mean path is looked at on many more points, and
what few points make of it is taken off all paths.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .paths import Paths, Product, Sampled, product_of, without_each

__all__ = ["Shares", "carried_shares", "exact_shares"]

Array = NDArray[np.float64]

POINTS, POINTS_OF_MEAN = 128, 4096
PAIR_POINTS, PAIR_POINTS_OF_MEAN = 64, 1024
SIDE, SIDE_OF_MEAN = 6, 12  # values of each input of a pair
TINY = 1e-14


@dataclass(frozen=True, slots=True, kw_only=True)
class Shares:
    """Shares of the variance (k, 1 + draws), those of the mean path first.

    variance: (draws,) of each draw.   rounding: how far off main and total shares may be, where points are
        drawn.
    """

    main: Array
    total: Array
    interaction: Array
    variance: Array
    rounding: float = 0.0


def exact_shares(paths: Paths, named: Sequence[tuple[int, int]]) -> Shares:
    """Shares of paths, and of some pairs of inputs; `variance` on the scale of the paths."""
    mean, main = paths.mains()
    total = np.empty(main.shape)
    everything = paths.whole()
    variance = np.maximum(everything - mean**2, 0.0)
    for k, without in paths.all_without(list(range(len(main)))):
        # Var of E[path | all but k]
        total[k] = everything - paths.quadratic(without, paths.means[k])
    positive = np.where(variance > 1e-14 * np.maximum(mean**2, 1e-300), variance, np.inf)
    interaction = np.empty((len(named), len(mean)))
    for at, (i, j) in enumerate(named):
        interaction[at] = paths.pair(i, j) - mean**2 - main[i] - main[j]
    return Shares(
        main=main / positive,
        total=total / positive,
        interaction=interaction / positive,
        variance=variance[1:],
    )


def carried_shares(paths: Paths, named: Sequence[tuple[int, int]], back: Callable[[Array], Array]) -> Shares:
    """The same of what `back` makes of paths, on the same points whatever the model; variances of that."""
    few, many = _singles(paths, back, POINTS), _singles(paths, back, POINTS_OF_MEAN, mean_only=True)
    pairs = _pairs(paths, named, back, PAIR_POINTS, SIDE)
    of_mean = _pairs(paths, named, back, PAIR_POINTS_OF_MEAN, SIDE_OF_MEAN, mean_only=True)
    return Shares(
        main=few.main + (many.main - few.main[:, :1]),
        total=few.total + (many.total - few.total[:, :1]),
        interaction=pairs + (of_mean - pairs[:, :1]),
        variance=few.variance[1:],
        rounding=many.rounding,
    )


def _singles(paths: Paths, back: Callable[[Array], Array], points: int, *, mean_only: bool = False) -> Shares:
    """Main and total shares; `rounding` from the two halves of the points."""
    factors = Sampled(paths, points, mean_only=mean_only)
    found = np.empty((3, 3, len(factors), paths.drawn(mean_only)))  # all points and either half
    for k, others in without_each(factors, range(len(factors))):
        weights = paths.averages.weights[k]
        parts = _some(paths, k, paths.averages.points[k], mean_only)
        y = back(paths.grid(product_of(others, parts), parts))
        for row, some in enumerate((y, y[: (len(y) + 1) // 2], y[len(y) // 2 :])):
            found[:, row, k] = _variances(some, weights)
    main, total, variance = found
    main, total = main / variance, total / variance
    apart = max(np.abs(share[1] - share[2]).max() for share in (main, total))
    return Shares(
        main=main[0],
        total=total[0],
        interaction=np.empty((0, main.shape[-1])),
        variance=np.where(np.isfinite(variance[0]), variance[0], 0.0).mean(axis=0),
        rounding=0.5 * float(apart),
    )


def _variances(y: Array, weights: Array) -> tuple[Array, Array, Array]:
    """Var E[y | x], E Var[y | the others], Var y of y (m, c, q) with weights (q,) of x; (c,) each.

    The variance is inf where it is nothing but rounding.
    """
    within, squares = y @ weights, (y**2 @ weights).mean(axis=0)
    mean = within.mean(axis=0)
    variance = squares - mean**2
    main = ((y.mean(axis=0) - mean[:, None]) ** 2) @ weights
    total = squares - (within**2).mean(axis=0)
    return main, total, np.where(variance > TINY * squares, variance, np.inf)


def _pairs(
    paths: Paths,
    named: Sequence[tuple[int, int]],
    back: Callable[[Array], Array],
    points: int,
    side: int,
    *,
    mean_only: bool = False,
) -> Array:
    """Interactions of the pairs (pairs, 1 + draws), from `side` values of both inputs."""
    factors = Sampled(paths, points, mean_only=mean_only)
    found = np.empty((len(named), paths.drawn(mean_only)))
    for row, (i, j) in enumerate(named):
        others = (factors[k] for k in range(len(factors)) if k not in (i, j))
        (at, v), (other, w) = _few_values(paths, i, side), _few_values(paths, j, side)
        one, two = _some(paths, i, at, mean_only), _some(paths, j, other, mean_only)
        first, second = np.repeat(np.arange(len(v)), len(w)), np.tile(np.arange(len(w)), len(v))
        both = one[0][first] * two[0][second], one[1][first] * two[1][second]
        y = back(paths.grid(product_of(others, both), both))
        weights = np.outer(v, w)
        _, _, variance = _variances(y, weights.ravel())
        table = y.mean(axis=0).reshape(-1, len(v), len(w))
        table = table - (table @ w)[:, :, None] - (v @ table)[:, None, :] + (table @ w @ v)[:, None, None]
        found[row] = (table**2 * weights).sum(axis=(1, 2)) / variance
    return found


def _some(paths: Paths, k: int, u: Array, mean_only: bool) -> Product:
    """Parts of some scaled values of input k."""
    smooth, wave = paths.parts(k, u)
    return smooth, wave[:, : 0 if mean_only else None]


def _few_values(paths: Paths, k: int, side: int) -> tuple[Array, Array]:
    """Scaled values of input k with weights: a Gauss rule on its quantiles, all of few or of labels."""
    points, weights = paths.averages.points[k], paths.averages.weights[k]
    if len(points) <= side or k in paths.averages.posterior.correlation.labels:
        return points, weights
    order = np.argsort(points, kind="stable")
    points, weights = points[order], weights[order]
    at, of = np.polynomial.legendre.leggauss(side)
    return np.interp(0.5 + 0.5 * at, np.cumsum(weights) - 0.5 * weights, points), 0.5 * of
