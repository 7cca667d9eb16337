"""Minimax problems with known answers: the design whose worst case is least bad.

Problems f1, f2, f3 and f5 of Rustem and Howe 2002 (as collected by Marzat, Walter and Piet-Lahanier 2013)
and a saddle on a line. Each is min over x of max over u; values by nested multistart, four digits.

`run(seed)` solves all of them; `python -m studies.minimax_gallery` prints bounds, evaluations and errors.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from workbench import Parameter, Space
from workbench.robust.minimax import minimax

__all__ = ["PROBLEMS", "MinimaxProblem", "run"]

Point = Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class MinimaxProblem:
    """A function of a design and an uncertainty, their boxes and the known value."""

    name: str
    function: Callable[[Point, Point], float]
    design: Space
    uncertainty: Space
    value: float


def _box(prefix: str, count: int, lower: float, upper: float) -> Space:
    return Space([Parameter(f"{prefix}{i + 1}", lower=lower, upper=upper) for i in range(count)])


def _f1(x: Point, u: Point) -> float:
    x1, x2, u1, u2 = x["x1"], x["x2"], u["u1"], u["u2"]
    return 5 * (x1**2 + x2**2) - (u1**2 + u2**2) + x1 * (-u1 + u2 + 5) + x2 * (u1 - u2 + 3)


def _f2(x: Point, u: Point) -> float:
    x1, x2, u1, u2 = x["x1"], x["x2"], u["u1"], u["u2"]
    return 4 * (x1 - 2) ** 2 - 2 * u1**2 + x1**2 * u1 - u2**2 + 2 * x2**2 * u2


def _f3(x: Point, u: Point) -> float:
    x1, x2, u1, u2 = x["x1"], x["x2"], u["u1"], u["u2"]
    return x1**4 * u2 + 2 * x1**3 * u1 - x2**2 * u2 * (u2 - 3) - 2 * x2 * (u1 - 3) ** 2


def _f5(x: Point, u: Point) -> float:
    x1, x2, x3, u1, u2, u3 = x["x1"], x["x2"], x["x3"], u["u1"], u["u2"], u["u3"]
    linear = -(x1 - 1) * u1 - (x2 - 2) * u2 - (x3 - 1) * u3
    return linear + 2 * x1**2 + 3 * x2**2 + x3**2 - u1**2 - u2**2 - u3**2


def _saddle(x: Point, u: Point) -> float:
    return (x["x1"] - 5) ** 2 - (u["u1"] - 5) ** 2


PROBLEMS = (
    MinimaxProblem(
        name="f1", function=_f1, design=_box("x", 2, -5, 5), uncertainty=_box("u", 2, -5, 5), value=-1.6833
    ),
    MinimaxProblem(
        name="f2", function=_f2, design=_box("x", 2, -5, 5), uncertainty=_box("u", 2, -5, 5), value=1.4039
    ),
    MinimaxProblem(
        name="f3", function=_f3, design=_box("x", 2, -5, 5), uncertainty=_box("u", 2, -3, 3), value=-2.4688
    ),
    MinimaxProblem(
        name="f5", function=_f5, design=_box("x", 3, -5, 5), uncertainty=_box("u", 3, -1, 1), value=1.3453
    ),
    MinimaxProblem(
        name="saddle",
        function=_saddle,
        design=_box("x", 1, 0, 10),
        uncertainty=_box("u", 1, 0, 10),
        value=0.0,
    ),
)


def run(seed: int = 0, *, budget: int = 300, problems: tuple[MinimaxProblem, ...] = PROBLEMS) -> xr.Dataset:
    """Solve every problem once: value found, bounds, evaluations."""
    found = [minimax(p.function, p.design, p.uncertainty, budget=budget, seed=seed) for p in problems]
    columns = {
        "known": [p.value for p in problems],
        "found": [f.value for f in found],
        "lower_bound": [f.lower for f in found],
        "evaluations": [f.evaluations for f in found],
    }
    return xr.Dataset(
        {name: ("problem", np.array(column)) for name, column in columns.items()},
        coords={"problem": [p.name for p in problems]},
        attrs={"seed": seed, "budget": budget},
    )


if __name__ == "__main__":
    print(run().to_dataframe().to_string(float_format="%.5g"))
