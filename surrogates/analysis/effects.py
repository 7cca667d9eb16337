"""Effects of single inputs with posterior bands: main effects, partial dependence, accumulated local effects.

Every one of them is a linear functional A of the process, so it has a posterior of its own: with c = A r(.,
runs), g = A f and rho = A A' R,

    mean = g' b + c' v,    variance = sigma^2 [rho - c' C^-1 c + h' (F' C^-1 F)^-1 h],    h = g - F' C^-1 c.

The band is that of the effect, not an average of pointwise bands: errors that cancel in the average do not
count. Correlation and trend are products over the inputs, so averages over independent inputs are products of
one-dimensional sums.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri
from sklearn.utils.validation import check_is_fitted

from ..kriging.estimator import Kriging
from ..kriging.posterior import Posterior
from .averages import Averages
from .carried_effects import carried_curves
from .measure import Measure, resolve
from .paths import Paths
from .response_map import ResponseMap

__all__ = ["Effect", "accumulated_local_effect", "main_effects", "partial_dependence"]

Array = NDArray[np.float64]

PATHS, FEATURES = 100, 200  # drawn where effects are carried back from another scale


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """An effect of one input.

    Attributes:
        input: its column.   x: (g,) values, in the coordinates of X.
        mean, std: (g,) posterior mean and standard deviation, unit of y.
        lower, upper: (g,) ends of the band.   level: its probability at every x.
    """

    input: int
    x: Array
    mean: Array
    std: Array
    lower: Array
    upper: Array
    level: float


def _effect(posterior: Posterior, k: int, x: Array, c: Array, g: Array, rho: Array, level: float) -> Effect:
    """The record from cross correlations c (m, n), trend g (m, p) and prior variances rho (m,)."""
    _check_level(level)
    a, h = posterior._reduce(c, g)
    variance = rho - np.einsum("ij,ij->j", a, a) + np.einsum("ij,ij->j", h, h)
    std = posterior.scale * np.sqrt(posterior.sigma2 * np.maximum(variance, 0.0))
    mean = posterior.scale * (g @ posterior.coefficients + c @ posterior.weights)
    half = float(ndtri(0.5 + level / 2)) * std
    return Effect(input=k, x=x, mean=mean, std=std, lower=mean - half, upper=mean + half, level=level)


def _check_level(level: float) -> None:
    if not 0.0 < level < 1.0:
        raise ValueError(f"level needs a probability between 0 and 1, got {level}")


def _shifted(effect: Effect, by: float) -> Effect:
    return Effect(
        input=effect.input,
        x=effect.x,
        mean=effect.mean + by,
        std=effect.std,
        lower=effect.lower + by,
        upper=effect.upper + by,
        level=effect.level,
    )


def _product(arrays: Sequence[Array], *, without: int | None = None) -> Array:
    kept = [a for k, a in enumerate(arrays) if k != without]
    return np.asarray(np.prod(np.stack(kept), axis=0)) if kept else np.ones_like(arrays[0])


def column(k: int, d: int, name: str) -> int:
    """k as an input of d, counted from the end where it is negative.

    >>> column(-1, 4, "k")
    3
    """
    if not -d <= k < d:
        raise ValueError(f"{name} needs inputs from 0 to {d - 1}, got {k}")
    return int(k) % d


def main_effects(
    kriging: Kriging,
    *,
    inputs: Sequence[int] | None = None,
    points: int = 41,
    measures: Sequence[Measure | None] | None = None,
    level: float = 0.95,
    centred: bool = False,
    carried: ResponseMap | None = None,
) -> tuple[Effect, ...]:
    """Main effects E[y | x_k] over the other inputs, with the posterior band of the effect.

    Args:
        inputs: columns wanted, all by default.   points: values of x per input, at most (all levels of a
            label).
        measures: weights of the inputs, see `surrogates.analysis.measure`; None is uniform.
        centred: subtract the mean over all inputs, in the effect and in its band.
        carried: the map of a response y that `kriging` is a model of, `carried.forward(y)`: effects are of y,
            from 100 drawn paths, not centred.

    >>> x = np.random.default_rng(0).random((30, 2))
    >>> effects = main_effects(Kriging().fit(x, 3 * x[:, 0]), points=3)
    >>> print(effects[0].mean.round(2) + 0.0, effects[1].mean.round(2))
    [0.  1.5 3. ] [1.5 1.5 1.5]
    """
    check_is_fitted(kriging)
    posterior = kriging.posterior_
    resolved = resolve(posterior, measures)
    averages = Averages(posterior, resolved)
    d = posterior.u.shape[1]
    chosen = range(d) if inputs is None else [column(k, d, "inputs") for k in inputs]
    if carried is not None and carried.scale != "none":
        if centred:
            raise ValueError("effects that are carried back to the response are not centred: leave one out")
        return _carried_effects(kriging, averages, resolved, chosen, points, level, carried)
    overall_c, overall_g = _product(averages.to_runs), _product(averages.trend)
    effects = []
    for k in chosen:
        m = resolved[k]
        x = _places(m, points if k not in posterior.correlation.labels else len(m.points))
        u = (x - posterior.scaling.low[k]) / posterior.scaling.width[k] - 0.5
        c = averages.along(k, u) * _product(averages.to_runs, without=k)
        g = averages.powers(k, u) * _product(averages.trend, without=k)
        rest = float(np.prod([w for j, w in enumerate(averages.within) if j != k]))
        rho = np.full(len(x), rest)
        if centred:
            to_mean = averages.between(k, u, averages.points[k]) @ averages.weights[k]
            rho = rest * (1.0 - 2.0 * to_mean + averages.within[k])
            c, g = c - overall_c, g - overall_g
        effect = _effect(posterior, k, x, c, g, rho, level)
        effects.append(effect if centred else _shifted(effect, posterior.shift))
    return tuple(effects)


def _carried_effects(
    kriging: Kriging,
    averages: Averages,
    measures: Sequence[Measure],
    chosen: Sequence[int],
    points: int,
    level: float,
    carried: ResponseMap,
) -> tuple[Effect, ...]:
    """Main effects of what a map carries paths back to: mean and quantiles of drawn ones."""
    _check_level(level)
    p = averages.posterior
    paths = Paths(
        p,
        averages,
        kriging._diagonal,
        draws=PATHS,
        features=FEATURES,
        rng=np.random.default_rng(kriging.seed),
    )
    x = {
        k: _places(measures[k], points if k not in p.correlation.labels else len(measures[k].points))
        for k in chosen
    }
    scaled = [
        (x[k] - p.scaling.low[k]) / p.scaling.width[k] - 0.5 if k in x else None for k in range(len(p.theta))
    ]
    curves = carried_curves(paths, scaled, lambda values: carried.inverse(p.shift + p.scale * values))
    found = []
    for k in chosen:
        drawn = np.asarray(curves[k])[:, 1:]
        ends = 0.5 - 0.5 * level, 0.5 + 0.5 * level
        lower, upper = np.quantile(drawn, ends, axis=1, method="weibull")  # of one more draw
        found.append(
            Effect(
                input=k,
                x=x[k],
                mean=drawn.mean(axis=1),
                std=drawn.std(axis=1),
                lower=lower,
                upper=upper,
                level=level,
            )
        )
    return tuple(found)


def _places(measure: Measure, points: int) -> Array:
    """Where a curve over the input is drawn: along the interval, or at its levels, evenly thinned out."""
    if not measure.levels:
        return np.linspace(measure.low, measure.high, points)
    levels = np.unique(measure.points)
    kept = np.linspace(0, len(levels) - 1, min(points, len(levels)))
    return np.asarray(levels[np.rint(kept).astype(int)])


def partial_dependence(
    kriging: Kriging, X: ArrayLike, k: int, *, points: int = 41, level: float = 0.95
) -> Effect:
    """Mean response over the rows of X with input k set to each of `points` values, with its posterior band.

    Unlike `main_effects` the other inputs keep the joint distribution of X (m, d).
    """
    sample, posterior = kriging._points(X), kriging.posterior_
    k = column(k, sample.shape[1], "k")
    x = _values(sample, k, points, posterior)
    u = posterior.scaling(sample)
    c = np.empty((len(x), len(posterior.u)))
    g = np.empty((len(x), posterior.f.shape[1]))
    for i, value in enumerate(x):
        moved = sample.copy()
        moved[:, k] = value
        at = posterior.scaling(moved)
        c[i] = posterior.correlation.cross(at, posterior.u, posterior.theta).mean(axis=0)
        g[i] = posterior.trend(at, moved).mean(axis=0)
    u[:, k] = 0.0
    rho = np.full(len(x), float(posterior.correlation.matrix(u, posterior.theta).mean()))
    return _shifted(_effect(posterior, k, x, c, g, rho, level), posterior.shift)


def accumulated_local_effect(
    kriging: Kriging, X: ArrayLike, k: int, *, bins: int = 20, level: float = 0.95
) -> Effect:
    """Accumulated local effect of input k over the rows of X (m, d), with its posterior band.

    In each of `bins` quantile bins the mean change of the response across the bin, summed up and centred:
    Apley and Zhu (2020), Journal of the Royal Statistical Society B 82, 1059-1086. Right where inputs are
    correlated.
    """
    sample, posterior = kriging._points(X), kriging.posterior_
    k = column(k, sample.shape[1], "k")
    if k in posterior.correlation.labels:
        raise ValueError(f"input {k} holds labels, which have no order to accumulate along")
    edges = np.unique(np.quantile(sample[:, k], np.linspace(0.0, 1.0, bins + 1)))
    if len(edges) < 2:
        raise ValueError(f"input {k} never changes in X: there is nothing to accumulate")
    m, cells = len(sample), len(edges) - 1
    cell = np.clip(np.searchsorted(edges, sample[:, k], side="left") - 1, 0, cells - 1)
    below, above = sample.copy(), sample.copy()
    below[:, k], above[:, k] = edges[cell], edges[cell + 1]
    local = np.zeros((cells, m))
    counts = np.bincount(cell, minlength=cells)
    local[cell, np.arange(m)] = 1.0 / counts[cell]
    summed = np.concatenate([np.zeros((1, m)), np.cumsum(local, axis=0)])
    middle = 0.5 * (summed[1:] + summed[:-1])
    summed = summed - (counts / m) @ middle
    a = np.concatenate([-summed, summed], axis=1)
    both = np.concatenate([below, above])
    u = posterior.scaling(both)
    c = a @ posterior.correlation.cross(u, posterior.u, posterior.theta)
    g = a @ posterior.trend(u, both)
    rho = np.einsum("ij,ij->i", a, a @ posterior.correlation.matrix(u, posterior.theta))
    return _effect(posterior, k, edges, c, g, rho, level)


def _values(sample: Array, k: int, points: int, posterior: Posterior) -> Array:
    levels = np.unique(sample[:, k])
    if k in posterior.correlation.labels or len(levels) <= min(points, 10):
        return levels
    return np.linspace(levels[0], levels[-1], points)
