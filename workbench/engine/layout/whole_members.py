"""whole_members: at most n members, off or in given sizes, simulated as they are; the price of rounding.

| how many choices, what rows | what is done | what is said |
|---|---|---|
| no more than the simulations allowed | all of them are simulated | proved by enumeration |
| convex rows (`convex=True`) | outer approximation, gradients as tangents; else as below | proved when met |
| anything else | search by predictions of histories from all runs and their slopes | searched |

The relaxed layout, densities between the bounds and their shares summing up to n, comes first: it starts the
search, and what whole members cost beside it is the price of rounding.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .formulation.groups import tied
from .formulation.problem import InvalidLayout, LayoutProblem
from .optimise import as_layout_problem, optimise_layout
from .outcome.result import LayoutResult
from .whole.choices import Choices, choices
from .whole.evaluated import Evaluated
from .whole.outer_approximation import outer_approximation
from .whole.response_space import response_space_search
from .whole.runs import Runs
from .whole.spending import Spending

__all__ = ["WholeLayout", "WholeStatus", "whole_members"]

Array = NDArray[np.float64]

_CLOSED = 1e-6
_SHARE = 0.14  # of the evaluations for the relaxed layout, at most
_EVEN = 1e-6  # shares of a start that differ by less are the same
_POLISHED = 3  # of the best choices, where densities between a minimum and the upper bound are allowed


class WholeStatus(Enum):
    """How much is known of the layout returned."""

    ENUMERATED = "Proved: all choices were simulated."
    BOUNDED = "Proved: a lower bound over all choices meets the value."
    SWAPPED = "Searched: no step of one member more, less or for another improves it; nothing is proved."
    LIMIT = "Searched until the evaluations were used up; nothing is proved."
    NONE_FOUND = "No choice that was looked at could be simulated and meets the constraints."


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeLayout:
    """The best layout of whole members.

    density (members,): at the bounds, or from the minimum to the upper bound where one was given
    value: simulated    members: those on    bound: nothing is better than this; -inf where nothing is known
    relaxed: value of the relaxed layout (convex rows: a bound as good as it has converged)
    evaluations: all, the relaxed layout included    runners_up: (value, members) of the next best
    spent, anchors: what members and anchors cost, and how many anchors are used; nan and -1 if not asked for
    """

    density: Array
    value: float
    members: tuple[int, ...]
    status: WholeStatus
    bound: float
    relaxed: float
    evaluations: int
    runners_up: tuple[tuple[float, tuple[int, ...]], ...] = ()
    spent: float = np.nan
    anchors: int = -1

    @property
    def price_of_rounding(self) -> float:
        """What whole members cost beside the relaxed layout, relative to it."""
        return (self.value - self.relaxed) / abs(self.relaxed)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Plain sentences."""
        said = [self.status.value]
        if np.isfinite(self.value):
            price = f"The price of rounding is {100 * self.price_of_rounding:.3g} %."
            if self.value < self.relaxed:
                price = "The search in fractions has not come as far: the price of rounding is not known."
            said.append(
                f"{len(self.members)} whole members: {self.value:.6g}; with fractions "
                f"{self.relaxed:.6g}. {price}"
            )
        if np.isfinite(self.spent):
            used = f" and {self.anchors} anchors" if self.anchors else ""
            said.append(f"{self.spent:.6g} is spent on {len(self.members)} members{used}.")
        if self.status in (WholeStatus.LIMIT, WholeStatus.SWAPPED) and np.isfinite(self.bound):
            said.append(f"No choice is better than {self.bound:.6g}.")
        return tuple(said)


