"""A certificate of the worst case by interval enclosures: branch and bound over boxes of the space.

An enclosure is a function of a box that returns bounds of the response over all of it,

    low <= f(x) <= high   for every x with lower <= x <= upper

as interval arithmetic gives them for a formula. The box with the highest bound is halved until no bound
exceeds the worst true run by more than the tolerance, or the calls are spent (Moore 1966; Hansen and Walster
2004). Whatever bound is highest then holds for the whole space: stopping early leaves it true, only wide.

Which coordinate to halve is learnt: the one whose halvings lowered the bounds most, for its width, so that
coordinates without effect are not halved over and over. Every `FAIR`-th halving takes the widest, which keeps
the boxes shrinking in all coordinates.
"""

import heapq
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from math import inf, isnan
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.search.evidence.gap import Gap
from workbench.search.runs.unit_space import SearchSpace

__all__ = ["Enclosure", "check_enclosure", "enclosure_gap"]

FAIR = 4
NARROWEST = 1e-9  # of the unit interval: halving further would only meet rounding
ROUNDING = 1e-9  # relative, by which a run may exceed the bound of its box


@dataclass(frozen=True, slots=True)
class Enclosure:
    """`function(lower, upper)` takes two mappings of all parameters and returns bounds of the response over
    the box between them, in its unit; `calls` is how often it may be asked. Words are the same in both.
    """

    function: Callable[[Mapping[str, Any], Mapping[str, Any]], tuple[float, float]]
    calls: int = 2000

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise StudyError(f"an enclosure needs a function of (lower, upper), got {self.function!r:.100}")
        if self.calls < 1:
            raise StudyError(f"an enclosure needs calls >= 1, got {self.calls}")


@dataclass(slots=True)
class _Box:
    """Unit corners (d,) and the bound of the signed response between them."""

    low: np.ndarray
    high: np.ndarray
    bound: float = inf
    depth: int = 0


class _Search:
    """Boxes by bound, highest first; which coordinates were worth halving."""

    def __init__(
        self, where: SearchSpace, enclosure: Enclosure, u: np.ndarray, v: np.ndarray, sign: float
    ) -> None:
        self.where, self.enclosure, self.sign = where, enclosure, sign
        self.u, self.v = u, v
        self.calls = 0
        self.lowered = np.full(where.dimension, inf)  # per width, the mean of what halvings gained
        self.halved = np.zeros(where.dimension)

    def bounded(self, box: _Box) -> _Box:
        """The box with its bound asked; never higher than that of the box it came from."""
        self.calls += 1
        lower, upper = self.where.rows(np.array([box.low, box.high]))
        try:
            answer = self.enclosure.function(lower, upper)
        except Exception as exc:  # a user's function may raise anything
            raise StudyError(
                f"enclosure raised {type(exc).__name__}: {exc}, between {lower} and {upper}. Let it return "
                "(-inf, inf) where it knows no bound"
            ) from exc
        try:
            low, high = (float(value) for value in answer)
        except (TypeError, ValueError):
            raise StudyError(f"enclosure needs to return a pair (low, high), got {answer!r:.200}") from None
        if isnan(low) or isnan(high) or low > high:
            raise StudyError(f"enclosure needs low <= high, got {low} and {high} between {lower} and {upper}")
        bound = high if self.sign > 0 else -low
        inside = np.all((self.u >= box.low - 1e-12) & (self.u <= box.high + 1e-12), axis=1)
        worst = float(self.v[inside].max(initial=-inf))
        if worst > bound + ROUNDING * max(1.0, abs(worst)):
            raise StudyError(
                f"enclosure says the response stays {'below' if self.sign > 0 else 'above'} "
                f"{self.sign * bound:.6g} between {lower} and {upper}, but a run there gave "
                f"{self.sign * worst:.6g}. Correct the enclosure"
            )
        box.bound = min(bound, box.bound)
        return box

    def roots(self) -> list[_Box]:
        """One box for every combination of words, which have no order to halve."""
        is_word = np.array([not p.is_numeric for p in self.where.space.parameters])
        ends = [
            grid if word and grid is not None else np.array([0.0])
            for grid, word in zip(self.where.levels, is_word, strict=True)
        ]
        boxes = []
        for combination in product(*ends):
            low = np.array(combination)
            boxes.append(_Box(low=low, high=np.where(is_word, low, 1.0)))
        return boxes

    def halves(self, box: _Box) -> tuple[int, _Box, _Box] | None:
        """The box cut in two, and where; None when it is a point."""
        width = box.high - box.low
        width[width < NARROWEST] = 0.0
        if not width.any():
            return None
        fair = box.depth % FAIR == FAIR - 1
        worth = width if fair else np.where(width > 0, np.minimum(self.lowered, 1e300) * width, -1.0)
        j = int(np.argmax(worth))
        middle = 0.5 * (box.low[j] + box.high[j])
        grid = self.where.levels[j]
        below, above = middle, middle
        if grid is not None:
            below, above = float(grid[grid <= middle].max()), float(grid[grid > middle].min())
        left = _Box(low=box.low, high=box.high.copy(), bound=box.bound, depth=box.depth + 1)
        right = _Box(low=box.low.copy(), high=box.high, bound=box.bound, depth=box.depth + 1)
        left.high[j], right.low[j] = below, above
        return j, left, right

    def learn(self, j: int, box: _Box, children: tuple[_Box, _Box]) -> None:
        """Remember what halving coordinate j gained."""
        if box.bound == inf:
            return
        gained = 2 * box.bound - children[0].bound - children[1].bound
        gained /= float(box.high[j] - box.low[j])
        before = self.lowered[j] if self.halved[j] else 0.0
        self.halved[j] += 1
        self.lowered[j] = before + (gained - before) / self.halved[j]


