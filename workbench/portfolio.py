"""Which points a worst-case search runs next: a portfolio of proposals in turn.

    ucb          the largest upper confidence bound, half a deviation above the mean: finds corners at once,
                 follows a slope, and keeps off the runs, where a step that gains little teaches little
    predicted    the predicted worst point                            refines, at the end of the budget
    ei           the largest expected improvement                     balances
    cautious     the same under the cautious model                    keeps looking where runs are few
    combination  the largest expected improvement inside the least often run of the discrete combinations
                 whose upper bound exceeds the worst run: none is dropped while it could still hold the worst
    flip         one coordinate of the worst run moved to another level or to its other end
    trust        the predicted worst inside a box around the worst run
    hill         around the top of the next hill (`workbench.hills`), by a model of the runs near it: by turns
                 the largest expected gain over it and the largest upper confidence bound
    explore      the highest upper bound of the roughest credible model among random points

As long as runs gain, expected improvement and upper confidence bound take turns. A turn that promises no
noticeable gain goes to the next hill, else to the cautious model, else to an exploration; after a stall the
turns are shared out among all proposals.

Every proposal is multiplied with the chance that the run succeeds, and none lies closer than `CLOSEST` to a
run already made.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from workbench.feasibility import Feasibility
from workbench.hills import HALF_WIDTH, next_hill
from workbench.infill import maximise_score
from workbench.search_model import SearchModel, fit_local_model, fit_rough_model
from workbench.search_space import SearchSpace

__all__ = ["Batch", "predicted_worst", "propose"]

Score = Callable[[np.ndarray], np.ndarray]

CLOSEST = 1e-3  # of the unit cube, largest coordinate: closer points tell a Kriging nothing but rounding
RANDOM_POINTS = 2000
STARTS = 6
EVEN = 0.49
TRUSTED = 0.1  # of the unit cube, half the width of the box around the worst run
LEAN = 0.5  # deviations by which an upper confidence bound lies above the mean
AVERSION = 3.0  # power of the chance of success in an expected improvement: a failed run teaches little
EXPLORED = 300  # random points that an exploration chooses from
NORMAL = ("ei", "ucb")
STALLED = (
    "hill", "hill", "explore", "hill", "hill", "ei", "hill", "hill", "cautious", "hill", "trust", "flip",
)  # fmt: skip
FINISHING = ("predicted", "predicted", "trust")
LOCAL = ("ucb", "predicted", "trust", "flip")  # given up where one deviation holds no noticeable gain
SOUGHT = ("ei", "cautious")  # given up where two deviations hold none
ELSEWHERE = ("hill", "cautious", "explore")  # what takes a turn that holds no gain, the first that may
VALLEY = 0.03  # of the range of the values: how deep a valley parts two hills
DOUBT = 1.0  # deviations: a valley that deep is not excluded by the runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Points (m, d) to run next; predictions (m,) of the signed response, with their standard deviations."""

    u: np.ndarray
    proposals: tuple[str, ...]
    predicted: np.ndarray
    std: np.ndarray


