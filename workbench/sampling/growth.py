"""More runs beside those already made, and blocks that are alike.

Without constraints new runs take the empty strata of the whole, spread as `doe.augment` does from several
starts: a Latin hypercube grown to twice its runs is one again. Otherwise they keep the levels balanced over
old and new together, meet the constraints, and lie where the old ones leave gaps (largest smallest distance;
Kennard & Stone 1969), or where they tell most about a regression model.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

import doe
from workbench.errors import StudyError
from workbench.sampling.factors import Factors
from workbench.sampling.kinds import DEFAULT, DesignOptions
from workbench.sampling.points import points_of_kind
from workbench.sampling.spread_beside import CRITERIA, place, spread_beside
from workbench.space.box import Space
from workbench.space.streams import stream

__all__ = ["Further", "balanced_blocks", "further_runs"]

# candidates per new run among which the gaps are looked for
PER_RUN = 40
FEWEST = 1000
# distance, in units of the cube's side, by which a candidate counts as nearer per surplus run on its level
SURPLUS = 0.1
MOST_PASSES = 20
# runs up to which new ones are spread over the empty strata
MOST_SPREAD = 2_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Further:
    """New runs, and what they cost.

    points: (m, d) unit points
    beside_fresh: {phi_p | cd2 | max_correlation: (of old and new together, of as many runs drawn at once)};
    empty where the two cannot be compared
    """

    points: np.ndarray
    beside_fresh: Mapping[str, tuple[float, float]]


def further_runs(
    space: Space, unit: np.ndarray, runs: int, *, seed: int, rng: np.random.Generator, model: str | None
) -> Further:
    """`runs` new unit points beside `unit` (n, d), each admissible and different from the others.

    seed: of the design that they are compared with
    """
    n = len(unit) + runs
    fresh = _drawn_at_once(space, n, seed) if model is None and n <= MOST_SPREAD else {}
    factors = Factors(space, follow=False)
    continuous = any(levels is None for levels in factors.levels)
    if model is None and continuous and not space.constraints and n <= MOST_SPREAD:
        wanted = dict(zip(CRITERIA, fresh.values(), strict=True)) if fresh else None
        points = spread_beside(factors, unit, runs, wanted, rng=rng)
    else:
        points = _chosen(factors, unit, runs, rng, model)
    grown = _criteria(np.vstack([unit, points])) if fresh else {}
    both = {name: (grown[name], value) for name, value in fresh.items()}
    return Further(points=points, beside_fresh=both if np.isfinite(list(both.values())).all() else {})


def _drawn_at_once(space: Space, n: int, seed: int) -> dict[str, float]:
    """The criteria of a design of the default kind; none of one that goes by distributions, which is denser
    where they are, or by constraints."""
    if space.constraints or n < 2 or any(p.distribution is not None for p in space.parameters):
        return {}
    rng = stream(seed, "drawn at once", replicate=n)
    return _criteria(points_of_kind(space, DEFAULT, n, rng=rng, options=DesignOptions())[0])


def _criteria(unit: np.ndarray) -> dict[str, float]:
    return {
        "phi_p": doe.phi_p(unit),
        "cd2": doe.cd2(unit),
        "max_correlation": doe.max_correlation(unit) if unit.shape[1] > 1 else 0.0,
    }


def _chosen(
    factors: Factors, unit: np.ndarray, runs: int, rng: np.random.Generator, model: str | None
) -> np.ndarray:
    """New points from a pool of feasible ones: where gaps are, or best for a model."""
    pool = factors.pool(max(FEWEST, PER_RUN * runs), rng)
    if len(pool) < runs:
        raise StudyError(f"the space holds {len(pool)} different feasible points, {runs} more are asked for")
    if model is not None:
        return pool[doe.exchange(pool, runs, model=factors.model(model), existing=unit, rng=rng)]
    nearest = cdist(pool, unit).min(axis=1)
    counts = [
        None
        if levels is None
        else np.bincount(place(unit[:, j], levels), minlength=len(levels)).astype(float)
        for j, levels in enumerate(factors.levels)
    ]
    codes = [None if v is None else place(pool[:, j], v) for j, v in enumerate(factors.levels)]
    chosen = []
    for _ in range(runs):
        surplus = np.zeros(len(pool))
        for count, code in zip(counts, codes, strict=True):
            if count is not None and code is not None:
                surplus += (count - count.min())[code]
        k = int(np.argmax(nearest - SURPLUS * surplus))
        chosen.append(k)
        nearest = np.minimum(nearest, cdist(pool, pool[[k]])[:, 0])
        nearest[k] = -np.inf
        for count, code in zip(counts, codes, strict=True):
            if count is not None and code is not None:
                count[code[k]] += 1
    return pool[chosen]


def balanced_blocks(unit: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Block numbers (n,) after swaps of runs between blocks that bring the blocks' means together."""
    number = number.copy()
    centred = unit - unit.mean(axis=0)
    sums = np.array([centred[number == b].sum(axis=0) for b in range(number.max() + 1)])
    sizes = np.bincount(number)
    for _ in range(MOST_PASSES):
        moved = False
        for i in range(len(unit)):
            a = number[i]
            shift = centred - centred[i]  # what block a gains when run j comes for run i
            change = (np.sum((sums[a] + shift) ** 2, axis=1) - np.sum(sums[a] ** 2)) / sizes[a]
            change += np.sum((sums[number] - shift) ** 2 - sums[number] ** 2, axis=1) / sizes[number]
            change[number == a] = 0.0
            j = int(np.argmin(change))
            if change[j] < -1e-12:
                b = number[j]
                sums[a] += shift[j]
                sums[b] -= shift[j]
                number[i], number[j] = b, a
                moved = True
        if not moved:
            break
    return number
