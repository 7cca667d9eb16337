"""The default screening: sparse multi-start ARD likelihood, backward elimination, exchange.

1. Climb from sparse random starts with one theta per unit, the nugget free above a floor
   (`surrogates.screening.sets.ard_search`).
2. Shorten the best distinct maxima, at the full and at a lenient price of a unit: a chain of nested sets
   each, with the maximum of every set.
3. Polish the best chain by exchange; where it predicts poorly the best one at the lenient price, too.
4. Choose the set that maximises l - threshold * size, or none if none does so by `BEYOND_NONE`: where
   nothing acts theta is not identified, and the best of all its values gains more than the one
   degree of freedom that the threshold reckons with (Davies, Biometrika 74, 1987, 33-43).
5. Rank the units by what the sets have in common that are nearly as good
   (`surrogates.screening.sets.rival_sets`).

Large designs are searched on a random part of the runs (`PACKED_RUNS`) and finished on all of them
(`surrogates.screening.sets.all_runs`): the multi-start is where the evaluations are, and a hundred runs tell
maxima apart as well as a thousand, mostly; where the result predicts poorly another part gets its chance.
"""

from dataclasses import dataclass

import numpy as np

from ..partitions.canonical import CanonicalRuns
from ..partitions.landscape import PACKED_RUNS, landscape_of
from ..partitions.optimum import Landscape, Optimum, left_out_q2
from .all_runs import on_all_runs
from .ard_search import CONVINCING, search_maxima
from .backward import Chain, most_active, shorten
from .exchange import exchange
from .joint_effect_of_the_rest import rest_gain
from .multi_start import Maxima, n_alive
from .rival_sets import Rivals, also, entering, ranked, rivals
from .rules import Rules
from .single_input_fits import margins

__all__ = ["ArdScreening", "ard_screening"]

LARGEST_SET = 12  # units that a maximum is shortened from; more on demand
SHORTENED = 4  # distinct maxima that are shortened
BEYOND_NONE = 2.0  # in l: how much better than no input at all a set must be


@dataclass(frozen=True, slots=True, kw_only=True)
class ArdScreening:
    """What the default screening found.

    Attributes:
        chain: nested sets through the chosen one.
        chosen: index of the chosen set in the chain.
        ranked: units, the one that most likely acts first; the chosen ones lead where their number is given
            or all runs had the last word.
        search: the multi-start.
        beside: the sets of all maxima beside the chosen one.
        rest_gain: how far l rises when all other units share a theta, see
            `surrogates.screening.sets.joint_effect_of_the_rest`.
        agreeing: starts whose maximum has the chosen units as its most active ones.
        search_runs: runs that the multi-start saw.
    """

    chain: Chain
    chosen: int
    ranked: tuple[int, ...]
    search: Maxima
    beside: Rivals
    rest_gain: float
    agreeing: int
    search_runs: int


def ard_screening(runs: CanonicalRuns, rules: Rules, rng: np.random.Generator) -> ArdScreening:
    """Screen canonical runs.

    A large design whose selection predicts poorly is searched on another part of its runs, and the better of
    both kept: one sample in 24 of 500 x 100 had lost an input that acts through an interaction only.
    """
    first = _attempt(runs, rules, rng)
    if len(runs.y) <= PACKED_RUNS:
        return first
    whole = landscape_of(runs, restricted=rules.restricted, eta=rules.eta)
    if left_out_q2(whole, first.chain.optima[first.chosen]) > CONVINCING:
        return first

    def score(found: ArdScreening) -> float:
        return found.chain.optima[found.chosen].value - rules.threshold * len(found.chain.sets[found.chosen])

    return max(first, _attempt(runs, rules, rng), key=score)


def _attempt(runs: CanonicalRuns, rules: Rules, rng: np.random.Generator) -> ArdScreening:
    """One screening, of a design with many runs by the search on a random part of them."""
    n = len(runs.y)
    rows = np.sort(rng.permutation(n)[:PACKED_RUNS]) if n > PACKED_RUNS else None
    ground = landscape_of(runs, restricted=rules.restricted, eta=rules.eta, rows=rows)
    search = search_maxima(ground, rules, margins(runs), part=rows is not None, rng=rng)
    best, others = _best_chain(ground, search, rules)
    chosen = _chosen(best, rules)
    k = len(best.sets[chosen])
    agreeing = sum(
        reached
        for optimum, reached in zip(search.optima, search.reached, strict=True)
        if set(most_active(ground, optimum, k)) == set(best.sets[chosen])
    )
    beside = rivals(best, chosen, others, rules.threshold)
    order = ranked(entering(best, k), [best, *others], rules.lenient)
    if rows is not None:
        best = on_all_runs(runs, best, chosen, rules, rng)
        chosen = _chosen(best, rules)
        # inputs that only all runs showed belong to the selection, and to what it leads by
        beside = also(beside, rivals(best, chosen, [], rules.threshold))
    if rows is not None or rules.size is not None:
        leading = entering(best, len(best.sets[chosen]))
        order = (*leading, *(u for u in order if u not in leading))
    return ArdScreening(
        chain=best,
        chosen=chosen,
        ranked=order,
        search=search,
        beside=beside,
        # on the runs that the search saw: all runs of a large design would make it dear
        rest_gain=rest_gain(ground, best.sets[chosen], best.optima[chosen].phi, rules.nugget),
        agreeing=agreeing,
        search_runs=ground.n_runs,
    )


def _best_chain(ground: Landscape, search: Maxima, rules: Rules) -> tuple[Chain, list[Chain]]:
    """The chain with the best set, polished, and the others."""
    size, nugget = rules.size, rules.nugget
    largest = min(max(LARGEST_SET, 0 if size is None else size + 4), ground.n_units)
    chains = [
        shorten(ground, o, selected=most_active(ground, o, largest), nugget=nugget)
        for o in _worth_shortening(ground, search, rules)
    ]

    def score(chain: Chain) -> float:
        return chain.score(rules.threshold) if size is None else chain.optima[chain.index(size)].value

    chains.append(exchange(ground, max(chains, key=score), threshold=rules.threshold, nugget=nugget))
    best = chains[-1].optima[_chosen(chains[-1], rules)]
    if size is None and left_out_q2(ground, best) < CONVINCING:
        start = max(chains, key=lambda chain: chain.score(rules.lenient))
        chains.append(exchange(ground, start, threshold=rules.lenient, nugget=nugget))
    # of equal ones the polished one
    at = max(range(len(chains)), key=lambda i: (score(chains[i]), i))
    return chains[at], chains[:at] + chains[at + 1 :]


def _chosen(chain: Chain, rules: Rules) -> int:
    """Index of the best set of a chain, or of the given size."""
    if rules.size is not None:
        return chain.index(rules.size)
    none = chain.index(0)
    best = chain.score(rules.threshold)
    return chain.best(rules.threshold) if best > chain.optima[none].value + BEYOND_NONE else none


def _worth_shortening(ground: Landscape, search: Maxima, rules: Rules) -> list[Optimum]:
    """The best maxima with the full price, then the best others where a unit costs less."""
    lenient = [-(o.value - rules.lenient * n_alive(ground, o)) for o in search.optima]
    at = list(range(min(SHORTENED, len(lenient))))
    at += [int(i) for i in np.argsort(lenient, kind="stable")[:SHORTENED] if i >= len(at)]
    return [search.optima[i] for i in at]
