"""The default screening: sparse multi-start ARD likelihood, backward elimination, exchange, automatic
number of units.

1. Climb from sparse random starts with one theta per unit, the nugget free above a floor; with very many
   units first over all of them, then over the promising ones (`surrogates.narrowing`). Go on when the best
   maximum predicts poorly.
2. Shorten the best distinct maxima, at the full and at half the threshold: a chain of nested sets each, with
   the maximum of every set.
3. Polish the best chain by exchange.
4. Choose the set that maximises l - threshold * size, or none if none does so by `BEYOND_NONE`: where
   nothing acts theta is not identified, and the best of all its values gains more than the one
   degree of freedom that the threshold reckons with (Davies, Biometrika 74, 1987, 33-43).

Large designs are searched on a random part of the runs (`PACKED_RUNS`) and finished on all of them
(`surrogates.all_runs`): the multi-start is where the evaluations are, and a hundred runs tell maxima apart
as well as a thousand, mostly; where the result predicts poorly another part gets its chance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from .all_runs import on_all_runs
from .backward import Chain, most_active, shorten
from .canonical import CanonicalRuns
from .exchange import exchange
from .landscape import PACKED_RUNS, Landscape, Optimum, PackedLandscape, landscape_of, left_out_q2
from .margins import margins
from .narrowing import WIDE, narrowed, promising, widened
from .rest import rest_gain
from .search import Search, merged, multi_start, n_alive

__all__ = ["ArdScreening", "ard_screening", "threshold_for"]

Array = NDArray[np.float64]

FEWEST = 48  # starts: an early agreement may be one on the second-best maximum
DEAR = 200_000  # units times runs squared from which on starts are saved
PATIENCE = 90  # starts without anything better
WIDE_STARTS, CLOSE_STARTS = 10, 64  # over very many units, and then over the promising ones
WIDE_TOLERANCE = 0.3  # in l: they name units, the close ones find the maxima
ROUNDS = 3  # of that
CONVINCING = 0.95  # leave-one-out Q2 of a best maximum that needs no further starts
LARGEST_SET = 12  # units that a maximum is shortened from; more on demand
SHORTENED = 4  # distinct maxima that are shortened
BEYOND_NONE = 2.0  # in l: how much better than no input at all a set must be
LENIENT = 0.5  # of the threshold: maxima that are best then are shortened, too


def threshold_for(n_units: int, risk: float = 0.05) -> float:
    """The gain in l that one more theta must bring, so that all inert units together enter with
    probability `risk`.

    An inert unit's theta lies on its bound 0, so twice its gain is 0 or chi^2 with one degree, each with
    probability 1/2 (Self & Liang, J. Am. Stat. Assoc. 82, 1987, 605-610). Never below 1.92, the 95 % point
    for a single unit.

    >>> print(round(threshold_for(20), 2), round(threshold_for(100), 2), round(threshold_for(4), 2))
    3.94 5.41 2.51
    """
    return max(1.92, 0.5 * float(chi2.isf(min(1.0, 2.0 * risk / n_units), 1)))


@dataclass(frozen=True, slots=True, kw_only=True)
class ArdScreening:
    """What the default screening found.

    Attributes:
        chain: nested sets through the chosen one.
        chosen: index of the chosen set in the chain.
        next_in_line: units in the order in which they join the best set as the threshold falls, those of the
            chosen set first.
        search: the multi-start.
        rivals: the best other set of each other maximum, with its score below the chosen one's.
        margin: the smallest such fall to a set that misses a unit of the chosen one.
        rest_gain: how far l rises when all other units share a theta, see `surrogates.rest`.
        agreeing: starts whose maximum has the chosen units as its most active ones.
        search_runs: runs that the multi-start saw.
    """

    chain: Chain
    chosen: int
    next_in_line: tuple[int, ...]
    search: Search
    rivals: tuple[tuple[tuple[int, ...], float], ...]
    margin: float
    rest_gain: float
    agreeing: int
    search_runs: int


def ard_screening(
    runs: CanonicalRuns,
    *,
    restricted: bool,
    eta: float,
    nugget: tuple[float, float],
    threshold: float,
    n_starts: int,
    enough: int,
    size: int | None,
    rng: np.random.Generator,
) -> ArdScreening:
    """Screen canonical runs; `size` fixes the number of selected units instead of choosing it.

    A large design whose selection predicts poorly is searched on another part of its runs, and the better of
    both kept: one sample in 24 of 500 x 100 had lost an input that acts through an interaction only.
    """

    def attempt() -> ArdScreening:
        return _attempt(
            runs,
            restricted=restricted,
            eta=eta,
            nugget=nugget,
            threshold=threshold,
            n_starts=n_starts,
            enough=enough,
            size=size,
            rng=rng,
        )

    first = attempt()
    if len(runs.y) <= PACKED_RUNS:
        return first
    whole = landscape_of(runs, restricted=restricted, eta=eta)
    if left_out_q2(whole, first.chain.optima[first.chosen]) > CONVINCING:
        return first

    def score(found: ArdScreening) -> float:
        return found.chain.optima[found.chosen].value - threshold * len(found.chain.sets[found.chosen])

    return max(first, attempt(), key=score)


def _attempt(
    runs: CanonicalRuns,
    *,
    restricted: bool,
    eta: float,
    nugget: tuple[float, float],
    threshold: float,
    n_starts: int,
    enough: int,
    size: int | None,
    rng: np.random.Generator,
) -> ArdScreening:
    """One screening, of a design with many runs by the search on a random part of them."""
    n = len(runs.y)
    rows = np.sort(rng.permutation(n)[:PACKED_RUNS]) if n > PACKED_RUNS else None
    ground = landscape_of(runs, restricted=restricted, eta=eta, rows=rows)
    nuggets = (*(nugget[0],) * 6, min(100.0 * nugget[0], nugget[1])) if nugget[0] < nugget[1] else nugget[:1]

    def searched(
        where: Landscape, number: int, enough: int, fewest: int, patience: int, tolerance: float = 3e-2
    ) -> Search:
        return multi_start(
            where,
            number=number,
            nuggets=nuggets,
            nugget=nugget,
            enough=enough,
            fewest=fewest,
            patience=patience,
            price=threshold,
            rng=rng,
            tolerance=tolerance,
        )

    if ground.n_units > WIDE and isinstance(ground, PackedLandscape):
        search = _in_two_widths(ground, searched, n_starts, threshold, margins(runs))
    elif rows is not None:  # all runs have the last word
        search = searched(ground, min(n_starts, CLOSE_STARTS), 4, CLOSE_STARTS // 4, 24)
    else:
        affordable = _starts_affordable(n_starts, ground.n_units, n)
        search = searched(ground, affordable, enough, FEWEST, PATIENCE)
        # agreement and patience end a search too early where a poor maximum is easy to reach
        if affordable == n_starts and left_out_q2(ground, search.optima[0]) < CONVINCING:
            again = searched(ground, n_starts // 2, n_starts, FEWEST, n_starts)
            search = merged(search, again, price=threshold, landscape=ground)
    largest = min(max(LARGEST_SET, 0 if size is None else size + 4), ground.n_units)
    chains = [
        shorten(ground, o, selected=most_active(ground, o, largest), nugget=nugget)
        for o in _worth_shortening(ground, search, threshold)
    ]

    def score(chain: Chain) -> float:
        return chain.score(threshold) if size is None else chain.optima[chain.index(size)].value

    best = exchange(ground, max(chains, key=score), threshold=threshold, nugget=nugget)
    chosen = _chosen(best, threshold, size)
    k = len(best.sets[chosen])
    agreeing = sum(
        reached
        for optimum, reached in zip(search.optima, search.reached, strict=True)
        if set(most_active(ground, optimum, k)) == set(best.sets[chosen])
    )
    rivals, margin = _rivals(best, chosen, chains, threshold)
    line = _next_in_line(best.sets[chosen], best.optima[chosen].value, [best, *chains])
    if rows is not None:
        best = on_all_runs(
            runs,
            best,
            chosen,
            restricted=restricted,
            eta=eta,
            nugget=nugget,
            threshold=threshold,
            fixed=size is not None,
            rng=rng,
        )
        chosen = _chosen(best, threshold, size)
        # inputs that only all runs showed belong to the selection, and to what it leads by
        margin = min(margin, _rivals(best, chosen, [], threshold)[1])
    return ArdScreening(
        chain=best,
        chosen=chosen,
        next_in_line=line,
        search=search,
        rivals=rivals,
        margin=margin,
        # on the runs that the search saw: all runs of a large design would make it dear
        rest_gain=rest_gain(ground, best.sets[chosen], best.optima[chosen].phi, nugget),
        agreeing=agreeing,
        search_runs=ground.n_runs,
    )


def _chosen(chain: Chain, threshold: float, size: int | None) -> int:
    """Index of the best set of a chain, or of the given size."""
    if size is not None:
        return chain.index(size)
    none = chain.index(0)
    return chain.best(threshold) if chain.score(threshold) > chain.optima[none].value + BEYOND_NONE else none


def _in_two_widths(
    ground: PackedLandscape,
    searched: Callable[..., Search],
    n_starts: int,
    threshold: float,
    margins_of: Array,
) -> Search:
    """Wide, then close; once more from other starts as long as the best maximum does not predict well."""
    found: Search | None = None
    for _ in range(ROUNDS):
        wide = searched(
            ground,
            min(n_starts, WIDE_STARTS),
            WIDE_STARTS,
            WIDE_STARTS,
            WIDE_STARTS,
            tolerance=WIDE_TOLERANCE,
        )
        both = wide if found is None else merged(found, wide, price=threshold, landscape=ground)
        units = promising(ground, both, margins_of)
        close = searched(narrowed(ground, units), min(n_starts, CLOSE_STARTS), 4, CLOSE_STARTS // 2, 24)
        found = merged(both, widened(close, units), price=threshold, landscape=ground)
        if left_out_q2(ground, found.optima[0]) > CONVINCING:
            break
    assert found is not None
    return found


def _worth_shortening(ground: Landscape, search: Search, threshold: float) -> list[Optimum]:
    """The best maxima with the full price, then the best others where a unit costs less."""
    lenient = [-(o.value - LENIENT * threshold * n_alive(ground, o)) for o in search.optima]
    at = list(range(min(SHORTENED, len(lenient))))
    at += [int(i) for i in np.argsort(lenient, kind="stable")[:SHORTENED] if i >= len(at)]
    return [search.optima[i] for i in at]


def _next_in_line(chosen: tuple[int, ...], value: float, chains: list[Chain]) -> tuple[int, ...]:
    """The chosen set, of l `value`, and the units beyond it, in the order in which they join the best set of
    all chains as the price of a unit falls."""
    best: dict[int, tuple[float, Chain]] = {}
    for chain in chains:
        for members, optimum in zip(chain.sets, chain.optima, strict=True):
            if len(members) not in best or optimum.value > best[len(members)][0]:
                best[len(members)] = optimum.value, chain
    size, order = len(chosen), list(chosen)
    while True:
        # the price at which a larger set becomes the best one
        prices = {m: (best[m][0] - value) / (m - size) for m in best if m > size}
        if not prices or max(prices.values()) <= 0.0:
            return tuple(order)
        size = max(prices, key=lambda m: prices[m])
        value, chain = best[size]
        order += [u for u in _entering(chain, size) if u not in order]


def _entering(chain: Chain, size: int) -> list[int]:
    """The units of a chain's set of a size, the last to be taken out first."""
    order: list[int] = []
    for members in reversed(chain.sets[chain.index(size) :]):
        order += [u for u in members if u not in order]
    return order


def _starts_affordable(n_starts: int, n_units: int, n_runs: int) -> int:
    """Fewer starts where each is dear."""
    dear = n_units * min(n_runs, PACKED_RUNS) ** 2 / DEAR
    return min(n_starts, max(24, int(n_starts / dear)))


def _rivals(
    best: Chain, chosen: int, chains: list[Chain], threshold: float
) -> tuple[tuple[tuple[tuple[int, ...], float], ...], float]:
    """The five closest other sets, each with its l - threshold * size below the chosen set's; the margin."""
    found = frozenset(best.sets[chosen])
    top = best.optima[chosen].value - threshold * len(found)
    below: dict[frozenset[int], float] = {}
    for chain in [best, *chains]:
        for members, optimum in zip(chain.sets, chain.optima, strict=True):
            key, gap = frozenset(members), top - (optimum.value - threshold * len(members))
            if key != found:
                below[key] = min(gap, below.get(key, np.inf))
    ordered = sorted(below.items(), key=lambda r: r[1])[:5]
    margin = min((gap for s, gap in below.items() if not found <= s), default=float("inf"))
    return tuple((tuple(sorted(s)), gap) for s, gap in ordered), margin
