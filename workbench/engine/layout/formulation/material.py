"""The least material under limits, in place of the least response under a budget."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .problem import Evaluation, InvalidLayout, LayoutProblem, LimitRow

__all__ = ["least_material"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


def least_material(
    problem: LayoutProblem, costs: Any = 1.0, *, response: str = "material", unit: str = "1"
) -> LayoutProblem:
    """The least material under the limits and budgets of a problem: min sum V_i alpha_i.

    costs: of all members. The objective of the problem is left out; give it as a limit to keep it.
    Raises InvalidLayout for a problem without limits.
    """
    price = np.broadcast_to(np.asarray(costs, dtype=float), (problem.members,))
    inner = problem.evaluate

    def evaluate(density: Array) -> Evaluation:
        found = inner(density)
        if not found.constraints.size:
            raise InvalidLayout(
                "least_material needs a problem with limits; without them no member is needed"
            )
        return _Material(inner=found, values=np.array([[price @ density]]), costs=price)

    return replace(problem, evaluate=evaluate, times=None, response=response, unit=unit, convex=False)


@dataclass(slots=True, kw_only=True)
class _Material:
    """The material as objective beside the limits of a run."""

    inner: Evaluation
    values: Array
    costs: Array

    @property
    def constraints(self) -> Array:
        """(c,): the limits."""
        return self.inner.constraints

    @property
    def constraint_gradients(self) -> Array:
        """(c, N)."""
        return self.inner.constraint_gradients

    @property
    def limit_rows(self) -> tuple[LimitRow, ...]:
        """(c,): what they stand for."""
        return self.inner.limit_rows

    def gradients(self, rows: Rows) -> Array:
        """The costs."""
        return np.broadcast_to(self.costs, (len(rows), len(self.costs)))

    def factors(self, rows: Rows) -> None:
        """None: the material is linear, but the limits are not."""

    def model(self, step: Array) -> None:
        """None: the limits need a model of their own."""
