"""Layouts that a robust loop makes from other starts: is the best of its rounds a good local optimum?

The optimiser is local. When a layout has been attacked in vain, others are made for the same cases from the
layout of one case, that in which the layout of the nominal case is worst, from the start of the problem and
from random densities, until one agrees with the best within the tolerance. One that is worse gets more
evaluations first; one that is better becomes the best, and is attacked in its turn. A later call goes on from
the layouts of the earlier ones, since cases have joined in between.

The first of these searches is one from several starts, which begins at layouts of single cases, too, and
mostly ends at what came of those, wherever it was told to begin. Another of that kind would repeat it, and
agree with it by construction: the others search from their own start alone.

Two layouts agree over the cases that were known when the one of the other start was made: there both were
searched for. Cases that are found later break one and not the other by chance, and a layout for more cases is
no better: where the best one stays within the tolerance of that value over all cases, too, the other start
promises no more than that.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.robust_layout.cases import SAME, Optimised, Search
from workbench.robust_layout.judged import JudgedLayouts
from workbench.robust_layout.record import OtherStartsFound, excess
from workbench.space.streams import stream

__all__ = ["OtherStarts", "random_densities", "starts_of"]

Array = NDArray[np.float64]

LONGER = 2  # optimisations more, at most, of a layout that is worse than the best


@dataclass(slots=True, kw_only=True)
class OtherStarts:
    """Layouts from other starts, by the title of the start.

    optimised: best layout so far, densities to start from (None: the problem's), how to search -> the
        layout for the cases that are active, None when it cannot be made.
    starts: title -> densities.
    """

    judged: JudgedLayouts
    optimised: Callable[[str, Array | None, Search], Optimised | None]
    starts: Mapping[str, Array | None]
    tolerance: float
    tell: Callable[[str], None]
    _continued: dict[str, int] = field(default_factory=dict)  # times, by the title of the start

    def agree(self) -> bool:
        """Make or continue layouts until one agrees with the best of the others; whether one does."""
        return any(self._reaches_the_best(title) for title in self.starts)

    def first(self) -> None:
        """Make a layout from the first of the other starts, if there is none yet: the rounds are spent."""
        if not any(self.judged.of(title) for title in self.starts):
            self._reaches_the_best(next(iter(self.starts)))

    def agrees(self) -> bool:
        """Whether one does now, without making any."""
        found = self.found()
        return found is not None and found.agrees

    def found(self, beside: str | None = None) -> OtherStartsFound | None:
        """The layout of another start than that of the best one that is nearest to it; None without any.

        beside: the layout that they are held beside, instead of the best; a trivial one has no start, and
            all are other ones.
        """
        judged = self.judged
        if not judged.origins:
            return None
        best = judged.best(list(judged.origins)) if beside is None else beside
        found = [self._beside(best, name) for name in judged.of(judged.origins.get(best, ""), others=True)]
        return min((one for pair in found for one in pair), key=lambda one: one.apart, default=None)

    def _beside(self, best: str, other: str) -> list[OtherStartsFound]:
        """A layout beside the best one over all cases, and over those that were known when it was made."""
        judged, top = self.judged, self.judged.worst(best)
        tried = tuple(dict.fromkeys(judged.origins.values()))
        found = []
        for cases in {len(judged.cases), judged.known.get(other, len(judged.cases))}:
            worst = judged.worst(other, first=cases)
            beside = (judged.worst(best, first=cases), top)
            apart = max(excess(max(worst, v), min(worst, v)) for v in beside)
            found.append(OtherStartsFound(
                worst=worst, cases=cases, apart=apart, agrees=apart <= self.tolerance, starts=tried
            ))  # fmt: skip
        return found

    def _reaches_the_best(self, title: str) -> bool:
        """One start, and its layout continued until that agrees with the best or gains too little to get
        there in the turns that are left."""
        judged = self.judged
        for turn in range(1 + LONGER):
            mine = judged.of(title)
            if mine and self._near(title):
                return True
            start = judged.layouts[judged.best(mine)] if mine else self.starts[title]
            before = judged.worst(judged.best(mine)) if mine else float("inf")
            number = self._continued[title] = self._continued.get(title, 0) + 1 if mine else 0
            name = f"{title}, continued {number}" if number else title
            self.tell(f"the layout from the {name}")
            made = self.optimised(
                judged.best(), start, "binding cases" if mine else self._first_search(title)
            )
            if made is None:
                return False
            if judged.same_as(made.density, mine):
                self.tell(f"the {name}: the layout is the same as before")
                break
            added = judged.add(name, made, origin=title)
            now, turns_left = judged.worst(judged.best(added)), LONGER - turn
            best = judged.worst(judged.best())
            if now >= before or now - best > turns_left * (before - now) + self.tolerance * abs(best):
                break  # it has ended elsewhere
        return self._near(title)

    def _first_search(self, title: str) -> Search:
        """Of a start: the wide one once, by the first of all."""
        return "several starts" if title == next(iter(self.starts)) else "one start"

    def _near(self, title: str) -> bool:
        """Whether this start and the others agree on the best layout."""
        judged = self.judged
        mine, others = judged.of(title), judged.of(title, others=True)
        if not mine or not others:
            return False
        best = judged.best([*mine, *others])
        witnesses = others if best in mine else mine
        return any(one.agrees for name in witnesses for one in self._beside(best, name))


def starts_of(problem: LayoutProblem, alone: Array | None, *, seed: int) -> dict[str, Array]:
    """Title -> densities of the other starts, where these are others.

    alone: the layout of the case in which that of the nominal one is worst, None where there is none.
    """
    given, random = problem.into_budgets(problem.start), random_densities(problem, seed=seed)
    found: dict[str, Array] = {} if alone is None else {"second start": alone}
    for title, density in (("third start", given), ("fourth start", random)):
        if all(np.abs(density - other).max() > SAME for other in found.values()):
            found[title] = density
    return found


def random_densities(problem: LayoutProblem, *, seed: int) -> Array:
    """Densities drawn evenly between their bounds, brought into the budgets."""
    rng = stream(seed, "random start of a layout")
    drawn = problem.lower + rng.random(len(problem.lower)) * (problem.upper - problem.lower)
    found: Array = problem.into_budgets(drawn)
    return found
