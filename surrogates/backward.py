"""Backward pooling: a maximum of the ARD likelihood is shortened to few thetas, the rest sharing one.

One unit after the other is pooled into the group with the common theta, each time the one whose pooling
costs least restricted likelihood, so that a maximum offers its best set of each size. Backward succeeds
where forward fails: an input that acts only through interactions pays as long as its partners are free.
"""

from dataclasses import dataclass

import numpy as np

from .forward import split
from .landscape import Landscape, Optimum

__all__ = ["Chain", "most_active", "shorten"]

INERT = -5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """Nested sets, from the largest to the empty one, each with the maximum of its partition.

    `sets[i]` are the selected units of `optima[i]`, most active first.
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


def most_active(landscape: Landscape, optimum: Optimum, number: int) -> tuple[int, ...]:
    """The units with the largest theta times reach, most active first."""
    effect = optimum.log_theta(landscape.n_units) + np.log(landscape.reach)
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
) -> Chain:
    """Pool the units of `selected` one after the other, each time the one whose pooling costs least.

    Which units to try is ranked by l with theta_i set to the common theta and nothing else moved: one
    likelihood each, for the `valued` least active units; the best `tried` are climbed.
    """
    u = landscape.n_units
    log_theta = optimum.log_theta(u)
    rest = [k for k in range(u) if k not in selected]
    common = [np.log(max(float(np.exp(log_theta[rest]).mean()), 1e-6))] if rest else []
    start = np.concatenate([log_theta[list(selected)], common, optimum.phi[-1:]])
    here = landscape.climb(split(u, selected), start, nugget=nugget, tolerance=tolerance, max_evaluations=60)
    sets, optima = [selected], [here]
    while selected:
        k = len(selected)
        shared = here.phi[k] if len(here.partition) > k else INERT
        candidates = []
        effect = here.phi[:k] + np.log(landscape.reach[list(selected)])
        # the first unit in an empty pool keeps its theta, which costs nothing whichever it is: the least
        # active
        among = 1 if k == u else valued
        for i in sorted(int(j) for j in np.argsort(effect, kind="stable")[:among]):
            fewer = selected[:i] + selected[i + 1 :]
            phi = np.concatenate([np.delete(here.phi[:k], i), [shared], here.phi[-1:]])
            candidates.append((landscape.value(split(u, fewer), phi), i, fewer, phi))
        candidates.sort(key=lambda c: (-c[0], c[1]))
        ends = [
            landscape.climb(split(u, fewer), phi, nugget=nugget, tolerance=tolerance, max_evaluations=60)
            for _, _, fewer, phi in candidates[:tried]
        ]
        i = int(np.argmax([e.value for e in ends]))
        here, selected = ends[i], candidates[i][2]
        sets.append(selected)
        optima.append(here)
    return Chain(sets=tuple(sets), optima=tuple(optima))
