"""The multi-start of a screening: how many starts, over which units, and when to go on.

With very many units first over all of them, then over the promising ones; more starts where the best maximum
predicts poorly.
"""

import numpy as np
from numpy.typing import NDArray

from ..partitions.optimum import Landscape, left_out_q2
from ..partitions.packed import PackedLandscape
from .multi_start import Maxima, merged, multi_start
from .narrowing import (
    WIDE,
    narrowed,
    promising,
    widened,
)
from .rules import Rules

__all__ = ["CONVINCING", "search_maxima"]

Array = NDArray[np.float64]

FEWEST = 48  # starts: an early agreement may be one on the second-best maximum
DEAR = 200_000  # units times runs squared from which on starts are saved
PATIENCE = 90  # starts without anything better
WIDE_STARTS, CLOSE_STARTS = 10, 64  # over very many units, and then over the promising ones
WIDE_TOLERANCE = 0.3  # in l: they name units, the close ones find the maxima
ROUNDS = 3  # of that
CONVINCING = 0.95  # leave-one-out Q2 of a best maximum that needs no further starts


def search_maxima(
    ground: Landscape, rules: Rules, margins_of: Array, *, part: bool, rng: np.random.Generator
) -> Maxima:
    """The maxima of a landscape; `part`: it shows a part of the runs, and all of them have the last word."""
    starts = rules.n_starts
    if ground.n_units > WIDE and isinstance(ground, PackedLandscape):
        return _in_two_widths(ground, rules, margins_of, rng)
    if part:
        return _searched(ground, rules, rng, min(starts, CLOSE_STARTS), 4, CLOSE_STARTS // 4, 24)
    affordable = _affordable(starts, ground)
    found = _searched(ground, rules, rng, affordable, rules.enough, FEWEST, PATIENCE)
    # agreement and patience end a search too early where a poor maximum is easy to reach
    if affordable == starts and left_out_q2(ground, found.optima[0]) < CONVINCING:
        again = _searched(ground, rules, rng, starts // 2, starts, FEWEST, starts)
        found = merged(found, again, price=rules.threshold, landscape=ground)
    return found


def _searched(
    ground: Landscape,
    rules: Rules,
    rng: np.random.Generator,
    number: int,
    enough: int,
    fewest: int,
    patience: int,
    tolerance: float = 3e-2,
) -> Maxima:
    low, high = rules.nugget
    return multi_start(
        ground,
        number=number,
        nuggets=(*(low,) * 6, min(100.0 * low, high)) if low < high else (low,),
        nugget=rules.nugget,
        enough=enough,
        fewest=fewest,
        patience=patience,
        price=rules.threshold,
        rng=rng,
        tolerance=tolerance,
    )


def _in_two_widths(
    ground: PackedLandscape, rules: Rules, margins_of: Array, rng: np.random.Generator
) -> Maxima:
    """Wide, then close; once more from other starts as long as the best maximum does not predict well."""
    found: Maxima | None = None
    wide_starts, close_starts = min(rules.n_starts, WIDE_STARTS), min(rules.n_starts, CLOSE_STARTS)
    for _ in range(ROUNDS):
        wide = _searched(
            ground, rules, rng, wide_starts, WIDE_STARTS, WIDE_STARTS, WIDE_STARTS, WIDE_TOLERANCE
        )
        both = wide if found is None else merged(found, wide, price=rules.threshold, landscape=ground)
        units = promising(ground, both, margins_of)
        close = _searched(narrowed(ground, units), rules, rng, close_starts, 4, CLOSE_STARTS // 2, 24)
        found = merged(both, widened(close, units), price=rules.threshold, landscape=ground)
        if left_out_q2(ground, found.optima[0]) > CONVINCING:
            break
    assert found is not None
    return found


def _affordable(n_starts: int, ground: Landscape) -> int:
    """Fewer starts where each is dear."""
    dear = ground.n_units * ground.n_runs**2 / DEAR
    return min(n_starts, max(24, int(n_starts / dear)))
