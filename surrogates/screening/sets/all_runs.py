"""The last word of all runs on a set that a part of them has found.

Up to `DIRECT` runs the chosen set, with some units to spare, is climbed on all runs, takes in what they show
and is shortened again. Beyond, where one likelihood takes a good part of a second, that is done on `DIRECT`
random runs; on all of them the sets of that chain are only climbed from where they stand, and what all runs
show beyond the best one is taken in.
"""

from dataclasses import replace

import numpy as np

from ..partitions.canonical import CanonicalRuns
from ..partitions.landscape import landscape_of
from ..partitions.optimum import HIGHEST, LOWEST, Landscape, Optimum
from .backward import Chain, shorten
from .exchange import ENTERING, take_in
from .rules import Rules

__all__ = ["on_all_runs"]

DIRECT = 600
SPARE = 3  # units beyond the chosen set that are climbed
MOST_TAKEN_IN = 10  # units that further runs may add
ROUGH = 0.3  # in l: a likelihood of hundreds of runs tells units apart by more
FAR = 2e-3  # of the fall of l along the path: where it has fallen by hundreds, tenths tell nothing
FEW = 6  # evaluations, from a start that is almost the maximum


def on_all_runs(
    runs: CanonicalRuns,
    chain: Chain,
    chosen: int,
    rules: Rules,
    rng: np.random.Generator,
) -> Chain:
    """The chain of `chosen`, a set of `chain`, on all runs; nothing is taken in where the size is given."""
    n, nugget, threshold = len(runs.y), rules.nugget, rules.threshold
    fixed = rules.size is not None
    rows = np.sort(rng.permutation(n)[:DIRECT]) if n > DIRECT else None
    part = landscape_of(runs, restricted=rules.restricted, eta=rules.eta, rows=rows)
    i = max(0, chosen - SPARE)
    selected, here = chain.sets[i], chain.optima[i]
    here = part.climb(here.partition, here.phi, nugget=nugget, tolerance=ROUGH, max_evaluations=20)
    if not fixed:
        selected, here = _taken_in(part, selected, here, nugget, threshold)[-1]
    found = shorten(part, here, selected=selected, nugget=nugget, tried=1, valued=3, tolerance=0.1, far=FAR)
    if rows is None:
        return found
    whole = landscape_of(runs, restricted=rules.restricted, eta=rules.eta)
    optima = tuple(
        whole.climb(o.partition, o.phi, nugget=nugget, tolerance=ROUGH, max_evaluations=FEW)
        for o in found.optima
    )
    found = replace(found, optima=optima)
    if fixed:
        return found
    best = found.best(threshold)
    more = _taken_in(whole, found.sets[best], found.optima[best], nugget, threshold)[:0:-1]
    if not more:
        return found
    # each of the larger sets holds the best one: the sets beyond it give way to them
    return Chain(
        sets=(*(s for s, _ in more), *found.sets[best:]),
        optima=(*(o for _, o in more), *found.optima[best:]),
    )


def _taken_in(
    landscape: Landscape,
    selected: tuple[int, ...],
    here: Optimum,
    nugget: tuple[float, float],
    threshold: float,
) -> list[tuple[tuple[int, ...], Optimum]]:
    """The given set, then sets of one unit more each, while the slope at theta = 0 promises the threshold."""
    grown = [(selected, here)]
    for _ in range(MOST_TAKEN_IN):
        gradient, information = landscape.slopes(here)
        gradient[list(selected)] = 0.0
        # what a step in theta from 0 promises: l' theta - l'' theta^2 / 2 at its best, and where that is
        promise = 0.5 * np.maximum(gradient, 0.0) ** 2 / np.maximum(information, 1e-300)
        u = int(np.argmax(promise))
        if not promise[u] > threshold:
            break
        there = min(LOWEST + float(np.log(gradient[u] / information[u])), HIGHEST)
        further = take_in(
            landscape, here, selected, u, nugget=nugget, tolerance=ROUGH, entering=(there, *ENTERING)
        )
        if not further.value > here.value:
            break
        here, selected = further, (*selected, u)
        grown.append((selected, here))
    return grown
