"""The best point of one proposal of a worst-case search: its score, its starts, the levels it moves on.

The proposals are described in `workbench.search.proposals.portfolio`, which gives them their turns.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial.distance import cdist

from workbench.search.proposals.known import Known
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.pattern_search import maximise_score

__all__ = ["best_point", "box_levels", "start_pool"]

CLOSEST = 1e-3  # of the unit cube, largest coordinate: closer points tell a Kriging nothing but rounding
APART = 0.05  # the same between the points of one batch, whose values do not guide each other
RANDOM_POINTS = 2000
STARTS = 6
TRUSTED = 0.1  # of the unit cube, half the width of the box around the worst run
LEAN = 0.5  # deviations by which an upper confidence bound lies above the mean
AVERSION = 2.0  # power of the chance of success in an expected improvement: a failed run teaches little
EXPLORED = 300  # random points that an exploration chooses from


def best_point(
    name: str,
    known: Known,
    pool: np.ndarray,
    *,
    target: float | None = None,
    levels: list[np.ndarray | None] | None = None,
) -> np.ndarray | None:
    """The admissible point (d,) of the highest score of the proposal `name` on the given levels, or None.

    Args:
        pool: (m, d) points to start from.
        target: what an expected improvement counts from, the best run by default.
        levels: per coordinate the values that may be proposed, those of the space by default.
    """
    where, model, incumbent = known.where, known.model, known.incumbent
    levels = list(where.levels) if levels is None else levels
    judge = (model.cautious or model) if name in ("cautious", "combination") else model
    acquisition = _acquisition(name, judge, target)
    if name == "combination":
        levels = _open_combination(where, judge, pool, known.u)
    elif name == "trust":
        levels = box_levels(where, incumbent, TRUSTED, 11)
    elif name == "flip":
        pool = _single_changes(where, incumbent)
    elif name == "explore":
        pool = pool[:EXPLORED]
    start = _inside(pool, levels)

    def score(points: np.ndarray) -> np.ndarray:
        features = where.features(points)
        chance = known.success.probability(features)
        value = acquisition(features, chance)
        free = where.allowed(points) & (chance >= known.least_chance)
        for others, least in ((known.u, CLOSEST), (known.under_way, APART)):
            if len(others):
                free &= cdist(points, others, "chebyshev").min(axis=1) > least
        return np.where(free, value, -np.inf)

    scores = score(start)
    order = np.argsort(scores)[::-1][:STARTS]
    order = order[np.isfinite(scores[order])]
    if not len(order):
        return None
    if name in ("flip", "explore"):
        # a climb on the bound would end in a corner every time, where responses seldom hide a second peak
        best: np.ndarray = start[order[0]]
        return best
    points, values = maximise_score(score, start[order], levels)
    best = points[int(np.argmax(values))]
    return best if np.isfinite(values.max()) else None


def _acquisition(
    name: str, model: SearchModel, target: float | None = None
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """The score of a proposal on features (m, p) with chances of success (m,)."""
    if name == "explore":
        return lambda features, chance: model.transformed_bound(features, 3.0) + model.scale * np.log(chance)
    if name in ("ei", "cautious", "combination"):
        return lambda features, chance: model.log_ei(features, target) + AVERSION * np.log(chance)
    lean = LEAN if name == "ucb" else 0.0

    def leant(features: np.ndarray, chance: np.ndarray) -> np.ndarray:
        mean, std = model.predict(features)
        # the predicted worst often lies where the failures begin: the chance is not weighed there
        return mean + lean * std

    return leant


def start_pool(where: SearchSpace, incumbent: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Random points, random corners, and the worst run with its single changes: starts of every proposal."""
    d = where.dimension
    inside = rng.random((RANDOM_POINTS, d))
    corners = rng.integers(0, 2, (200, d)).astype(float)
    near = np.clip(incumbent + 0.1 * rng.standard_normal((200, d)), 0, 1)
    return where.snap(np.vstack([inside, corners, near, incumbent[None], _single_changes(where, incumbent)]))


def _single_changes(where: SearchSpace, incumbent: np.ndarray) -> np.ndarray:
    """The worst run with one coordinate at another level, or at either end when continuous."""
    out = []
    for j, grid in enumerate(where.levels):
        for value in (0.0, 1.0) if grid is None else grid[:64]:
            if value != incumbent[j]:
                point = incumbent.copy()
                point[j] = value
                out.append(point)
    return np.array(out)


def _inside(pool: np.ndarray, levels: list[np.ndarray | None]) -> np.ndarray:
    """The pool moved onto the levels in force."""
    out = pool.copy()
    for j, grid in enumerate(levels):
        if grid is not None:
            out[:, j] = grid[np.abs(out[:, j, None] - grid).argmin(axis=1)]
    return np.unique(out, axis=0)


def _open_combination(
    where: SearchSpace, model: SearchModel, pool: np.ndarray, taken: np.ndarray
) -> list[np.ndarray | None]:
    """Levels with the discrete coordinates held at a combination that could still hold the worst.

    Of the combinations whose upper bound over the pool exceeds the best run (of all, when there are none) the
    least often run one, and of those the one of the highest bound: a combination that was never run may hold
    an interaction that no model of the others can foresee.
    """
    combinations = where.combinations()
    assert combinations is not None
    discrete = list(where.discrete)
    sample = pool[:: max(1, len(pool) // 200)]
    bounds, runs = np.empty(len(combinations)), np.empty(len(combinations))
    for i, combination in enumerate(combinations):
        points = sample.copy()
        points[:, discrete] = combination
        bounds[i] = model.transformed_bound(where.features(points), 3.0).max()
        runs[i] = np.all(np.abs(taken[:, discrete] - combination) < 1e-9, axis=1).sum()
    best = float(model.transform.forward(np.array([model.best]))[0])
    held = np.flatnonzero(bounds > best) if (bounds > best).any() else np.arange(len(bounds))
    held = held[runs[held] == runs[held].min()]
    chosen = combinations[held[int(np.argmax(bounds[held]))]]
    levels: list[np.ndarray | None] = list(where.levels)
    for j, value in zip(discrete, chosen, strict=True):
        levels[j] = np.array([value])
    return levels


def box_levels(where: SearchSpace, centre: np.ndarray, half: float, count: int) -> list[np.ndarray | None]:
    """Continuous coordinates cut to `count` values within `half` of a point (d,)."""
    levels: list[np.ndarray | None] = list(where.levels)
    for j, grid in enumerate(where.levels):
        if grid is None:
            levels[j] = np.unique(np.clip(centre[j] + half * np.linspace(-1, 1, count), 0, 1))
    return levels
