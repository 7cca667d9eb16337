"""The first points of a search: few, space-filling, none when there are runs enough, more while runs fail."""

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.models.evaluator import Evaluator
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger, distinct
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.streams import stream

__all__ = ["begin", "far_points", "start_points", "start_size"]

START_TRIES = 200
NO_POINT = "no point of the space meets its constraints: loosen them or widen the bounds"
CANDIDATES = 4000  # random points that a far one is chosen from


def start_size(ledger: Ledger) -> int:
    """Runs of the start design: what brings the usable runs up to d + 2."""
    wanted = max(ledger.where.n_features + 2, FEWEST_RUNS)
    needed = max(wanted - int(ledger.ok.sum()), 0)
    return needed if ledger.points is None else min(needed, len(distinct(ledger.points, ledger.u)))


def start_points(ledger: Ledger, *, budget: int, seed: int) -> np.ndarray:
    """Space-filling points that bring the usable runs up to d + 2; none when there are enough."""
    where = ledger.where
    if ledger.points is not None and not len(ledger.points):
        raise StudyError(NO_POINT)
    needed = start_size(ledger)
    if needed and budget < needed:
        raise StudyError(
            f"budget={budget} is below the start design of {needed} runs for {where.dimension} parameters. "
            f"Raise the budget to at least {needed + 1}, or give runs already made with start="
        )
    if needed == 0:
        return np.empty((0, where.dimension))
    rng = stream(seed, "worst case start")
    drawn = where.snap(doe.optimised_lhs(needed, where.dimension, criterion="phi_p", swaps=20_000, rng=rng))
    allowed = drawn[where.allowed(drawn)]
    tries = 0
    while len(np.unique(allowed, axis=0)) < needed and tries < START_TRIES:
        more = where.snap(rng.random((max(200, 10 * needed), where.dimension)))
        allowed = np.vstack([allowed, more[where.allowed(more)]])
        tries += 1
    first = np.sort(np.unique(allowed, axis=0, return_index=True)[1])[:needed]
    if not len(first):
        raise StudyError(NO_POINT)
    points: np.ndarray = allowed[first]
    return points


def begin(evaluate: Evaluator, ledger: Ledger, *, budget: int, seed: int, workers: int = 1) -> int:
    """Run the start design, and more points while too few runs gave a value; returns the runs spent.

    Where much of the space fails, d + 2 runs may all fall into it: as long as there is budget, points far
    from all earlier ones follow. An error of the program, the same at every run, is no matter of the point
    and ends this at once.
    """
    points = start_points(ledger, budget=budget, seed=seed)
    while len(points):
        ledger.run(evaluate, points, purpose="start")
        missing = FEWEST_RUNS - int(ledger.ok.sum())
        if missing <= 0 or ledger.is_misprogrammed:
            break
        size = min(missing, max(workers, 1), budget - ledger.spent)
        rng = stream(seed, "worst case further start", replicate=ledger.spent)
        points = far_points(ledger.where, ledger.u, size=size, rng=rng)
    return ledger.spent


def far_points(where: SearchSpace, u: np.ndarray, *, size: int, rng: np.random.Generator) -> np.ndarray:
    """Up to `size` admissible points (m, d), each as far as possible from those at u (n, d) and its fellows.

    Distances of continuous coordinates go round the ends, as on a circle: the farthest points by plain
    distance are all on the faces of the box.
    """
    every = where.points()
    if every is None:
        drawn = where.snap(rng.random((CANDIDATES, where.dimension)))
        every = np.unique(drawn[where.allowed(drawn)], axis=0)
    drawn = every[rng.permutation(len(every))]
    nearest = np.full(len(drawn), np.inf)
    for point in u:
        nearest = np.minimum(nearest, _apart(where, drawn, point))
    chosen: list[np.ndarray] = []
    while len(chosen) < size and len(drawn):
        best = int(np.argmax(nearest))
        if nearest[best] <= 0:
            break
        chosen.append(drawn[best])
        nearest = np.minimum(nearest, _apart(where, drawn, drawn[best]))
    return np.array(chosen).reshape(len(chosen), where.dimension)


def _apart(where: SearchSpace, points: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Distances (m,) of `points` (m, d) from a point (d,)."""
    step = np.abs(points - point)
    for j, (grid, is_category) in enumerate(zip(where.levels, where.categorical, strict=True)):
        if grid is None:
            step[:, j] = np.minimum(step[:, j], 1.0 - step[:, j])
        elif is_category:
            step[:, j] = step[:, j] > 0
    distance: np.ndarray = np.sqrt((step**2).sum(axis=1))
    return distance
