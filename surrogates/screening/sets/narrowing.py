"""Search in two widths: a few starts over all units, then many over those that showed any life.

With a hundred units an ascent over all thetas is dear, and few of its starts come near the best maximum. The
maxima that a few of them reach still name the units worth a theta, most of the active ones among them; what a
unit explains on its own, on all runs, names others. Over these few dozen an ascent is cheap, and their maxima
are searched in earnest.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..partitions.optimum import Landscape, Optimum, standard_scores
from ..partitions.packed import PackedLandscape
from .multi_start import ALIVE, Maxima

__all__ = ["WIDE", "narrowed", "promising", "widened"]

Array = NDArray[np.float64]

WIDE = 40  # units from which on the search is narrowed
MOST = 24  # units that it is narrowed to
LOOKED_AT = 6  # maxima whose units are taken
BY_MARGIN = 10  # units that explain most on their own
BY_SCORE = 6  # further units, by what a theta of their own promises at each of the best two maxima


def promising(landscape: Landscape, search: Maxima, margins: Array) -> tuple[int, ...]:
    """The units worth a closer search.

    They are alive in one of the best maxima, of high score there, or among those that explain most on their
    own (`surrogates.screening.sets.single_input_fits`).
    """
    votes = np.zeros(landscape.n_units)
    votes[np.argsort(-margins, kind="stable")[:BY_MARGIN]] = 1.0
    for place, optimum in enumerate(search.optima[:LOOKED_AT]):
        effect = optimum.log_effect(landscape.reach)
        votes[effect > ALIVE] += 1.0 / (1 + place)
    for place, optimum in enumerate(search.optima[:2]):
        scores = standard_scores(landscape, optimum)
        votes[np.argsort(-scores, kind="stable")[:BY_SCORE]] += 0.5 / (1 + place)
    order = np.argsort(-votes, kind="stable")[:MOST]
    return tuple(sorted(int(u) for u in order if votes[u] > 0))


def narrowed(landscape: PackedLandscape, units: tuple[int, ...]) -> PackedLandscape:
    """The landscape of some of the units, the others without effect."""
    return PackedLandscape(landscape.distances[list(units)], landscape.y, landscape.restricted)


def widened(search: Maxima, units: tuple[int, ...]) -> Maxima:
    """A search among `units` in the numbering of all."""

    def renumbered(optimum: Optimum) -> Optimum:
        return replace(
            optimum, partition=tuple(tuple(units[u] for u in group) for group in optimum.partition)
        )

    return replace(search, optima=tuple(renumbered(o) for o in search.optima))
