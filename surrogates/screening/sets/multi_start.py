"""Multi-start search of the ARD likelihood: one theta per unit.

The likelihood of 20 thetas from 50 runs has hundreds of maxima. Half of the starts are *sparse*: a few
units drawn at random begin active, the others almost inert, because that is what a screening expects of
the answer; Gaussian starts find the best maximum half as often. The other half are *kicks* from the best
maxima so far: most of their active units are kept, a few random ones join (iterated local search). The
search ends early when sparse starts agree on the best maximum, or when nothing better has been found for
long.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..partitions.optimum import Landscape, Optimum

__all__ = ["Maxima", "merged", "multi_start", "n_alive"]

Array = NDArray[np.float64]

SPARSE = ((5, 0.5, -5.0), (8, -0.25, -4.0))  # units that begin active, their log theta, that of the others
KEPT, JOINING, KICKED_FROM = 0.75, 3, 8  # share kept and units joining in a kick, maxima kicked from
SPARSE_FIRST = 16  # starts before the first kick
ALIVE = np.log(1e-5)  # log of theta times reach: a mean correlation lowered by less is not noticed
SAME = 0.1  # two maxima closer than this in l are the same one


@dataclass(frozen=True, slots=True, kw_only=True)
class Maxima:
    """What a multi-start found: distinct maxima, best l - price * (units alive) first.

    Attributes:
        optima: the maxima.   reached: how many starts, kicks included, reached each.
        starts, evaluations: ascents, and likelihoods in them.
    """

    optima: tuple[Optimum, ...]
    reached: tuple[int, ...]
    starts: int
    evaluations: int


def sparse_start(n_units: int, number: int, nugget: float, rng: np.random.Generator) -> Array:
    """The start with running `number`: random units active, the others almost inert; log nugget last."""
    active, high, low = SPARSE[number % len(SPARSE)]
    phi = np.full(n_units + 1, low)
    phi[rng.choice(n_units, min(active, n_units), replace=False)] = high
    phi[-1] = np.log(nugget)
    return phi


def kick(landscape: Landscape, optimum: Optimum, rng: np.random.Generator) -> Array:
    """A start near a maximum: some of its active units are dropped, some random others join."""
    _, high, low = SPARSE[0]
    log_theta = optimum.log_theta(landscape.n_units)
    alive = (optimum.log_effect(landscape.reach) > ALIVE) & (rng.random(landscape.n_units) < KEPT)
    phi = np.append(np.where(alive, np.clip(log_theta, -4.0, 1.5), low), optimum.phi[-1])
    phi[rng.choice(landscape.n_units, min(JOINING, landscape.n_units), replace=False)] = high
    return phi


def n_alive(landscape: Landscape, optimum: Optimum) -> int:
    """Units whose theta lowers the correlation between runs noticeably."""
    return int((optimum.log_effect(landscape.reach) > ALIVE).sum())


def multi_start(
    landscape: Landscape,
    *,
    number: int,
    nuggets: tuple[float, ...],
    nugget: tuple[float, float],
    enough: int,
    fewest: int,
    patience: int,
    price: float,
    rng: np.random.Generator,
    tolerance: float = 3e-2,
    max_evaluations: int = 60,
) -> Maxima:
    """Climb from at most `number` starts with one theta per unit.

    Stops after `fewest` starts as soon as `enough` sparse starts reached the best maximum, or `patience`
    starts brought nothing better. Rough ascents: a maximum is told from the others by SAME in l, the
    winners are climbed to the end later. `nuggets` are taken in turn, within the bounds `nugget`.
    """
    everyone = tuple((u,) for u in range(landscape.n_units))
    optima: list[Optimum] = []
    reached: list[int] = []
    by_sparse: list[int] = []
    scores: list[float] = []
    evaluations = done = sparse = last_gain = 0
    while done < number:
        kicked = done >= SPARSE_FIRST and done % 2 == 1
        if kicked:
            best_first = np.argsort(-np.array(scores), kind="stable")[:KICKED_FROM]
            start = kick(landscape, optima[int(rng.choice(best_first))], rng)
        else:
            start = sparse_start(landscape.n_units, sparse, nuggets[sparse % len(nuggets)], rng)
            sparse += 1
        end = landscape.climb(
            everyone, start, nugget=nugget, tolerance=tolerance, max_evaluations=max_evaluations
        )
        evaluations += end.evaluations
        done += 1
        score = end.value - price * n_alive(landscape, end)
        if score > max(scores, default=-np.inf) + SAME:
            last_gain = done
        same = next((i for i, other in enumerate(optima) if abs(other.value - end.value) < SAME), None)
        if same is None:
            optima.append(end)
            reached.append(0)
            by_sparse.append(0)
            scores.append(score)
            same = len(optima) - 1
        elif end.value > optima[same].value:
            optima[same], scores[same] = end, score
        reached[same] += 1
        by_sparse[same] += not kicked
        if done >= fewest and (by_sparse[int(np.argmax(scores))] >= enough or done - last_gain >= patience):
            break
    order = np.argsort(-np.array(scores), kind="stable")
    return Maxima(
        optima=tuple(optima[i] for i in order),
        reached=tuple(reached[i] for i in order),
        starts=done,
        evaluations=evaluations,
    )


def merged(first: Maxima, second: Maxima, *, price: float, landscape: Landscape) -> Maxima:
    """Both searches of the same landscape as one, best maximum first."""
    optima = [*first.optima, *second.optima]
    reached = [*first.reached, *second.reached]
    order = np.argsort([-(o.value - price * n_alive(landscape, o)) for o in optima], kind="stable")
    return Maxima(
        optima=tuple(optima[i] for i in order),
        reached=tuple(reached[i] for i in order),
        starts=first.starts + second.starts,
        evaluations=first.evaluations + second.evaluations,
    )
