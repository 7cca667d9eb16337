"""What may be chosen: groups of members, on or off together, at most so many, some of them excluded."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.groups import twins
from ..formulation.problem import InvalidLayout, LayoutProblem

__all__ = ["Choices", "choices", "twins"]

Array = NDArray[np.float64]
On = NDArray[np.bool_]

_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """Groups to choose from.

    problem: its bounds are the two states of a member    table (groups, members): which members a group holds
    count: the largest number of members on    sizes (groups,): members of each group
    costs (budgets, groups), limits (budgets,): of the problem's budgets, above the lower bounds
    forbidden: pairs of groups of which one may be on    always: groups that are on
    """

    problem: LayoutProblem
    table: Array
    count: int
    sizes: NDArray[np.intp]
    costs: Array
    limits: Array
    forbidden: tuple[tuple[int, int], ...]
    always: On

    @property
    def groups(self) -> int:
        """Number of groups."""
        return len(self.sizes)

    def density(self, on: On) -> Array:
        """(members,): the upper bound for members of groups that are on, the lower bound for all others."""
        lower, upper = self.problem.lower, self.problem.upper
        return np.asarray(np.where(on @ self.table > 0, upper, lower), dtype=float)

    def allowed(self, on: On) -> bool:
        """True when count, budgets and exclusions are met."""
        return bool(
            self.sizes @ on <= self.count
            and (self.costs @ on <= self.limits + _ROUNDING * np.maximum(np.abs(self.limits), 1e-300)).all()
            and not any(on[i] and on[j] for i, j in self.forbidden)
            and (on | ~self.always).all()
        )

    def everything(self, *, at_most: int) -> list[On] | None:
        """All that may be chosen, or None when there is more than `at_most` (or it takes long to see)."""
        if self.groups > 40 or self._subsets() > 2e5:
            return None
        found: list[On] = []
        for on in self._each():
            if self.allowed(on):
                found.append(on)
                if len(found) > at_most:
                    return None
        return found

    def _subsets(self) -> float:
        most = min(self.groups, self.count // max(1, int(self.sizes.min())))
        return float(sum(math.comb(self.groups, k) for k in range(most + 1)))

    def _each(self) -> Iterator[On]:
        most = min(self.groups, self.count // max(1, int(self.sizes.min())))
        for k in range(most + 1):
            for which in itertools.combinations(range(self.groups), k):
                on = np.zeros(self.groups, dtype=bool)
                on[list(which)] = True
                yield on

    def beside(self, on: On) -> list[On]:
        """All choices one step away: a group more, a group less, or one for another."""
        found = []
        inside, outside = np.flatnonzero(on), np.flatnonzero(~on)
        steps = [
            *(([], [j]) for j in outside),
            *(([i], []) for i in inside),
            *(([i], [j]) for i in inside for j in outside),
        ]
        for off, more in steps:
            other = on.copy()
            other[off], other[more] = False, True
            if self.allowed(other):
                found.append(other)
        return found

    def filled(self, order: NDArray[np.intp]) -> On:
        """Groups taken in an order as long as they fit."""
        on = self.always.copy()
        for group in order:
            if not on[group]:
                on[group] = True
                on[group] = self.allowed(on)
        return on


def choices(
    problem: LayoutProblem,
    count: int,
    *,
    groups: Sequence[Sequence[int]] = (),
    forbidden: Sequence[tuple[int, int]] = (),
    always: Sequence[int] = (),
) -> Choices:
    """Choices of a problem: members that stand in no group are groups of their own, fixed ones are left out.

    groups: members that are on or off together    forbidden: pairs of members of which one may be on
    always: members that are on.    Raises InvalidLayout for members that do not exist or stand in two groups,
    and when nothing may be chosen.
    """
    free = problem.free
    seen: set[int] = set()
    tied: list[list[int]] = []
    for group in groups:
        members = [int(i) for i in group]
        for i in members:
            if not 0 <= i < problem.members or i in seen or not free[i]:
                raise InvalidLayout(
                    f"groups need free members from 0 to {problem.members - 1}, each in one group; got {i} "
                    f"in {members}. Leave it out"
                )
            seen.add(i)
        tied.append(members)
    tied += [[int(i)] for i in np.flatnonzero(free) if int(i) not in seen]
    table = np.zeros((len(tied), problem.members))
    for g, members in enumerate(tied):
        table[g, members] = 1.0
    home = {i: g for g, members in enumerate(tied) for i in members}
    for i in (*always, *(k for pair in forbidden for k in pair)):
        if int(i) not in home:
            raise InvalidLayout(
                f"always and forbidden need free members from 0 to {problem.members - 1}, got {i}"
            )
    kept = np.zeros(len(tied), dtype=bool)
    kept[[home[int(i)] for i in always]] = True
    width = problem.upper - problem.lower
    found = Choices(
        problem=problem, table=table, count=int(count), sizes=table.sum(axis=1).astype(int),
        costs=problem.costs * width @ table.T, limits=problem.limits - problem.costs @ problem.lower,
        forbidden=tuple((home[int(i)], home[int(j)]) for i, j in forbidden if home[int(i)] != home[int(j)]),
        always=kept,
    )  # fmt: skip
    if count < 1 or not found.allowed(kept):
        raise InvalidLayout(
            f"count needs to be >= 1 and to leave room for what is always on, with the budgets and without "
            f"forbidden pairs; got count={count} and {len(always)} members that are always on"
        )
    return found
