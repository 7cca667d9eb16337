"""Some runs of very many: a Kriging model takes a few thousand, a campaign may hold a hundred thousand.

Chosen are the runs that spread most over the box (`doe.subset`), and those with the smallest and the largest
value, so that a search still starts from the worst that is known.
"""

from collections.abc import Sequence

import numpy as np

import doe
from workbench.models.stored.evaluation import Evaluation
from workbench.space.box import Space

__all__ = ["spread_runs"]

PER_RUN = 20  # candidates per run asked for among which the spread ones are looked for
TRIALS = 2_000


def spread_runs(
    space: Space, runs: Sequence[Evaluation], response: str, *, most: int, rng: np.random.Generator
) -> list[Evaluation]:
    """At most `most` runs with a value of `response`, and as many without one, in the order given."""
    good = [run for run in runs if run.status == "ok"]
    bad = [run for run in runs if run.status != "ok"]
    if len(good) > most:
        values = [run.outputs[response] for run in good]
        ends = [int(np.argmin(values)), int(np.argmax(values))]
        good = [good[k] for k in _spread(space, good, ends, most, rng)]
    if len(bad) > most:
        bad = [bad[k] for k in _spread(space, bad, [0], most, rng)]
    chosen = {run.key for run in good} | {run.key for run in bad}
    return [run for run in runs if run.key in chosen]


def _spread(
    space: Space, runs: Sequence[Evaluation], keep: Sequence[int], most: int, rng: np.random.Generator
) -> list[int]:
    kept = list(dict.fromkeys(keep))
    pool = np.array(kept, dtype=np.int64)
    others = np.setdiff1d(np.arange(len(runs)), pool)
    drawn = rng.choice(others, min(len(others), PER_RUN * most), replace=False)
    pool = np.concatenate([pool, np.sort(drawn)])
    unit = space.unit([[runs[k].inputs[name] for name in space.names] for k in pool])
    _, first = np.unique(unit, axis=0, return_index=True)
    pool, unit = (a[np.union1d(first, np.arange(len(kept)))] for a in (pool, unit))
    different = len(np.unique(unit, axis=0))
    rows = doe.subset(unit, min(most, different), keep=range(len(kept)), trials=TRIALS, rng=rng)
    return [int(pool[row]) for row in rows]