def propose(
    where: SearchSpace,
    model: SearchModel,
    *,
    u: np.ndarray,
    u_ok: np.ndarray,
    v: np.ndarray,
    incumbent: np.ndarray,
    feasibility: Feasibility,
    iteration: int,
    stalled: bool,
    finishing: bool,
    size: int,
    rng: np.random.Generator,
) -> Batch:
    """Up to `size` points for runs made at u (n, d), failed ones included; those at u_ok (m, d) gave values
    v (m,), and `incumbent` (d,) is the worst of them.

    `stalled`: nothing gained for long. `finishing`: the last runs of the budget, which refine the worst run.

    Fewer come back when no admissible point is left.
    """
    turns = list(FINISHING if finishing else STALLED if stalled else NORMAL)
    elsewhere: tuple[str, ...] = () if finishing else ELSEWHERE
    if where.combinations() is not None and not where.is_finite and not finishing:
        for at in range(len(turns) // 2, 0, -1):
            turns.insert(2 * at, "combination")
        elsewhere = ("combination", *ELSEWHERE) if iteration % 3 == 0 else ELSEWHERE
    pool = _pool(where, incumbent, rng)
    # with levels, every combination of them would be a hill, and rough models explore where runs fail
    is_smooth = not finishing and not where.discrete
    hill = _next_hill(where, model, u_ok=u_ok, v=v, rng=rng) if is_smooth else None
    rough: SearchModel | None = None

    def best_of(name: str, taken: np.ndarray) -> np.ndarray | None:
        nonlocal rough
        if name == "hill":
            return None if hill is None else _climb(hill, where, model, taken=taken, feasibility=feasibility)
        judge = model
        if name == "explore" and is_smooth:
            # the model of the search may hold all but the known peak for flat
            seed = model.kriging.seed
            rough = rough or fit_rough_model(where.features(u_ok), v, model, seed=seed)
            judge = rough
        return _best(name, where, judge, taken=taken, incumbent=incumbent, feasibility=feasibility, pool=pool)

    def promising(name: str, taken: np.ndarray) -> np.ndarray | None:
        point = best_of(name, taken)
        vain = point is not None and not finishing and _is_vain(name, model, where.features(point[None]))
        return None if vain else point

    chosen: list[np.ndarray] = []
    names: list[str] = []
    attempt = 0
    while len(chosen) < size and attempt < size + len(turns):
        name = turns[(iteration + attempt) % len(turns)]
        attempt += 1
        taken = np.vstack([u, *chosen]) if chosen else u
        for other in dict.fromkeys((name, *elsewhere)):
            point = promising(other, taken)
            if point is not None:
                chosen.append(point[None])
                names.append(other)
                break
    points = np.vstack(chosen) if chosen else np.empty((0, where.dimension))
    mean, std = model.in_units(where.features(points)) if chosen else (np.empty(0), np.empty(0))
    return Batch(u=points, proposals=tuple(names), predicted=mean, std=std)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Hill:
    """The hill to climb next: its top (d,), the value there, a model of the runs around it, starts (m, d)."""

    top: np.ndarray
    value: float
    model: SearchModel
    pool: np.ndarray


def _next_hill(
    where: SearchSpace, model: SearchModel, *, u_ok: np.ndarray, v: np.ndarray, rng: np.random.Generator
) -> _Hill | None:
    judge, depth = model.cautious or model, VALLEY * float(np.ptp(v))
    index = next_hill(
        u_ok,
        v,
        lambda points: judge.bound(where.features(points), -DOUBT),
        depth=depth,
        gain=model.noticeable,
    )
    if index is None:
        return None
    features = where.features(u_ok)
    return _Hill(
        top=u_ok[index],
        value=float(v[index]),
        model=fit_local_model(features, v, features[index], seed=model.kriging.seed),
        pool=_pool(where, u_ok[index], rng),
    )


def _climb(
    hill: _Hill, where: SearchSpace, model: SearchModel, *, taken: np.ndarray, feasibility: Feasibility
) -> np.ndarray | None:
    """By turns the best bound of the box around the top, where the mean gains, and the best expected gain."""

    def best(name: str, target: float | None) -> np.ndarray | None:
        return _best(
            name,
            where,
            hill.model,
            taken=taken,
            incumbent=hill.top,
            feasibility=feasibility,
            pool=hill.pool,
            target=target,
            levels=_box(where, hill.top, HALF_WIDTH, 81),
        )

    if len(taken) % 2:
        point = best("ucb", None)
        gains = point is not None and (
            hill.model.mean(where.features(point[None]))[0] >= hill.value + model.noticeable
        )
        if gains:
            return point
    return best("ei", hill.value)


def _is_vain(name: str, model: SearchModel, features: np.ndarray) -> bool:
    """Whether a point promises no noticeable gain, within one deviation to refine and two to seek."""
    if name in LOCAL:
        return not model.promises(features, 1.0)
    return name in SOUGHT and not any(m.promises(features, 2.0) for m in (model, model.cautious or model))


def predicted_worst(
    where: SearchSpace,
    model: SearchModel,
    *,
    incumbent: np.ndarray,
    feasibility: Feasibility,
    rng: np.random.Generator,
) -> np.ndarray:
    """The point (d,) of the largest predicted value, runs themselves included."""
    none = np.empty((0, where.dimension))
    pool = _pool(where, incumbent, rng)
    point = _best(
        "predicted", where, model, taken=none, incumbent=incumbent, feasibility=feasibility, pool=pool
    )
    return incumbent if point is None else point


def _best(
    name: str,
    where: SearchSpace,
    model: SearchModel,
    *,
    taken: np.ndarray,
    incumbent: np.ndarray,
    feasibility: Feasibility,
    pool: np.ndarray,
    target: float | None = None,
    levels: list[np.ndarray | None] | None = None,
) -> np.ndarray | None:
    """The admissible point of the highest score of the proposal `name` on the given levels, or None.

    `target`: what an expected improvement counts from, the best run by default.
    """
    levels = list(where.levels) if levels is None else levels
    judge = (model.cautious or model) if name in ("cautious", "combination") else model
    acquisition = _acquisition(name, judge, target)
    if name == "combination":
        levels = _open_combination(where, judge, pool, taken)
    elif name == "trust":
        levels = _box(where, incumbent, TRUSTED, 11)
    elif name == "flip":
        pool = _flips(where, incumbent)
    elif name == "explore":
        pool = pool[:EXPLORED]
    start = _inside(pool, levels)

    def score(points: np.ndarray) -> np.ndarray:
        features = where.features(points)
        value = acquisition(features, feasibility.probability(features))
        free = where.allowed(points)
        if len(taken):
            free &= cdist(points, taken, "chebyshev").min(axis=1) > CLOSEST
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
        return lambda features, chance: model.warped_bound(features, 3.0) + model.scale * np.log(chance)
    if name in ("ei", "cautious", "combination"):
        return lambda features, chance: model.log_ei(features, target) + AVERSION * np.log(chance)
    lean = LEAN if name == "ucb" else 0.0

    def leant(features: np.ndarray, chance: np.ndarray) -> np.ndarray:
        mean, std = model.predict(features)
        # an even chance is good enough for the predicted worst, which often lies where the failures begin
        return np.where(chance >= EVEN, mean + lean * std, -np.inf)

    return leant


def _pool(where: SearchSpace, incumbent: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Random points, random corners, and the worst run with its flips: starts of every proposal."""
    d = where.dimension
    inside = rng.random((RANDOM_POINTS, d))
    corners = rng.integers(0, 2, (200, d)).astype(float)
    near = np.clip(incumbent + 0.1 * rng.standard_normal((200, d)), 0, 1)
    return where.snap(np.vstack([inside, corners, near, incumbent[None], _flips(where, incumbent)]))


def _flips(where: SearchSpace, incumbent: np.ndarray) -> np.ndarray:
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
        bounds[i] = model.warped_bound(where.features(points), 3.0).max()
        runs[i] = np.all(np.abs(taken[:, discrete] - combination) < 1e-9, axis=1).sum()
    best = float(model.warp.forward(np.array([model.best]))[0])
    held = np.flatnonzero(bounds > best) if (bounds > best).any() else np.arange(len(bounds))
    held = held[runs[held] == runs[held].min()]
    chosen = combinations[held[int(np.argmax(bounds[held]))]]
    levels: list[np.ndarray | None] = list(where.levels)
    for j, value in zip(discrete, chosen, strict=True):
        levels[j] = np.array([value])
    return levels


def _box(where: SearchSpace, centre: np.ndarray, half: float, count: int) -> list[np.ndarray | None]:
    """Continuous coordinates cut to `count` values within `half` of a point (d,)."""
    levels: list[np.ndarray | None] = list(where.levels)
    for j, grid in enumerate(where.levels):
        if grid is None:
            levels[j] = np.unique(np.clip(centre[j] + half * np.linspace(-1, 1, count), 0, 1))
    return levels