def check_enclosure(where: SearchSpace, enclosure: Enclosure) -> None:
    """Ask the enclosure once, over the whole box, so that a mistake in it costs no run.

    Raises:
        StudyError: it raises, or returns no bounds.
    """
    search = _Search(where, enclosure, np.empty((0, where.dimension)), np.empty(0), 1.0)
    search.bounded(search.roots()[0])


def enclosure_gap(
    where: SearchSpace,
    enclosure: Enclosure,
    *,
    u: np.ndarray,
    v: np.ndarray,
    sign: float = 1.0,
    tolerance: float = 0.0,
) -> Gap:
    """The certified gap above the best of the signed values v (n,) of runs at u (n, d).

    `sign`: v = sign * response. The search ends when no bound exceeds the best run by more than `tolerance`,
    in the unit of the response; `Gap.closed` says whether it came to that.

    Raises:
        StudyError: the enclosure returns no bounds, or the runs contradict it.
    """
    search = _Search(where, enclosure, u, v, sign)
    best = float(v.max())
    queue: list[tuple[float, int, _Box]] = []
    count = 0
    settled = best  # highest bound of boxes that cannot be halved

    def push(box: _Box) -> None:
        nonlocal count
        count += 1
        if box.bound > best:
            heapq.heappush(queue, (-box.bound, count, box))

    for root in search.roots():
        push(search.bounded(root) if search.calls < enclosure.calls else root)
    while queue and -queue[0][0] > best + tolerance and search.calls + 2 <= enclosure.calls:
        box = heapq.heappop(queue)[2]
        cut = search.halves(box)
        if cut is None:
            settled = max(settled, box.bound)
            continue
        j, left, right = cut
        children = search.bounded(left), search.bounded(right)
        search.learn(j, box, children)
        for child in children:
            push(child)
    upper = max(settled, -queue[0][0] if queue else best)
    return Gap(
        upper=upper,
        width=upper - best,
        coverage=1.0,
        kind="enclosure",
        calls=search.calls,
        closed=upper <= best + tolerance,
    )
