"""Elementary effects of inputs, from runs along trajectories.

Morris, Technometrics 33 (1991), 161-174, with the mean of absolute effects of Campolongo, Cariboni &
Saltelli, Environ. Model. Softw. 22 (2007), 1509-1518.

A trajectory starts at a random grid point of the unit cube and moves one input after the other by delta,
in random order: d + 1 runs give one elementary effect of every input. Needs runs of its own, and no model
of the response; where runs can be chosen and are not noisy it is hard to beat for telling the inert from
the active.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["MorrisEffects", "morris_effects", "morris_points"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class MorrisEffects:
    """Elementary effects and their summary.

    Attributes:
        effects: (r, d), change of the response per unit of the cube.
        mu: (d,) mean.   mu_star: (d,) mean of absolute effects.
        sigma: (d,) standard deviation; nan for r = 1.
        ranking: (d,) inputs by mu_star, largest first.
        n_runs: r (d + 1).
    """

    effects: Array
    mu: Array
    mu_star: Array
    sigma: Array
    ranking: NDArray[np.intp]
    n_runs: int


def morris_points(d: int, trajectories: int, *, levels: int = 4, rng: np.random.Generator) -> Array:
    """Points of `trajectories` trajectories in [0, 1]^d, (trajectories * (d + 1), d), in the order to run.

    delta = levels / (2 (levels - 1)), which makes all levels equally likely when `levels` is even.

    >>> x = morris_points(3, 2, rng=np.random.default_rng(0))
    >>> x.shape, np.count_nonzero(np.diff(x[:4], axis=0), axis=1)
    ((8, 3), array([1, 1, 1]))
    """
    if d < 1 or trajectories < 1:
        raise ValueError(f"d and trajectories need at least 1, got d={d} and trajectories={trajectories}")
    if levels < 2 or levels % 2:
        raise ValueError(f"levels needs an even number from 2 on, got {levels}")
    delta = levels / (2.0 * (levels - 1.0))
    grid = np.arange(levels // 2) / (levels - 1.0)  # from these a step of +delta stays in the cube
    points = np.empty((trajectories, d + 1, d))
    for r in range(trajectories):
        low = rng.choice(grid, d)
        up = rng.random(d) < 0.5
        here = np.where(up, low, low + delta)
        points[r, 0] = here
        for i, k in enumerate(rng.permutation(d)):
            here = here.copy()
            here[k] += delta if up[k] else -delta
            points[r, i + 1] = here
    return points.reshape(-1, d)


def morris_effects(points: ArrayLike, y: ArrayLike) -> MorrisEffects:
    """Elementary effects of runs on `morris_points`.

    Raises ValueError when the points are not whole trajectories or a response is not finite (naming the run).

    >>> x = morris_points(3, 4, rng=np.random.default_rng(0))
    >>> morris_effects(x, 2 * x[:, 0] - 5 * x[:, 2]).mu_star.round(9)
    array([2., 0., 5.])
    """
    x, y = np.asarray(points, dtype=float), np.asarray(y, dtype=float)
    n, d = x.shape
    if n % (d + 1) or len(y) != n:
        raise ValueError(
            f"morris_effects needs trajectories of {d + 1} runs of {d} inputs and one response each, "
            f"got {n} runs and {len(y)} responses"
        )
    if not np.isfinite(y).all():
        run = int(np.flatnonzero(~np.isfinite(y))[0])
        raise ValueError(f"response of run {run} is not finite: its trajectory must be run again or left out")
    step = np.diff(x.reshape(-1, d + 1, d), axis=1)
    moved = np.argmax(np.abs(step), axis=2)
    if (np.count_nonzero(step, axis=2) != 1).any() or (np.sort(moved, axis=1) != np.arange(d)).any():
        raise ValueError("points are not Morris trajectories: each step must move one input, each input once")
    change = np.diff(y.reshape(-1, d + 1), axis=1)
    effects = np.empty((len(moved), d))
    rows = np.arange(len(moved))[:, None]
    effects[rows, moved] = change / np.take_along_axis(step, moved[:, :, None], axis=2)[:, :, 0]
    mu_star = np.abs(effects).mean(axis=0)
    sigma = effects.std(axis=0, ddof=1) if len(effects) > 1 else np.full(d, np.nan)
    return MorrisEffects(
        effects=effects,
        mu=effects.mean(axis=0),
        mu_star=mu_star,
        sigma=sigma,
        ranking=np.argsort(-mu_star, kind="stable").astype(np.intp),
        n_runs=n,
    )
