"""Smooth stand-ins for the largest row: Kreisselmeier-Steinhauser and the p-norm.

    KS = g* + (u/rho) log sum exp(rho (g_j - g*)/u)  >= max g,        P = (sum |g_j|^p)^(1/p)  >= max |g|

u is the value at the start, so that rho has no unit. Measured on long windows they do not replace rows for
the active peaks; they are here to compare with, and for methods that take one smooth objective.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .problem import Evaluation, InvalidLayout, LayoutProblem, LimitRow

__all__ = ["aggregated"]

Array = NDArray[np.float64]

_LIGHT = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
class _OneRow:
    inner: Evaluation
    values: Array
    rows: NDArray[np.intp]
    weights: Array
    constraints: Array
    constraint_gradients: Array
    limit_rows: tuple[LimitRow, ...]

    def gradients(self, rows: NDArray[np.intp]) -> Array:
        return np.repeat((self.weights @ self.inner.gradients(self.rows))[None], len(rows), axis=0)

    def factors(self, rows: NDArray[np.intp]) -> Array | None:
        return None

    def model(self, step: Array) -> Array | None:
        return None


def aggregated(
    problem: LayoutProblem, kind: Literal["ks", "p_norm"] = "ks", *, sharpness: float = 60.0
) -> LayoutProblem:
    """The same problem with one smooth objective. sharpness: rho of KS, p of the p-norm.

    >>> import numpy as np
    >>> from workbench.engine.layout.formulation.problem import static_problem
    >>> two = static_problem(lambda x: (np.array([x[0], 1 - x[0]]), np.array([[1.0], [-1.0]])), start=[0.5])
    >>> bool(aggregated(two).evaluate(np.array([0.5])).values[0, 0] > 0.5)
    True
    """
    if kind not in ("ks", "p_norm"):
        raise InvalidLayout(f"kind needs to be 'ks' or 'p_norm', got '{kind}'")
    if sharpness < 1:
        raise InvalidLayout(f"sharpness needs to be >= 1, got {sharpness}")
    unit: list[float] = []

    def evaluate(density: Array) -> Evaluation:
        inner = problem.evaluate(density)
        g = np.atleast_2d(inner.values).ravel()
        top = float(g.max())
        if not unit:
            unit.append(max(abs(top), 1e-300))
        if kind == "ks":
            e = np.exp(sharpness * (g - top) / unit[0])
            value, weights = top + unit[0] / sharpness * float(np.log(e.sum())), e / e.sum()
        else:
            size = max(float(np.abs(g).max()), 1e-300)
            value = size * float(((np.abs(g) / size) ** sharpness).sum() ** (1 / sharpness))
            weights = np.sign(g) * (np.abs(g) / value) ** (sharpness - 1)
        rows = np.flatnonzero(np.abs(weights) > _LIGHT)
        return _OneRow(
            inner=inner, values=np.array([[value]]), rows=rows, weights=weights[rows],
            constraints=inner.constraints, constraint_gradients=inner.constraint_gradients,
            limit_rows=inner.limit_rows,
        )  # fmt: skip

    function: Callable[[Array], Evaluation] = evaluate
    return replace(problem, evaluate=function, convex=False, times=None)
