"""Penalisation in steps: the SIMP power (7.2) raised from solution to solution.

At power 1 a layout of rigid bodies is as good as it can be and may be purified; a power above 1 makes
fractional members uneconomic, but adds local optima. Raising it gradually, each layout started from the one
before (Rozvany 2009), follows a good one. Values at different powers are values of different problems: the
trail holds each with its grayness, and the last result is the answer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from .formulation.problem import InvalidLayout, LayoutProblem
from .optimise import optimise_layout
from .outcome.result import LayoutResult

__all__ = ["Continuation", "raise_power"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Continuation:
    """powers and the results at each; the layout is the last one."""

    powers: tuple[float, ...]
    results: tuple[LayoutResult, ...]

    @property
    def last(self) -> LayoutResult:
        """The layout at the last power."""
        return self.results[-1]

    @property
    def evaluations(self) -> int:
        """Of all steps together."""
        return sum(result.evaluations for result in self.results)


def raise_power(
    build: Callable[[float], LayoutProblem],
    *,
    powers: Sequence[float] = (1.0, 1.5, 2.0, 3.0),
    max_evaluations: int = 50,
    tolerance: float = 1e-6,
) -> Continuation:
    """Optimise `build(power)` for each power, started from the layout before.

    build: power -> the same problem with that power, for example
        `lambda p: transient_problem(scenarios, ..., power=p)`.
    max_evaluations: of all steps together; every step gets an equal share.
    Raises InvalidLayout for powers that do not rise or too few evaluations.

    >>> import numpy as np
    >>> from workbench.engine.layout.formulation.problem import static_problem
    >>> w = np.array([1.0, 4.0, 9.0])
    >>> def build(p):
    ...     return static_problem(lambda a: (float((w / (0.1 + a**p)).sum()),
    ...                                      -w * p * a ** (p - 1) / (0.1 + a**p) ** 2),
    ...                           start=np.full(3, 0.3), lower=0.01, budgets=[(np.ones(3), 1.0)])
    >>> raise_power(build, powers=(1.0, 3.0)).last.density.round(2)
    array([0.01, 0.01, 0.98])
    """
    steps = tuple(float(p) for p in powers)
    if not steps or steps[0] <= 0 or any(b <= a for a, b in pairwise(steps)):
        raise InvalidLayout(f"powers need to be positive and to rise, got {steps}")
    share = max_evaluations // len(steps)
    if share < 3:
        raise InvalidLayout(
            f"max_evaluations needs at least 3 per power, {3 * len(steps)} here, got {max_evaluations}"
        )
    results: list[LayoutResult] = []
    for power in steps:
        problem = build(power)
        if results:
            problem = replace(problem, start=results[-1].density)
        results.append(
            optimise_layout(problem, max_evaluations=share, tolerance=tolerance, multi_start=not results)
        )
    return Continuation(powers=steps, results=tuple(results))
