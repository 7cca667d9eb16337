"""More runs beside those already made, and blocks that are alike.

Without constraints new runs take the empty strata of the whole, spread as `doe.augment` does from several
starts: a Latin hypercube grown to twice its runs is one again. Otherwise they keep the levels balanced over
old and new together, meet the constraints, and lie where the old ones leave gaps (largest smallest distance;
Kennard & Stone 1969), or where they tell most about a regression model.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.distance import cdist

import doe
from workbench.errors import StudyError
from workbench.sampling.factors import Factors
from workbench.space.box import Space

__all__ = ["balanced_blocks", "further_points"]

# candidates per new run among which the gaps are looked for
PER_RUN = 40
FEWEST = 1000
# distance, in units of the cube's side, by which a candidate counts as nearer per surplus run on its level
SURPLUS = 0.1
MOST_PASSES = 20
# runs up to which new ones are spread over the empty strata
MOST_SPREAD = 2_000
# what they are spread by, beside the old ones, with weights; distances alone leave correlations of the whole
CRITERIA, WEIGHTS = ("phi_p", "cd2", "correlation"), (2.0, 1.0, 2.0)
# arrangements that are searched, each from a start of its own; the one of least excess is taken:
#     max over phi_p and CD2 of (value / best value seen - 1) + CORRELATION * largest correlation
STARTS, CORRELATION = 24, 1.0
# swaps of each: half a second of work together, but never fewer than the second
MOST_SWAPS, FEWEST_SWAPS = 100_000, 20_000
WORK = 6_000_000  # swaps times runs, of each start
# share of the swaps that put new runs on levels, before they are arranged there
PLACING = 5
# beyond so many runs, whose arrangements differ little, one long search is made
FEW, LONG = 200, 30_000_000


def further_points(
    space: Space, unit: np.ndarray, runs: int, *, rng: np.random.Generator, model: str | None
) -> np.ndarray:
    """`runs` new unit points beside `unit` (n, d), each admissible and different from the others."""
    factors = Factors(space, follow=False)
    continuous = any(levels is None for levels in factors.levels)
    if model is None and continuous and not space.constraints and len(unit) + runs <= MOST_SPREAD:
        return _empty_strata(factors, unit, runs, rng)
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


def _empty_strata(factors: Factors, unit: np.ndarray, runs: int, rng: np.random.Generator) -> np.ndarray:
    """New points in the empty strata; a level is an interval, on which its old runs are spread evenly."""
    old = unit.copy()
    for j, levels in enumerate(factors.levels):
        if levels is not None:
            code = place(unit[:, j], levels)
            for level in np.unique(code):
                on = np.flatnonzero(code == level)
                old[on, j] = (level + (np.arange(len(on)) + 0.5) / len(on)) / len(levels)
    n = len(unit) + runs
    starts = STARTS if n <= FEW else 1
    swaps = max(FEWEST_SWAPS, min(MOST_SWAPS, (WORK if starts > 1 else LONG) // n))
    found = []
    for _ in range(starts):
        if all(levels is None for levels in factors.levels):
            found.append(
                doe.search_augmentation(old, runs, criterion=CRITERIA, weights=WEIGHTS, swaps=swaps, rng=rng)
            )
            continue
        # strata say how many new runs come on each level; how they are arranged is judged on the levels
        placed = doe.search_augmentation(
            old, runs, criterion=CRITERIA, weights=WEIGHTS, swaps=swaps // PLACING, rng=rng
        )
        whole = np.vstack([unit, _on_levels(factors, placed.points[len(unit) :])])
        found.append(
            doe.search_rearrangement(whole, runs, criterion=CRITERIA, weights=WEIGHTS, swaps=swaps, rng=rng)
        )
    grown = found[int(np.argmin(_excess([result.values for result in found])))].points
    return _on_levels(factors, grown[len(unit) :])


def _on_levels(factors: Factors, points: np.ndarray) -> np.ndarray:
    """The points with every levelled coordinate on the level in whose interval it lies."""
    placed = points.copy()
    for j, levels in enumerate(factors.levels):
        if levels is not None:
            placed[:, j] = levels[np.minimum((points[:, j] * len(levels)).astype(int), len(levels) - 1)]
    return placed


def _excess(values: Sequence[Mapping[str, float]]) -> np.ndarray:
    """How far arrangements lie above the best values seen of phi_p and CD2, the larger share, with the
    correlation: (k,) of k results."""
    spread = np.array([[value[name] for name in CRITERIA[:2]] for value in values])
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.nan_to_num(spread / spread.min(axis=0) - 1.0, nan=0.0, posinf=0.0)  # runs that coincide
    worst: np.ndarray = share.max(axis=1) + CORRELATION * np.array(
        [v.get("correlation", 0.0) for v in values]
    )
    return worst


def place(values: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Number of the level of each value."""
    return np.abs(values[:, None] - levels).argmin(axis=1)


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
