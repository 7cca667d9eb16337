"""Layouts of drawn ground structures on drawn windows: what no rule of a search was chosen on.

A body of drawn mass joined to a carrier by 54 to 336 springs between points on two squares, or scattered
over them, of which 5 to 25 % may be there. Force, moment, stiffness and window (0.5 to 2.5 s) are drawn.
What a search of 200 evaluations reaches from several starts is told over the value of the even layout.

Run `python -m studies.drawn_windows 101 8 2` for eight problems from seed 101 on, two starts each (minutes);
a fourth argument `plain` adds the search without runs without gradients.
"""

import sys
import time
from collections.abc import Iterator

import numpy as np

from studies.long_windows import EVALUATIONS, Reached, started
from studies.two_body import square_points
from workbench.engine import Body, Deviation, Load, Maximum, Spring, System, VelocityVerlet, dense_members
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout

__all__ = ["drawn_problem", "run"]

RATE = 250  # steps per second


def drawn_problem(seed: int) -> tuple[LayoutProblem, float]:
    """The problem of a seed, and its window (s).

    >>> problem, window = drawn_problem(3)
    >>> problem.members, round(window, 2)
    (104, 1.17)
    """
    rng = np.random.default_rng([seed, 23])
    a, b = int(rng.integers(6, 15)), int(rng.integers(9, 25))
    n, near, far = a * b, rng.uniform(0.2, 0.5), rng.uniform(0.7, 1.4)
    if rng.random() < 0.5:
        inner, outer = square_points(a, near, rng.random()), square_points(b, far, rng.random())
    else:
        inner, outer = rng.uniform(-near, near, (a, 2)), rng.uniform(-far, far, (b, 2))
    share = rng.uniform(0.05, 0.25)
    stiffness = 23400.0 * rng.uniform(0.5, 2) / (share * n)
    window = rng.uniform(0.5, 2.5)
    angle, spin = rng.uniform(0, 2 * np.pi), rng.uniform(8, 25) * rng.choice([-1, 1])
    force = 19600 * rng.uniform(0.5, 1.2)
    system = System(
        bodies=(
            Body(name="1", mass=rng.uniform(45, 90), inertia=rng.uniform(6, 15)),
            Body(name="2", mass=2000.0, inertia=6000.0),
        ),
        members=dense_members("1", "2", inner, outer, law=Spring(k=stiffness)),
        loads=(Load(body="2", force=(force * np.cos(angle), force * np.sin(angle)), torque=6000 * spin),),
    )
    return transient_problem(
        [Scenario(
            system=system, objective=Maximum(quantity=Deviation(bodies=("1",), reference="2"), refine=False),
            t_end=window, steps=round(RATE * window), scheme=VelocityVerlet(),
        )],
        start=np.full(n, share), budgets=[(np.ones(n), share * n)], lower=1e-4,
        title=f"{n} springs, {window:.2f} s", unit="m^2", response="largest squared displacement",
    ), window  # fmt: skip


def run(
    first: int, problems: int, starts: int, *, plain: bool = False, evaluations: int = EVALUATIONS
) -> Iterator[tuple[int, Reached]]:
    """What each start of each problem reached, and the seed; plain: without runs without gradients, too."""
    for seed in range(first, first + problems):
        problem, window = drawn_problem(seed)
        even = float(np.max(problem.evaluate(problem.start).values))
        for start in range(starts):
            for probes in (None, 0) if plain else (None,):
                began = time.process_time()
                found = optimise_layout(started(problem, start), max_evaluations=evaluations, probes=probes)
                yield (
                    seed,
                    Reached(
                        window=window, start=start, probes=found.probes, value=found.value / even,
                        evaluations=found.evaluations, kkt=found.kkt, status=found.status.name,
                        cpu=time.process_time() - began,
                    ),
                )  # fmt: skip


def main() -> None:
    """Print a line for every search."""
    given = [int(word) for word in sys.argv[1:4]]
    first, problems, starts = given if len(given) == 3 else (101, 8, 2)
    for seed, row in run(first, problems, starts, plain="plain" in sys.argv):
        print(
            f"seed {seed} {row.window:5.2f} s start {row.start:2d} {row.probes:5d} runs  {row.value:.4f}"
            f"  {row.evaluations:3d} evaluations {row.status:9s} {row.kkt:.1e} {row.cpu:6.1f} CPU s",
            flush=True,
        )


if __name__ == "__main__":
    main()
