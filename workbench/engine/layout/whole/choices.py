"""What may be chosen: groups of members, off or in one of the given sizes, at most so many, some excluded.

A choice is a vector of zeros and ones over *states*: a group in one of its sizes. Densities, costs of
material and tangents are linear in it; at most one state of a group is on.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.groups import twins
from ..formulation.problem import InvalidLayout, LayoutProblem
from .spending import Bills, Spending, bills

__all__ = ["Choices", "choices", "twins"]

Array = NDArray[np.float64]
On = NDArray[np.bool_]
Numbers = NDArray[np.intp]

_ROUNDING = 1e-9
_MOST = 2e5  # choices that are looked through


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """States of groups to choose from.

    problem: its bounds are the least and the full density of a member    table (states, members): the share
    of that range which members have in a state; 1 where a group has one size
    group (states,): which group each is a state of    sizes (states,): members of its group
    count: the largest number of members on
    costs (budgets, states), limits (budgets,): of the problem's budgets, above the lower bounds
    forbidden: pairs of groups of which one may be on    always (groups,): groups that are on
    spending: what members and anchors cost, if asked for
    """

    problem: LayoutProblem
    table: Array
    group: Numbers
    count: int
    sizes: Numbers
    costs: Array
    limits: Array
    forbidden: tuple[tuple[int, int], ...]
    always: On
    spending: Bills | None = None

    @property
    def groups(self) -> int:
        """Number of groups."""
        return len(self.always)

    @property
    def states(self) -> int:
        """Number of states, those of all groups."""
        return len(self.group)

    def density(self, on: On) -> Array:
        """(members,): the lower bound for members that are off, their size for all others."""
        lower, upper = self.problem.lower, self.problem.upper
        share = on @ self.table
        return np.asarray(np.where(share == 1.0, upper, lower + share * (upper - lower)), dtype=float)

    def groups_on(self, on: On) -> NDArray[np.intp]:
        """(groups,): how many states of each group are on."""
        return np.bincount(self.group, weights=on, minlength=self.groups).astype(int)

    def fits(self, on: On) -> bool:
        """True when count, budgets, spending and exclusions are met, whatever is always on."""
        return bool(self._fit(on[None])[0])

    def allowed(self, on: On) -> bool:
        """True when this may be chosen."""
        return self.fits(on) and bool((self.groups_on(on) > 0)[self.always].all())

    def _fit(self, several: On) -> On:
        """(n,) of choices (n, states); all at once, since a search asks for thousands a step."""
        given = several.astype(float)  # products of whole numbers are slow
        kept = given @ self.sizes.astype(float) <= self.count
        slack = _ROUNDING * np.maximum(np.abs(self.limits), 1e-300)
        kept &= (given @ self.costs.T <= self.limits + slack).all(axis=1)
        if self.states > self.groups:
            kept &= (self._counted(several) <= 1).all(axis=1)
        for i, j in self.forbidden:
            kept &= ~(several[:, self.group == i].any(axis=1) & several[:, self.group == j].any(axis=1))
        if self.spending is not None:
            for k in np.flatnonzero(kept):
                kept[k] = self.spending.met(several[k])
        return np.asarray(kept)

    def _counted(self, several: On) -> Numbers:
        """(n, groups): how many states of each group are on in choices (n, states)."""
        order = np.argsort(self.group, kind="stable")
        starts = np.searchsorted(self.group[order], np.arange(self.groups))
        return np.add.reduceat(several[:, order].astype(np.intp), starts, axis=1)

    def everything(self, *, at_most: int) -> list[On] | None:
        """All that may be chosen, or None when there is more than `at_most` (or it takes long to see)."""
        if self.groups > 40 or self._subsets() > _MOST:
            return None
        found: list[On] = []
        for on in self._each():
            if self.allowed(on):
                found.append(on)
                if len(found) > at_most:
                    return None
        return found

    def _most(self) -> int:
        return min(self.groups, self.count // max(1, int(self.sizes.min())))

    def _subsets(self) -> float:
        each = int(np.bincount(self.group).max())
        return float(sum(math.comb(self.groups, k) * each**k for k in range(self._most() + 1)))

    def _each(self) -> Iterator[On]:
        states = [np.flatnonzero(self.group == g) for g in range(self.groups)]
        for k in range(self._most() + 1):
            for which in itertools.combinations(states, k):
                for some in itertools.product(*which):
                    on = np.zeros(self.states, dtype=bool)
                    on[list(some)] = True
                    yield on

    def beside(self, on: On) -> list[On]:
        """All choices one step away: a state more, a state less, one for another (another size included)."""
        inside, outside = np.flatnonzero(on), np.flatnonzero(~on)
        free = self.groups_on(on)[self.group[outside]] == 0  # of the states outside: is their group off?
        swaps = free | (self.group[inside][:, None] == self.group[outside])  # (inside, outside)
        i, j = np.nonzero(swaps)
        off = np.concatenate([np.full(free.sum(), -1), inside, inside[i]])
        more = np.concatenate([outside[free], np.full(len(inside), -1), outside[j]])
        several = np.repeat(on[None], len(off), axis=0)
        rows = np.arange(len(off))
        several[rows[off >= 0], off[off >= 0]] = False
        several[rows[more >= 0], more[more >= 0]] = True
        kept = self._fit(several)
        if self.always.any():
            kept &= (self._counted(several)[:, self.always] > 0).all(axis=1)
        return list(several[kept])

    def filled(self, order: NDArray[np.intp]) -> On:
        """States taken in an order as long as they fit, beside what is always on in the smallest size."""
        on = self._least()
        waiting = self.always.copy()  # in the smallest size until the order brings another
        for state in order:
            group = self.group[state]
            taken = np.flatnonzero(on & (self.group == group))
            if taken.size and not waiting[group]:
                continue
            other = on.copy()
            other[taken], other[state] = False, True
            if self.fits(other):
                on, waiting[group] = other, False
        return on

    def _least(self) -> On:
        on = np.zeros(self.states, dtype=bool)
        for g in np.flatnonzero(self.always):
            states = np.flatnonzero(self.group == g)
            on[states[self.table[states].sum(axis=1).argmin()]] = True
        return on


def choices(
    problem: LayoutProblem,
    count: int,
    *,
    groups: Sequence[Sequence[int]] = (),
    forbidden: Sequence[tuple[int, int]] = (),
    always: Sequence[int] = (),
    sizes: Sequence[float] = (),
    spending: Spending | None = None,
) -> Choices:
    """Choices of a problem: members that stand in no group are groups of their own, fixed ones are left out.

    groups: members that are on or off together    forbidden: pairs of members of which one may be on
    always: members that are on.    sizes: densities that members which are on may have; () for their upper
    bounds.    Raises InvalidLayout for members that do not exist or stand in two groups, for sizes that are
    not between the bounds, and when nothing may be chosen.
    """
    free = problem.free
    if free[problem.densities :].any():
        raise InvalidLayout(
            "whole members need the law variables fixed: `variables_held(problem, design)` holds firing times"
        )
    tied = _groups(problem, groups)
    home = {i: g for g, members in enumerate(tied) for i in members}
    for i in (*always, *(k for pair in forbidden for k in pair)):
        if int(i) not in home:
            raise InvalidLayout(
                f"always and forbidden need free members from 0 to {problem.members - 1}, got {i}"
            )
    kept = np.zeros(len(tied), dtype=bool)
    kept[[home[int(i)] for i in always]] = True
    width = problem.upper - problem.lower
    shares = _shares(problem, sizes)
    table = np.zeros((len(tied) * len(shares), problem.members))
    for g, members in enumerate(tied):
        for s, share in enumerate(shares):
            table[g * len(shares) + s, members] = share[members]
    counts = np.repeat([len(members) for members in tied], len(shares))
    found = Choices(
        problem=problem, table=table, group=np.repeat(np.arange(len(tied)), len(shares)), count=int(count),
        sizes=counts, costs=problem.costs * width @ table.T,
        limits=problem.limits - problem.costs @ problem.lower,
        forbidden=tuple((home[int(i)], home[int(j)]) for i, j in forbidden if home[int(i)] != home[int(j)]),
        always=kept, spending=None if spending is None else bills(spending, problem, table > 0),
    )  # fmt: skip
    if count < 1 or not found.allowed(found.filled(np.zeros(0, dtype=np.intp))):
        raise InvalidLayout(
            f"count needs to be >= 1 and to leave room for what is always on, with the budgets and without "
            f"forbidden pairs; got count={count} and {len(always)} members that are always on"
        )
    return found


def _groups(problem: LayoutProblem, groups: Sequence[Sequence[int]]) -> list[list[int]]:
    free, seen, tied = problem.free, set[int](), []
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
    return [*tied, *([int(i)] for i in np.flatnonzero(free) if int(i) not in seen)]


def _shares(problem: LayoutProblem, sizes: Sequence[float]) -> list[Array]:
    """The share of the range of every member in each size, ascending."""
    if not len(sizes):
        return [np.ones(problem.members)]
    free, width = problem.free, problem.upper - problem.lower
    found = []
    for size in sorted({float(s) for s in sizes}):
        if not ((problem.lower < size) & (size <= problem.upper))[free].all():
            raise InvalidLayout(
                f"sizes need to lie above the lower and up to the upper bound of every member, got {size:g}"
            )
        share = np.where(free, (size - problem.lower) / np.where(free, width, 1.0), 1.0)
        found.append(np.where(problem.upper == size, 1.0, share))
    return found
