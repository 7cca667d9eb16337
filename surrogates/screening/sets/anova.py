"""Sets of active units under an ANOVA correlation (`surrogates.screening.partitions.anova`).

1. All units have one theta, of three sizes by turns, and only their weights are climbed: at w = 0 the
   likelihood has a slope, so that most of them end there. What is left is climbed with a theta each.
2. Each of these maxima, and the given one of a product, is shortened by one unit after the other.
3. Units join the best set by what l gains at a small weight of theirs, and the result is shortened again.

A set is worth l less a price for each of its units: the threshold of a screening (one theta) and 1 for the
weight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..partitions.anova import AnovaLandscape, AnovaOptimum
from ..partitions.optimum import Optimum

__all__ = ["AnovaSets", "anova_price", "anova_sets", "units_that_stay"]

Array = NDArray[np.float64]

WEIGHT_PRICE = 1.0  # in l, of a unit's weight beside its theta
THETAS = (2.0, 8.0, 32.0)  # on [0, 1]
STARTS = ((0.03, -5.0), (0.3, -2.5))  # weight of all units and log nugget
LARGEST = 8  # units of a maximum that is climbed with a theta each
ALIVE = 1e-3  # weight of a unit that is
OF_A_PRODUCT = 30.0  # weight of the units of a product's maximum
JOINING_WEIGHT, TRIAL_WEIGHT = 0.01, 3e-3
TRIED = 4  # units that are tried at once, to leave or to join
ROUNDS = 4
HOPELESS = 25.0  # in l: a chain is left that has fallen so far with one unit less
LONG, SHORT = 60, 30  # steps of an ascent


@dataclass(frozen=True, slots=True, kw_only=True)
class AnovaSets:
    """The best maximum of every set met, the best set first.

    Attributes:
        optima: by worth.   price: of each unit.
        agreeing: how many of the starts came to the best set, or to a part of it that others join.
    """

    optima: tuple[AnovaOptimum, ...]
    price: float
    agreeing: int

    def worth(self, at: AnovaOptimum) -> float:
        """l less the price of its units."""
        return at.value - self.price * len(at.units)

    @property
    def best(self) -> AnovaOptimum:
        """The maximum of the best set."""
        return self.optima[0]

    def without(self, unit: int) -> AnovaOptimum | None:
        """The best set met that lacks a unit."""
        return next((at for at in self.optima if unit not in at.units), None)


def anova_price(threshold: float) -> float:
    """What a unit must bring in l, weight and theta, where `threshold` is asked of a theta alone."""
    return threshold + WEIGHT_PRICE


def units_that_stay(ground: AnovaLandscape, at: AnovaOptimum, *, price: float) -> tuple[int, ...]:
    """The units of a maximum that are worth their price on other runs, from where they stood."""
    at = ground.climb(at, steps=SHORT)
    while len(at.units) > 1:
        shorter = max(
            (ground.climb(at.without(i), steps=SHORT) for i in range(len(at.units))),
            key=lambda end: end.value,
        )
        if shorter.value < at.value - price:
            break
        at = shorter
    return at.units


def anova_sets(ground: AnovaLandscape, given: Optimum, *, threshold: float) -> AnovaSets:
    """Search from the likelihood itself and from `given`, the maximum of a product of correlations."""
    price = anova_price(threshold)
    met: dict[frozenset[int], AnovaOptimum] = {}

    def worth(at: AnovaOptimum) -> float:
        return at.value - price * len(at.units)

    def keep(at: AnovaOptimum) -> None:
        key = frozenset(at.units)
        if key not in met or met[key].value < at.value:
            met[key] = at

    def shortened(at: AnovaOptimum) -> frozenset[int]:
        """Keep the sets on the way down from a maximum; returns the best of them."""
        keep(at)
        way = [at]
        while len(at.units) > 1:
            weakest = np.argsort(at.weight, kind="stable")[:TRIED]
            shorter = max(
                (ground.climb(at.without(int(i)), steps=SHORT) for i in weakest), key=lambda end: end.value
            )
            keep(shorter)
            way.append(shorter)
            if shorter.value < at.value - HOPELESS:
                break
            at = shorter
        return frozenset(max(way, key=worth).units)

    ends = [shortened(ground.climb(start, steps=LONG)) for start in _starts(ground, given)]
    for _ in range(ROUNDS):
        best = max(met.values(), key=worth)
        for unit, log_theta in _joining(ground, best):
            keep(ground.climb(best.joined_by(unit, JOINING_WEIGHT, log_theta), steps=SHORT))
        larger = max(met.values(), key=worth)
        if set(larger.units) == set(best.units):
            break
        shortened(larger)
    ordered = tuple(sorted(met.values(), key=worth, reverse=True))
    return AnovaSets(
        optima=ordered, price=price, agreeing=sum(end <= frozenset(ordered[0].units) for end in ends)
    )


def _starts(ground: AnovaLandscape, given: Optimum) -> list[AnovaOptimum]:
    """What ascents over the weights leave alive, for each common theta, and the given maximum."""
    found = []
    everyone = range(ground.n_units)
    for theta in THETAS:
        best = max(
            (
                ground.climb_weights(everyone, weight, float(np.log(theta)), log_nugget, steps=LONG)
                for weight, log_nugget in STARTS
            ),
            key=lambda end: end.value,
        )
        alive = [int(u) for u in np.argsort(-best.weight, kind="stable")[:LARGEST] if best.weight[u] > ALIVE]
        if alive:
            found.append(
                AnovaOptimum(
                    units=tuple(alive),
                    weight=best.weight[alive],
                    log_theta=best.log_theta[alive],
                    log_nugget=best.log_nugget,
                    value=best.value,
                )
            )
    selected = tuple(group[0] for group in given.partition)
    found.append(
        AnovaOptimum(
            units=selected,
            weight=np.full(len(selected), OF_A_PRODUCT),
            log_theta=given.phi[: len(selected)],
            log_nugget=float(given.phi[-1]),
            value=given.value,
        )
    )
    return found


def _joining(ground: AnovaLandscape, at: AnovaOptimum) -> list[tuple[int, float]]:
    """The units that promise most at a small weight, each with the log theta at which they do."""
    promise = {}
    for unit in range(ground.n_units):
        if unit not in at.units:
            trials = [(ground.value(at.joined_by(unit, TRIAL_WEIGHT, t)), t) for t in np.log(THETAS)]
            promise[unit] = max(trials)
    first = sorted(promise, key=lambda unit: -promise[unit][0])[:TRIED]
    return [(unit, float(promise[unit][1])) for unit in first]
