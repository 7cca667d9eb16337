"""The sets of units that a search found, beside each other: which come close, and which units they share."""

import numpy as np

from .backward import Chain

__all__ = ["entering", "ranked", "rivals"]


def rivals(
    best: Chain, chosen: int, chains: list[Chain], threshold: float
) -> tuple[tuple[tuple[tuple[int, ...], float], ...], float]:
    """The five closest other sets, each with its l - threshold * size below the chosen set's; the margin."""
    found = frozenset(best.sets[chosen])
    worth = _worth([best, *chains], threshold)
    top = best.optima[chosen].value - threshold * len(found)
    below = {members: top - value for members, value in worth.items() if members != found}
    closest = sorted(below.items(), key=lambda r: r[1])[:5]
    margin = min((gap for members, gap in below.items() if not found <= members), default=float("inf"))
    return tuple((tuple(sorted(members)), gap) for members, gap in closest), margin


def ranked(first: list[int], chains: list[Chain], price: float) -> tuple[int, ...]:
    """The units of the chains by the weight exp(l - price * size) of the sets that hold them.

    With too few runs the best set is one of many that are nearly as likely. What most of them share is more
    likely to act than what the best one holds (Barbieri & Berger, Ann. Stat. 32, 2004, 870-897). Units of
    the same weight, to a hundredth, stand in the order of `first`, then of their weight.
    """
    worth = _worth(chains, price)
    top = max(worth.values())
    weight: dict[int, float] = {}
    for members, value in worth.items():
        for u in members:
            weight[u] = weight.get(u, 0.0) + float(np.exp(value - top))
    total = sum(float(np.exp(value - top)) for value in worth.values())
    order = [*first, *sorted((u for u in weight if u not in first), key=lambda u: (-weight[u], u))]
    return tuple(sorted(order, key=lambda u: -round(weight.get(u, 0.0) / total, 2)))


def entering(chain: Chain, size: int) -> list[int]:
    """The units of a chain's set of a size, the last to be taken out first."""
    order: list[int] = []
    for members in reversed(chain.sets[chain.index(size) :]):
        order += [u for u in members if u not in order]
    return order


def _worth(chains: list[Chain], price: float) -> dict[frozenset[int], float]:
    """The largest l - price * size of each set in any chain."""
    worth: dict[frozenset[int], float] = {}
    for chain in chains:
        for members, optimum in zip(chain.sets, chain.optima, strict=True):
            key = frozenset(members)
            worth[key] = max(optimum.value - price * len(members), worth.get(key, -np.inf))
    return worth
