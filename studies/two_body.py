"""Two planar bodies tied by 1,020 members: chapters IV to VI of the dissertation, and the layouts of chapter
VII.

The dissertation gives no coordinates. Two geometries of our own stand here and are never mixed:
R (rectangles) for the comparison of sensitivities, S (squares) for the layouts. 1020 = 20 x 51.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.engine import (
    Body,
    Deviation,
    GeneralisedAlpha,
    Load,
    Maximum,
    Spring,
    StoredEnergy,
    System,
    VelocityVerlet,
    dense_members,
)

__all__ = ["LayoutProblem", "Problem", "layout_problem", "problem", "rectangle_points", "square_points"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A system, a design, an objective and how long and how finely to run it."""

    system: System
    density: Array
    objective: Maximum
    t_end: float
    steps: int
    scheme: GeneralisedAlpha | VelocityVerlet


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutProblem:
    """A problem with its resource: minimise the objective, lower <= alpha <= upper, sum of alpha <=
    budget."""

    system: System
    density: Array
    objective: Maximum
    t_end: float
    steps: int
    scheme: GeneralisedAlpha | VelocityVerlet
    lower: float
    upper: float
    budget: float


def rectangle_points(
    count: int, width: float, height: float, centre: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """(count, 2) points at equal arc length on a rectangle, the first at the corner (+x, -y),
    counter-clockwise.

    >>> rectangle_points(4, 2.0, 2.0)
    array([[ 1., -1.],
           [ 1.,  1.],
           [-1.,  1.],
           [-1., -1.]])
    """
    s = 2.0 * (width + height) * np.arange(count) / count
    corners = np.array([(1, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)]) * (0.5 * width, 0.5 * height)
    arc = np.cumsum([0.0, height, width, height, width])
    points = np.column_stack([np.interp(s, arc, corners[:, axis]) for axis in (0, 1)])
    return np.asarray(points + centre)


def square_points(count: int, half: float, phase: float) -> Array:
    """(count, 2) points on a square: u = 4 (i + phase)/count, side floor(u), w = 2 (u - side) - 1.

    >>> square_points(4, 1.0, 0.5).tolist()
    [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]
    """
    u = 4.0 * (np.arange(count) + phase) / count
    side = np.floor(u).astype(int)
    w = 2.0 * (u - side) - 1.0
    one = np.ones(count)
    x = np.choose(side, [w, one, -w, -one])
    y = np.choose(side, [-one, w, one, -w])
    return np.asarray(half * np.column_stack([x, y]) + 0.0)


STIFFNESS = {"A": 22.5, "B": 225.0, "C": 450.0}


def problem(case: str = "A") -> Problem:
    """Geometry R: the largest stored energy over [0, 0.2] s.

    case: "A" 22.5, "B" 225 or "C" 450 N/m at alpha = 1. The text's "initial linear stiffness 22.5 N/m" with
    alpha = 0.1 may be read as A or B; in both the energy rises to the end. C has a peak inside the window.

    >>> len(problem("C").density)
    1020
    """
    if case not in STIFFNESS:
        raise ValueError(f"case needs to be one of {', '.join(STIFFNESS)}, got '{case}'")
    bodies = (
        Body(name="1", mass=60.0, inertia=10.0, position=(0.30, 0.50, 0.0)),
        Body(name="2", mass=2000.0, inertia=6000.0, gravity=False),  # the ground carries it
    )
    members = dense_members(
        "1", "2",
        rectangle_points(20, 0.40, 0.80), rectangle_points(51, 1.80, 2.20, (0.30, 0.50)),
        law=Spring(k=STIFFNESS[case]),
    )  # fmt: skip
    system = System(
        bodies=bodies,
        members=members,
        loads=(Load(body="2", force=(2000.0 * 9.8, 0.0), torque=6000.0 * 20.0),),
    )
    return Problem(
        system=system, density=system.density(0.1), objective=Maximum(quantity=StoredEnergy()),
        t_end=0.2, steps=200, scheme=GeneralisedAlpha(rho=0.8),
    )  # fmt: skip


def layout_problem(case: str = "short", *, peak: str = "node") -> LayoutProblem:
    """Geometry S: the layouts of chapter VII, alpha in [1e-4, 1] with sum alpha <= 102, start 0.1 everywhere.

    case: "short" (0.2 s), "long" (1.0 s, several peaks within 2 %) or "energy" (stored energy at 225 N/m: the
    degenerate one, whose best layout removes the members).
    peak: "node" keeps the maximum to the grid of velocity Verlet, as the published figures do; "refined" does
    not.
    """
    cases = {"short": (0.2, 200, 900.0), "long": (1.0, 400, 900.0), "energy": (0.2, 200, 225.0)}
    if case not in cases:
        raise ValueError(f"case needs to be one of {', '.join(cases)}, got '{case}'")
    if peak not in ("node", "refined"):
        raise ValueError(f"peak needs to be 'node' or 'refined', got '{peak}'")
    t_end, steps, k = cases[case]
    bodies = (
        Body(name="1", mass=60.0, inertia=10.0),
        Body(name="2", mass=2000.0, inertia=6000.0),
    )
    members = dense_members(
        "1", "2", square_points(20, 0.3, 0.5), square_points(51, 1.0, 0.25), law=Spring(k=k)
    )
    system = System(
        bodies=bodies,
        members=members,
        loads=(Load(body="2", force=(2000.0 * 9.8, 0.0), torque=6000.0 * 20.0),),
    )
    quantity = StoredEnergy() if case == "energy" else Deviation(bodies=("1",), reference="2")
    return LayoutProblem(
        system=system, density=system.density(0.1),
        objective=Maximum(quantity=quantity, refine=peak == "refined"),
        t_end=t_end, steps=steps, scheme=VelocityVerlet(), lower=1e-4, upper=1.0, budget=102.0,
    )  # fmt: skip
