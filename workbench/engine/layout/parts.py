"""Layouts in parts, one after another: by active status, by functionality, by time; and at once beside them.

Chapter VIII finds belts, airbags and retractors one after another, each with a manoeuvre, a window and an
objective of its own, (8.29) to (8.37). A part opens some design variables; the others are off, or stay as the
parts before have left them. What the parts make together is then evaluated in the whole problem.

| decomposition | parts | others |
|---|---|---|
| by active status, 8.6.1 | belts in normal driving, then bags, then retractors in a rollover | kept |
| by functionality, 8.6.2 | belts and bags, which hold; retractors, which move | off |
| by time, 8.6.3 | belts to 1 s, retractors to 2 s, bags to 2.5 s, each `Maximum(window=...)` | off |
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .formulation.problem import FAILURES, InvalidLayout, LayoutProblem
from .optimise import optimise_layout
from .outcome.result import LayoutResult

__all__ = ["InParts", "Part", "optimise_in_parts"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """What is designed at a time.

    variables: numbers of the design variables that are open: members, and law variables behind them
    problem: with a load case, window or objective of its own and the same design variables; None: the whole
    others: "kept" as the parts before have left them (those not designed yet are off), or all "off"
    """

    name: str
    variables: Sequence[int]
    problem: LayoutProblem | None = None
    others: Literal["kept", "off"] = "kept"


@dataclass(frozen=True, slots=True, kw_only=True)
class InParts:
    """What the parts make together, and what came of designing everything at once from there.

    density (variables,)    value: of it in the whole problem, inf where the model fails    excess: of its
    budgets and limits    parts: the result of each    at_once: of the whole problem from the better of its
    own start and the parts' design, None if not asked for    evaluations: of all
    """

    density: Array
    value: float
    excess: float
    parts: tuple[LayoutResult, ...]
    at_once: LayoutResult | None
    evaluations: int

    @property
    def price_of_parts(self) -> float:
        """What designing in parts costs beside designing at once, relative to the latter."""
        if self.at_once is None:
            return float("nan")
        return (self.value - self.at_once.value) / abs(self.at_once.value)


def optimise_in_parts(
    problem: LayoutProblem, parts: Sequence[Part], *, max_evaluations: int = 50, rounds: int = 1,
    at_once: int = 0, tolerance: float = 1e-6,
) -> InParts:  # fmt: skip
    """Design some variables at a time.

    Args:
        problem: the whole; what the parts make is evaluated in it.
        max_evaluations: of each part in each round.
        rounds: how often all parts are walked through; from the second round on nothing is off that was
            designed, unless a part asks for it.
        at_once: evaluations for the whole problem at once afterwards; 0: none.

    Budgets and limits of a part's own problem hold for the members in it, those that are kept included.
    Raises InvalidLayout for parts that overlap, are empty or have another number of design variables.

    >>> from .formulation.problem import static_problem
    >>> w = np.array([1.0, 4.0, 9.0])
    >>> whole = static_problem(lambda a: (float((w / (0.1 + a)).sum()), -w / (0.1 + a) ** 2),
    ...                        start=np.full(3, 0.3), budgets=[(np.ones(3), 1.0)])
    >>> parts = [Part(name="first", variables=[0, 1]), Part(name="last", variables=[2])]
    >>> found = optimise_in_parts(whole, parts, at_once=20)
    >>> bool(found.value > found.at_once.value)
    True
    """
    _check(problem, parts)
    off = problem.lower.copy()
    off[problem.densities :] = problem.start[problem.densities :]  # a firing time is never off
    kept, results = off.copy(), []
    for _ in range(rounds):
        for part in parts:
            whole = problem if part.problem is None else part.problem
            open_ = np.asarray(part.variables, dtype=int)
            rest = kept if part.others == "kept" else off
            lower, upper, start = rest.copy(), rest.copy(), rest.copy()
            lower[open_], upper[open_] = whole.lower[open_], whole.upper[open_]
            seen = np.any(np.abs(kept[open_] - off[open_]) > 0.0)
            start[open_] = kept[open_] if seen else whole.start[open_]
            one = replace(whole, lower=lower, upper=upper, start=np.clip(start, lower, upper))
            found = optimise_layout(one, max_evaluations=max_evaluations, tolerance=tolerance, probes=0)
            kept[open_] = found.density[open_]
            results.append(found)
    value, excess = _value(problem, kept)
    spent = sum(found.evaluations for found in results) + 1
    together = None
    if at_once > 0:
        together = _at_once(problem, kept, value, excess, at_once, tolerance)
        spent += together.evaluations
    return InParts(
        density=kept, value=value, excess=excess, parts=tuple(results), at_once=together, evaluations=spent
    )


def _check(problem: LayoutProblem, parts: Sequence[Part]) -> None:
    taken: dict[int, str] = {}
    for part in parts:
        if not len(part.variables):
            raise InvalidLayout(f"part '{part.name}' opens no design variable")
        for i in part.variables:
            if not 0 <= int(i) < problem.members or int(i) in taken:
                raise InvalidLayout(
                    f"part '{part.name}' needs design variables from 0 to {problem.members - 1} that no "
                    f"other part opens, got {i}" + (f", open in '{taken[int(i)]}'" if int(i) in taken else "")
                )
            taken[int(i)] = part.name
        if part.problem is not None and part.problem.members != problem.members:
            raise InvalidLayout(
                f"part '{part.name}' has {part.problem.members} design variables, the whole {problem.members}"
            )


def _value(problem: LayoutProblem, design: Array) -> tuple[float, float]:
    try:
        evaluation = problem.checked(design)
    except FAILURES:
        return np.inf, np.inf
    broken = float(np.max(evaluation.constraints, initial=0.0))
    return float(np.max(evaluation.values)), max(problem.excess(design), broken)


def _at_once(
    problem: LayoutProblem, design: Array, value: float, excess: float, evaluations: int, tolerance: float
) -> LayoutResult:
    own, broken = _value(problem, problem.into_budgets(problem.start))
    starts = sorted([(excess > 1e-9, value, 0), (broken > 1e-9, own, 1)])
    start = design if starts[0][2] == 0 else problem.start
    return optimise_layout(
        replace(problem, start=start), max_evaluations=evaluations, tolerance=tolerance, probes=0
    )
