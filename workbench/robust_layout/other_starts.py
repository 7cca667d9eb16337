"""Layouts that a robust loop makes from other starts: is the best of its rounds a good local optimum?

The optimiser is local. When a layout has been attacked in vain, others are made for the same cases from the
layout of one case, that in which the layout of the nominal case is worst, from the start of the problem and
from random densities, until one agrees with the best within the tolerance. One that is worse gets more
evaluations first; one that is better becomes the best, and is attacked in its turn. A later call goes on from
the layouts of the earlier ones, since cases have joined in between.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.robust_layout.cases import Optimised
from workbench.robust_layout.judged import JudgedLayouts
from workbench.robust_layout.record import OtherStartsFound, excess
from workbench.space.streams import stream

__all__ = ["OtherStarts", "random_densities"]

Array = NDArray[np.float64]

LONGER = 2  # optimisations more, at most, of a layout that is worse than the best


@dataclass(slots=True, kw_only=True)
class OtherStarts:
    """Layouts from other starts, by the title of the start.

    optimised: best layout so far, densities to start from (None: the problem's) -> the layout for the cases
        that are active, None when it cannot be made.
    starts: title -> densities.
    """

    judged: JudgedLayouts
    optimised: Callable[[str, Array | None], Optimised | None]
    starts: Mapping[str, Array | None]
    tolerance: float
    tell: Callable[[str], None]

    def agree(self) -> bool:
        """Make or continue layouts until one agrees with the best of the others; whether one does."""
        return any(self._reaches_the_best(title) for title in self.starts)

    def first(self) -> None:
        """Make a layout from the first of the other starts, if there is none yet: the rounds are spent."""
        if not any(self.judged.of(title) for title in self.starts):
            self._reaches_the_best(next(iter(self.starts)))

    def found(self) -> OtherStartsFound | None:
        """The best layout of another start than that of the best one, over all cases; None without any."""
        judged = self.judged
        if not judged.origins:
            return None
        best = judged.best(list(judged.origins))
        others = judged.of(judged.origins[best], others=True)
        if not others:
            return None
        worst = judged.worst(judged.best(others))
        apart = excess(worst, judged.worst(best))
        tried = tuple(dict.fromkeys(judged.origins.values()))
        return OtherStartsFound(worst=worst, apart=apart, agrees=apart <= self.tolerance, starts=tried)

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
            self.tell(f"the layout from the {title}{f', continued {turn}' if turn else ''}")
            made = self.optimised(judged.best(), start)
            if made is None:
                return False
            added = judged.add(f"{title}, continued {len(mine)}" if mine else title, made, origin=title)
            now, turns_left = judged.worst(judged.best(added)), LONGER - turn
            best = judged.worst(judged.best())
            if now >= before or now - best > turns_left * (before - now) + self.tolerance * abs(best):
                break  # it has ended elsewhere
        return self._near(title)

    def _near(self, title: str) -> bool:
        """Whether the best layout of this start is as good as that of all others, within the tolerance."""
        judged = self.judged
        mine, others = judged.of(title), judged.of(title, others=True)
        if not mine or not others:
            return False
        ends = [judged.worst(judged.best(names)) for names in (mine, others)]
        return excess(max(ends), min(ends)) <= self.tolerance


def random_densities(problem: LayoutProblem, *, seed: int) -> Array:
    """Densities drawn evenly between their bounds, brought into the budgets."""
    rng = stream(seed, "random start of a layout")
    drawn = problem.lower + rng.random(len(problem.lower)) * (problem.upper - problem.lower)
    found: Array = problem.into_budgets(drawn)
    return found
