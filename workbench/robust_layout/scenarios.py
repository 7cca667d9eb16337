"""The cases that a robust loop begins with: a stratified set over the whole uncertainty.

Equal shares of every combination of unordered levels (hands on, hands off); in each, random corners first,
since worst cases of engineering responses stand in corners, and an even share inside, since not all do. A
layout optimised for such a set at once held 0.156 m where a loop that began with the nominal case reached
0.211 m (the sample approach; decision 0115).
"""

from typing import Any

import numpy as np

from workbench.search.evidence.attack.strata import Strata
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.box import Space
from workbench.space.streams import stream

__all__ = ["stratified_cases"]

INSIDE = 0.25  # of the set


def stratified_cases(space: Space, number: int, *, seed: int) -> list[dict[str, Any]]:
    """At most `number` different cases, corners first, then those inside; an empty list for 0.

    The corners are those of the set that `number` asks for: they share no stream with searches and attacks.

    >>> from workbench.space.parameter import Parameter
    >>> hands = Parameter("hands", kind="categorical", levels=("on", "off"))
    >>> cases = stratified_cases(Space((Parameter("a", lower=0, upper=1), hands)), 2, seed=0)
    >>> sorted(case["hands"] for case in cases)
    ['off', 'on']
    """
    if number == 0:
        return []
    where = SearchSpace.of(space)
    rng = stream(seed, "scenarios of a layout")
    strata = Strata.of(where, rng=rng)
    inside = round(INSIDE * number)
    points = strata.corners(number - inside, rng)
    if inside:
        points = np.vstack([points, strata.inside(inside, rng)])
    return [space.canonical(row) for row in where.rows(points)]
