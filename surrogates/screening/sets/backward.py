"""Backward elimination: a maximum of the ARD likelihood is shortened to few thetas, the rest being 0.

One unit after the other loses its theta, each time the one whose loss costs least restricted likelihood, so
that a maximum offers its best set of each size. Backward succeeds where forward fails: an input that acts
only through interactions pays as long as its partners are free.

The published search lets the inputs that are not selected share one theta. Here theirs is 0: a shared theta
that is not 0 would let inputs act without being selected, and without being paid for.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..partitions.optimum import Landscape, Optimum, Partition, log_reach
from .multi_start import ALIVE

__all__ = ["Chain", "alone", "most_active", "shorten"]

FREE = 0.02  # in l: losing a unit that costs less needs no new ascent
FAR = 12.0  # in l: a loss so much larger than the smallest is not made good by an ascent


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """Nested sets, from the largest to the empty one, each with its maximum.

    `sets[i]` are the selected units of `optima[i]`; all others have theta = 0.
    """

    sets: tuple[tuple[int, ...], ...]
    optima: tuple[Optimum, ...]

    def best(self, threshold: float) -> int:
        """Index of the set with the largest l - threshold * size."""
        return int(
            np.argmax([o.value - threshold * len(s) for s, o in zip(self.sets, self.optima, strict=True)])
        )

    def index(self, size: int) -> int:
        """Index of the set of a size."""
        return len(self.sets[0]) - size

    def score(self, threshold: float) -> float:
        """The largest l - threshold * size."""
        i = self.best(threshold)
        return self.optima[i].value - threshold * len(self.sets[i])


def alone(selected: tuple[int, ...]) -> Partition:
    """Each selected unit on its own, the others without effect."""
    return tuple((u,) for u in selected)


def most_active(landscape: Landscape, optimum: Optimum, number: int) -> tuple[int, ...]:
    """The units with the largest theta times reach, most active first."""
    effect = optimum.log_effect(landscape.reach)
    return tuple(int(k) for k in np.argsort(-effect, kind="stable")[:number])


def shorten(
    landscape: Landscape,
    optimum: Optimum,
    *,
    selected: tuple[int, ...],
    nugget: tuple[float, float],
    tried: int = 3,
    valued: int = 1000,
    tolerance: float = 1e-3,
    far: float = 0.0,
) -> Chain:
    """Take the theta from the units of `selected` one after the other, each time where it costs least.

    Which units to try is ranked by l with theta_i = 0 and nothing else moved: one likelihood each, for the
    `valued` least active units; the best `tried` are climbed, to `tolerance` in l, or the share `far` of what
    l has fallen by already.
    """
    log_theta = optimum.log_theta(landscape.n_units)
    start = np.append(log_theta[list(selected)], optimum.phi[-1])
    here = landscape.climb(alone(selected), start, nugget=nugget, tolerance=tolerance, max_evaluations=60)
    sets, optima = [selected], [here]
    while selected:
        enough = max(tolerance, far * (optima[0].value - here.value))
        here, selected = _lose_one(landscape, here, selected, nugget, tried, valued, enough)
        sets.append(selected)
        optima.append(here)
    return Chain(sets=tuple(sets), optima=tuple(optima))


def _lose_one(
    landscape: Landscape,
    here: Optimum,
    selected: tuple[int, ...],
    nugget: tuple[float, float],
    tried: int,
    valued: int,
    tolerance: float,
) -> tuple[Optimum, tuple[int, ...]]:
    effect = here.phi[:-1] + log_reach(landscape.reach[list(selected)])
    order = np.argsort(effect, kind="stable")
    among = 1 if effect[order[0]] <= ALIVE else valued
    candidates = []
    for i in sorted(int(j) for j in order[:among]):
        fewer, phi = selected[:i] + selected[i + 1 :], np.delete(here.phi, i)
        candidates.append((landscape.value(alone(fewer), phi), i, fewer, phi))
    candidates.sort(key=lambda c: (-c[0], c[1]))
    value, _, fewer, phi = candidates[0]
    if here.value - value < FREE:
        return replace(here, partition=alone(fewer), phi=phi, value=value, evaluations=0), fewer
    ends = [
        (landscape.climb(alone(f), p, nugget=nugget, tolerance=tolerance, max_evaluations=60), f)
        for v, _, f, p in candidates[:tried]
        if v > value - FAR
    ]
    return max(ends, key=lambda e: e[0].value)