def whole_members(
    problem: Any,
    count: int,
    *,
    evaluations: int = 300,
    groups: Sequence[Sequence[int]] = (),
    forbidden: Sequence[tuple[int, int]] = (),
    always: Sequence[int] = (),
    minimum: float | None = None,
    sizes: Sequence[float] = (),
    spending: Spending | None = None,
    seed: int = 0,
    progress: Callable[[int, float, float], None] | None = None,
) -> WholeLayout:
    """The best layout with at most `count` members on, within the budgets.

    Args:
        problem: as for `optimise_layout`; off is the lower bound, on the upper one. The relaxed layout begins
            at an uneven start, which is rounded itself, too.
        evaluations: simulations in all, those of the relaxed layout included.
        groups: members that are on or off together (`whole.choices.twins`).    always: members that are on.
        forbidden: pairs of members of which one at most may be on.
        minimum: a density from which to the upper bound members that are on may vary; None: on is on.
        sizes: densities that members which are on may have, each of its own; () for the upper bounds.
        spending: what members and anchors cost and what may be spent.
        seed: of the random choices.    progress: called with the number, the value and the best so far.

    Raises InvalidLayout for a count, groups or members that cannot be met.

    >>> from workbench.engine.layout.formulation.problem import static_problem
    >>> w = np.array([1.0, 5.0, 2.0, 4.0])
    >>> one = static_problem(lambda a: (float((w / (0.1 + a)).sum()), -w / (0.1 + a) ** 2),
    ...                      start=np.full(4, 0.5))
    >>> found = whole_members(one, 2)
    >>> found.members, found.status.name
    ((1, 3), 'ENUMERATED')
    """
    problem = as_layout_problem(problem)
    if evaluations < 2:
        raise InvalidLayout(f"evaluations needs to be >= 2, got {evaluations}")
    if (
        minimum is not None
        and not ((minimum >= problem.lower) & (minimum <= problem.upper))[problem.free].all()
    ):
        raise InvalidLayout(f"minimum needs to lie between the bounds of every member, got {minimum}")
    if minimum is not None and len(sizes):
        raise InvalidLayout("give either sizes or a minimum: densities above a minimum are no given sizes")
    open_ = choices(
        problem, count, groups=groups, forbidden=forbidden, always=always, sizes=sizes, spending=spending
    )
    runs = Runs(problem=problem, limit=evaluations)
    relaxed = _relaxed(open_, max(1, int(_SHARE * evaluations)), runs)
    polish = 0 if minimum is None else max(1, evaluations // 6)
    seen = Evaluated(
        choices=open_, limit=max(1, evaluations - relaxed.evaluations - polish), runs=runs, progress=progress
    )
    status, bound = _choose(seen, open_, relaxed, np.random.default_rng(seed))
    best = seen.best
    if not np.isfinite(seen.values[best]):
        return WholeLayout(
            density=open_.density(seen.on[best]), value=np.inf, members=(), status=WholeStatus.NONE_FOUND,
            bound=bound, relaxed=relaxed.value, evaluations=relaxed.evaluations + len(seen.values),
        )  # fmt: skip
    order = [k for k in np.argsort(seen.values, kind="stable")[:6] if np.isfinite(seen.values[k])]
    density, value, spent = open_.density(seen.on[best]), seen.values[best], 0
    if minimum is not None:
        density, value, best, spent = _polished(seen, order[:_POLISHED], minimum, polish)
        status = WholeStatus.LIMIT  # densities between are another problem, of which nothing is proved
        bound = -np.inf
    return WholeLayout(
        density=density, value=value, members=_members(open_, seen, best), status=status, bound=bound,
        relaxed=relaxed.value, evaluations=relaxed.evaluations + len(seen.values) + spent,
        runners_up=tuple((seen.values[k], _members(open_, seen, k)) for k in order if k != best),
        spent=np.nan if open_.spending is None else open_.spending.spent(seen.on[best]),
        anchors=-1 if open_.spending is None else open_.spending.used(seen.on[best]),
    )  # fmt: skip


def _choose(
    seen: Evaluated, open_: Choices, relaxed: LayoutResult, rng: np.random.Generator
) -> tuple[WholeStatus, float]:
    problem = open_.problem
    everything = open_.everything(at_most=seen.limit)
    if everything is not None:
        for on in everything:
            seen.look(on)
        return WholeStatus.ENUMERATED, min(seen.values)
    width = np.where(problem.free, problem.upper - problem.lower, 1.0)
    for density in (relaxed.density, *([problem.start] if _is_uneven(problem) else [])):
        seen.look(open_.filled(_by_share(open_, (density - problem.lower) / width)))
    bound = -np.inf
    if problem.convex and not problem.checked(problem.into_budgets(problem.start)).constraints.size:
        outer = outer_approximation(seen, open_, until=max(2, seen.limit // 2))
        bound = max(outer, relaxed.value * (1 - relaxed.kkt))
        best = seen.values[seen.best]
        if np.isfinite(best) and best - bound <= _CLOSED * abs(best):
            return WholeStatus.BOUNDED, bound
    settled = response_space_search(seen, open_, rng=rng)
    return (WholeStatus.SWAPPED if settled else WholeStatus.LIMIT), bound


def _is_uneven(problem: LayoutProblem) -> bool:
    """Whether the start is a layout, and not the same share of everything."""
    free = problem.free
    share = (problem.start - problem.lower)[free] / (problem.upper - problem.lower)[free]
    return bool(np.ptp(share) > _EVEN)


def _by_share(open_: Choices, share: Array) -> NDArray[np.intp]:
    """States in the order of their group's share in the relaxed layout, the nearest size first."""
    inside = open_.table > 0
    of_group = np.where(inside, share, 0.0).sum(axis=1) / open_.sizes
    size = open_.table.sum(axis=1) / open_.sizes
    return np.lexsort((np.abs(size - of_group), open_.group, -of_group))


def _relaxed(open_: Choices, evaluations: int, runs: Runs) -> LayoutResult:
    """Densities between off and the largest size, shares of it summing up to the count; groups are tied."""
    problem = replace(open_.problem, evaluate=runs.noting())
    largest = open_.table.max(axis=0, initial=0.0)
    smallest = np.where(open_.table > 0, open_.table, np.inf).min(axis=0, initial=np.inf)
    inside = largest > 0
    width = problem.upper - problem.lower
    always = inside & ((open_.always[open_.group] @ open_.table) > 0)
    upper = np.where(inside & (largest < 1.0), problem.lower + largest * width, problem.upper)
    lower = np.where(always, problem.lower + np.where(inside, smallest, 0.0) * width, problem.lower)
    lower = np.minimum(lower, upper)
    full = np.where(inside, upper - problem.lower, 0.0)
    share = np.where(full > 0, 1.0 / np.where(full > 0, full, 1.0), 0.0)
    limited = replace(
        problem, costs=np.vstack([problem.costs, share]),
        limits=np.r_[problem.limits, float(open_.count) + float(share @ problem.lower)],
        names=(*problem.names, "members"), lower=lower, upper=upper,
        start=np.clip(problem.start, lower, upper),
    )  # fmt: skip
    if not limited.free.any():
        limited = problem
    spread = limited.lower + min(1.0, open_.count / max(1, int(limited.free.sum()))) * (
        limited.upper - limited.lower
    )
    start = replace(limited, start=limited.into_budgets(problem.start if _is_uneven(problem) else spread))
    groups = [np.flatnonzero(row > 0).tolist() for row in open_.table[:: open_.states // open_.groups]]
    if all(len(members) == 1 for members in groups):
        return optimise_layout(start, max_evaluations=evaluations, tolerance=1e-6, probes=0)
    both = tied(start, groups)
    found = optimise_layout(both.problem, max_evaluations=evaluations, tolerance=1e-6, probes=0)
    return replace(found, density=both.design(found.density))


def _members(open_: Choices, seen: Evaluated, place: int) -> tuple[int, ...]:
    return tuple(int(i) for i in np.flatnonzero(seen.on[place] @ open_.table > 0))


def _polished(
    seen: Evaluated, order: Sequence[int], minimum: float, evaluations: int
) -> tuple[Array, float, int, int]:
    """Densities from the minimum to the upper bound for the members of the best choices: the best of them."""
    open_, spent = seen.choices, 0
    problem: LayoutProblem = open_.problem
    place = order[0]
    density, value = open_.density(seen.on[place]), seen.values[place]
    for k in order:
        on = seen.on[k] @ open_.table > 0
        lower = np.where(on, minimum, problem.lower)
        upper = np.where(on, problem.upper, problem.lower)
        if not (upper > lower).any():
            continue
        one = replace(problem, lower=lower, upper=upper, start=open_.density(seen.on[k]))
        found = optimise_layout(one, max_evaluations=max(2, evaluations // len(order)), multi_start=False)
        spent += found.evaluations
        if found.value < value:
            density, value, place = found.density, found.value, k
    return density, value, place, spent
