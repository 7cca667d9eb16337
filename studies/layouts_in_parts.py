"""Belts, bags and retractors of a rider: designed in parts as chapter VIII does, and at once.

A rider in a cab that brakes, then is thrown aside: 12 belts, 12 airbags and 8 retractors between random
points, a budget for each kind, two firing times. The objective is the largest displacement in the cab over
the whole of 1.2 s. In parts the belts see the braking alone (0 to 0.6 s), what fires the second half.

    by status          belts alone; then bags beside them; then retractors beside both       (8.29) to (8.31)
    by functionality   belts and bags, retractors off; then retractors alone                  (8.32) to (8.34)
    by time            belts to 0.6 s; then retractors alone to 0.9 s, bags alone to 1.2 s    (8.35) to (8.37)

Run `python -m studies.layouts_in_parts 5` for a table over five riders (about a minute).
"""

import sys
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from workbench.engine import Airbag, Belt, Body, Deviation, Maximum, Member, Motion, Retractor, System
from workbench.engine.layout.formulation.law_variables import LawVariable
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.parts import Part, optimise_in_parts

if TYPE_CHECKING:
    from workbench.engine.layout.formulation.problem import LayoutProblem

__all__ = ["decompositions", "problem", "run"]

BELTS, BAGS, RETRACTORS = 12, 12, 8
T_END, STEPS = 1.2, 300
WAYS = ("status", "functionality", "time")


def problem(seed: int = 0, *, window: tuple[float, float] | None = None) -> "LayoutProblem":
    """A rider of random members; the largest squared displacement in the cab over a window (all if None).

    >>> problem(1).densities, sorted(v.name for v in problem(1).variables)
    (32, ['bags', 'retractors'])
    """
    rng = np.random.default_rng(seed)
    brake, turn = rng.uniform(5.0, 8.0), rng.uniform(4.0, 7.0)

    def at(t: float) -> tuple[float, float, float]:
        late = max(0.0, t - 0.6)
        return -0.5 * brake * min(t, 0.6) ** 2 - 0.6 * brake * late, 0.5 * turn * late**2, 0.0

    cab = Body(name="cab", motion=Motion(position=at))
    rider = Body(name="rider", mass=75.0, inertia=4.0, gravity=False)
    kinds = (
        *(Belt(k1=4e3, k2=1e3, c=30.0, width=5e-3) for _ in range(BELTS)),
        *(Airbag(c0=90.0, width=5e-3, deploy=0.5, rise=0.04) for _ in range(BAGS)),
        *(Retractor(f0=400.0, sigma=300.0, t0=0.7) for _ in range(RETRACTORS)),
    )
    angle = rng.uniform(0, 2 * np.pi, len(kinds))
    far, near = rng.uniform(0.5, 0.9, len(kinds)), rng.uniform(-0.15, 0.15, (len(kinds), 2))
    members = tuple(
        Member(
            a="rider", b="cab", law=law, point_a=(float(p[0]), float(p[1])),
            point_b=(float(r * np.cos(w)), float(r * np.sin(w))),
        )
        for law, w, r, p in zip(kinds, angle, far, near, strict=True)
    )  # fmt: skip
    scenario = Scenario(
        system=System(bodies=(rider, cab), members=members), t_end=T_END, steps=STEPS, name="brake and turn",
        objective=Maximum(quantity=Deviation(bodies=("rider",), reference="cab"), window=window),
    )  # fmt: skip
    of = {name: np.isin(np.arange(len(kinds)), part).astype(float) for name, part in _kinds().items()}
    bags, retractors = _kinds()["bags"], _kinds()["retractors"]
    return transient_problem(
        [scenario], start=0.25, lower=1e-4, names=tuple(of),
        budgets=[(cost, 0.25 * cost.sum()) for cost in of.values()],
        variables=(
            LawVariable(name="bags", members=tuple(bags), lower=0.1, upper=0.9, start=0.5),
            LawVariable(name="retractors", members=tuple(retractors), lower=0.1, upper=1.1, start=0.7),
        ),
        title="rider", response="largest squared displacement", unit="m^2",
    )  # fmt: skip


def _kinds() -> dict[str, list[int]]:
    first, second = BELTS, BELTS + BAGS
    return {
        "belts": list(range(first)), "bags": list(range(first, second)),
        "retractors": list(range(second, second + RETRACTORS)),
    }  # fmt: skip


def decompositions(seed: int = 0) -> dict[str, list[Part]]:
    """The three ways of chapter VIII; a firing time belongs to what fires."""
    kinds = _kinds()
    belts, count = kinds["belts"], BELTS + BAGS + RETRACTORS
    bags, retractors = [*kinds["bags"], count], [*kinds["retractors"], count + 1]
    early, middle, late = (problem(seed, window=w) for w in ((0.0, 0.6), (0.6, 0.9), (0.9, T_END)))
    return {
        "status": [
            Part(name="belts", variables=belts, problem=early),
            Part(name="bags", variables=bags),
            Part(name="retractors", variables=retractors),
        ],
        "functionality": [
            Part(name="belts and bags", variables=[*belts, *bags], others="off"),
            Part(name="retractors", variables=retractors, others="off"),
        ],
        "time": [
            Part(name="belts", variables=belts, problem=early, others="off"),
            Part(name="retractors", variables=retractors, problem=middle, others="off"),
            Part(name="bags", variables=bags, problem=late, others="off"),
        ],
    }


def run(riders: int = 5, *, first: int = 0, evaluations: int = 30) -> xr.Dataset:
    """The value of each way over that of all at once: in parts, and from there at once.

    All at once has as many evaluations from its own start as the parts have together.
    """
    shape = (riders, len(WAYS))
    parts, polished, whole = np.empty(shape), np.empty(shape), np.empty(riders)
    for row, seed in enumerate(range(first, first + riders)):
        one = problem(seed)
        whole[row] = optimise_layout(one, max_evaluations=3 * evaluations).value
        for column, (way, some) in enumerate(decompositions(seed).items()):
            each = 3 * evaluations // len(some)
            found = optimise_in_parts(one, some, max_evaluations=each, at_once=3 * evaluations)
            assert found.at_once is not None
            parts[row, column], polished[row, column] = found.value, found.at_once.value
            print(
                f"rider {seed}, {way:13} {np.sqrt(found.value):.4f} m, from there at once "
                f"{np.sqrt(found.at_once.value):.4f} m, at once {np.sqrt(whole[row]):.4f} m, fires at "
                + ", ".join(f"{t:.3f} s" for t in found.at_once.variables.values()), flush=True,
            )  # fmt: skip
    where = {"rider": range(first, first + riders), "way": list(WAYS)}
    return xr.Dataset(
        {
            "in_parts": (("rider", "way"), np.sqrt(parts / whole[:, None])),
            "from_there": (("rider", "way"), np.sqrt(polished / whole[:, None])),
            "at_once": ("rider", np.sqrt(whole)),
        },
        coords=where,
    )


if __name__ == "__main__":
    table = run(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
    print(table.median("rider"))
