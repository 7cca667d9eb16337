"""The first points of a search: few, space-filling, and none when there are runs enough."""

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.search_ledger import FEWEST_RUNS, Ledger
from workbench.streams import stream

__all__ = ["start_points"]

START_TRIES = 200


def start_points(ledger: Ledger, *, budget: int, seed: int) -> np.ndarray:
    """Space-filling points that bring the usable runs up to d + 2; none when there are enough."""
    where = ledger.where
    wanted = max(where.n_features + 2, FEWEST_RUNS)
    needed = max(wanted - int(ledger.ok.sum()), 0)
    if where.is_finite:
        needed = int(min(needed, where.size))
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
        raise StudyError("no point of the space meets its constraints: loosen them or widen the bounds")
    points: np.ndarray = allowed[first]
    return points
