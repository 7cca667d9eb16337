"""The sets of units that a search found, beside each other: which come close, and which units they share."""

from dataclasses import dataclass

import numpy as np

from ..partitions.optimum import Optimum
from .backward import Chain

__all__ = ["CLEAR_MARGIN", "Rivals", "also", "entering", "ranked", "rivals"]

CLEAR_MARGIN = 2.0  # in l: the rival set is e^2 = 7 times less likely


@dataclass(frozen=True, slots=True, kw_only=True)
class Rivals:
    """Sets beside the chosen one.

    Attributes:
        closest: the five closest others, each with the fall of l - threshold * size to it.
        margin: the smallest fall to a set that misses a unit of the chosen one; inf without such a set.
        doubts: of each unit of the chosen one the closest set without it, where that falls by less than
            `CLEAR_MARGIN`, with its maximum.
    """

    closest: tuple[tuple[tuple[int, ...], float], ...]
    margin: float
    doubts: tuple[tuple[tuple[int, ...], Optimum], ...]


def rivals(best: Chain, chosen: int, chains: list[Chain], threshold: float) -> Rivals:
    """The sets of all chains beside the chosen one, by l - threshold * size."""
    found = frozenset(best.sets[chosen])
    worth = _worth([best, *chains], threshold)
    top = best.optima[chosen].value - threshold * len(found)
    below = {members: top - value for members, (value, _) in worth.items() if members != found}
    ordered = sorted(below.items(), key=lambda r: r[1])
    missing = [(members, gap) for members, gap in ordered if not found <= members]
    doubts: dict[tuple[int, ...], Optimum] = {}
    doubted: set[int] = set()
    for members, gap in missing:
        if gap < CLEAR_MARGIN and not found - members <= doubted:
            doubted |= found - members
            doubts[tuple(sorted(members))] = worth[members][1]
    return Rivals(
        closest=tuple((tuple(sorted(members)), gap) for members, gap in ordered[:5]),
        margin=missing[0][1] if missing else float("inf"),
        doubts=tuple(doubts.items()),
    )


def also(part: Rivals, whole: Rivals) -> Rivals:
    """Rivals on a part of the runs, with the margin and the doubts of all runs beside theirs."""
    doubts = dict((*part.doubts, *whole.doubts))
    return Rivals(closest=part.closest, margin=min(part.margin, whole.margin), doubts=tuple(doubts.items()))


def ranked(first: list[int], chains: list[Chain], price: float) -> tuple[int, ...]:
    """The units of the chains by the weight exp(l - price * size) of the sets that hold them.

    With too few runs the best set is one of many that are nearly as likely. What most of them share is more
    likely to act than what the best one holds (Barbieri & Berger, Ann. Stat. 32, 2004, 870-897). Units of
    the same weight, to a hundredth, stand in the order of `first`, then of their weight.
    """
    worth = _worth(chains, price)
    top = max(value for value, _ in worth.values())
    weight: dict[int, float] = {}
    for members, (value, _) in worth.items():
        for u in members:
            weight[u] = weight.get(u, 0.0) + float(np.exp(value - top))
    total = sum(float(np.exp(value - top)) for value, _ in worth.values())
    order = [*first, *sorted((u for u in weight if u not in first), key=lambda u: (-weight[u], u))]
    return tuple(sorted(order, key=lambda u: -round(weight.get(u, 0.0) / total, 2)))


def entering(chain: Chain, size: int) -> list[int]:
    """The units of a chain's set of a size, the last to be taken out first."""
    order: list[int] = []
    for members in reversed(chain.sets[chain.index(size) :]):
        order += [u for u in members if u not in order]
    return order


def _worth(chains: list[Chain], price: float) -> dict[frozenset[int], tuple[float, Optimum]]:
    """The largest l - price * size of each set in any chain, and where."""
    worth: dict[frozenset[int], tuple[float, Optimum]] = {}
    for chain in chains:
        for members, optimum in zip(chain.sets, chain.optima, strict=True):
            key = frozenset(members)
            value = optimum.value - price * len(members)
            if key not in worth or value > worth[key][0]:
                worth[key] = (value, optimum)
    return worth
