"""The equivalent static load method beside ours, with as many simulations each.

Run `python -m studies.equivalent_loads` (some minutes) for the table of `docs/gallery/equivalent_loads.md`:
the layouts of chapter VII with 1,020 and 1,044 members, and random systems of 12 to 24 springs whose load is
a push, so that everything that happens is inertia.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from studies import three_body_layout, two_body_layout
from studies.whole_members import random_problem
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.optimise import optimise_layout

__all__ = ["METHODS", "problems", "run"]

METHODS = ("gsao", "esl", "esl_difference", "oc")


def problems(*, springs: int = 4, large: bool = True) -> Iterator[tuple[str, LayoutProblem]]:
    """Names and problems: those of chapter VII, then random springs with a budget of two fifths."""
    if large:
        yield "two bodies, 0.2 s", two_body_layout.problem("short")
        yield "two bodies, 1 s", two_body_layout.problem("long")
        yield "three bodies, a joint", three_body_layout.problem()
    for seed in range(springs):
        one, _ = random_problem(30 + seed)
        n = one.members
        limited = replace(
            one, costs=np.ones((1, n)), limits=np.array([0.4 * n]), names=("material",),
            start=np.full(n, 0.4), lower=np.full(n, 1e-3),
        )  # fmt: skip
        yield f"{n} springs, seed {30 + seed}", limited


def run(evaluations: int = 30, *, springs: int = 4, large: bool = True) -> xr.Dataset:
    """The best value of each method over that of the start, after as many simulations."""
    names, table = [], []
    for name, problem in problems(springs=springs, large=large):
        row = [optimise_layout(problem, method, max_evaluations=evaluations) for method in METHODS]
        names.append(name)
        table.append([found.value / found.start_value for found in row])
        print(f"{name:24}", "  ".join(f"{x:.4f}" for x in table[-1]), flush=True)
    return xr.Dataset(
        {"value": (("problem", "method"), np.array(table))},
        coords={"problem": names, "method": list(METHODS)},
    )


if __name__ == "__main__":
    print(f"{'':24}", "  ".join(METHODS))
    run(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
