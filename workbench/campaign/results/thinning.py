"""Some runs of very many: a Kriging model takes a few thousand, a campaign may hold a million.

Chosen are the runs that spread most over the box (`doe.subset`), and those with the smallest and the largest
value, so that a search still starts from the worst that is known. Only of the candidates that are drawn are
the parameters read.
"""

from collections.abc import Sequence

import numpy as np

import doe
from workbench.campaign.results.columns import RunColumns
from workbench.space.box import Space

__all__ = ["spread_runs"]

PER_RUN = 20  # candidates per run asked for among which the spread ones are looked for
TRIALS = 2_000


def spread_runs(
    space: Space, runs: RunColumns, response: str, *, most: int, rng: np.random.Generator
) -> np.ndarray:
    """Positions of at most `most` runs with a value of `response`, and of as many without one; ascending."""
    good, bad = np.flatnonzero(runs.is_ok), np.flatnonzero(~runs.is_ok)
    if len(good) > most:
        values = runs.values[response][good]
        good = _spread(space, runs, good, [int(np.argmin(values)), int(np.argmax(values))], most, rng)
    if len(bad) > most:
        bad = _spread(space, runs, bad, [0], most, rng)
    return np.sort(np.concatenate([good, bad]))


def _spread(
    space: Space,
    runs: RunColumns,
    among: np.ndarray,
    keep: Sequence[int],
    most: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Those of the positions `among` that spread most, among them the entries `keep` of it."""
    kept = list(dict.fromkeys(keep))
    pool = np.array(kept, dtype=np.int64)
    others = np.setdiff1d(np.arange(len(among)), pool)
    drawn = rng.choice(others, min(len(others), PER_RUN * most), replace=False)
    pool = np.concatenate([pool, np.sort(drawn)])
    candidates = runs.at(among[pool])
    unit = space.unit([[run.inputs[name] for name in space.names] for run in candidates])
    _, first = np.unique(unit, axis=0, return_index=True)
    pool, unit = (a[np.union1d(first, np.arange(len(kept)))] for a in (pool, unit))
    different = len(np.unique(unit, axis=0))
    rows = doe.subset(unit, min(most, different), keep=range(len(kept)), trials=TRIALS, rng=rng)
    return np.asarray(among[pool[rows]])
