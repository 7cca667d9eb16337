"""Layouts on windows of one to several periods: searches with runs without gradients beside the plain one.

A body joined to a carrier by springs between two squares, of which a tenth may be there, as in chapter VII.
Local optima lie far apart there, and which one a search ends in depends on where it begins. From several
starts, the even layout and random densities, both searches get the same evaluations; what a start reaches is
compared with the best that anything reached on its window.

Run `python -m studies.long_windows 260 0.5,1.0,1.6,2.0,2.5 10` for the table (an hour; 260 is the number of
springs, 10 that of the starts). Every line is printed when it is known.
"""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from studies.two_body import square_points
from workbench.engine import Body, Deviation, Load, Maximum, Spring, System, VelocityVerlet, dense_members
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout

__all__ = ["POINTS", "Reached", "problem", "run", "started", "summary"]

POINTS = {54: (6, 9), 260: (13, 20), 1020: (20, 51)}  # on the two squares, by the number of springs
PHASES = (0.5, 0.25)  # of the points along the squares: those of the study of two bodies
STIFFNESS = {54: 4250.0, 260: 900.0, 1020: 900.0}  # N/m
EVALUATIONS = 200
PROBES = 20  # runs without gradients per evaluation


@dataclass(frozen=True, slots=True, kw_only=True)
class Reached:
    """What a search from a start ended with.

    value: over that of the even layout    window: s    start: its number, 0 the even layout    probes: runs
    without gradients that it made    kkt: first-order error    cpu: s
    """

    window: float
    start: int
    probes: int
    value: float
    evaluations: int
    kkt: float
    status: str
    cpu: float


def problem(springs: int, window: float, *, phases: tuple[float, float] = PHASES) -> LayoutProblem:
    """The least largest squared displacement over a window (s) with a tenth of 54, 260 or 1,020 springs.

    >>> problem(54, 1.0).members
    54
    """
    if springs not in POINTS:
        raise ValueError(f"springs needs to be one of {', '.join(map(str, POINTS))}, got {springs}")
    inner, outer = (
        square_points(count, half, phase)
        for count, half, phase in zip(POINTS[springs], (0.3, 1.0), phases, strict=True)
    )
    system = System(
        bodies=(Body(name="1", mass=60.0, inertia=10.0), Body(name="2", mass=2000.0, inertia=6000.0)),
        members=dense_members("1", "2", inner, outer, law=Spring(k=STIFFNESS[springs])),
        loads=(Load(body="2", force=(19600.0, 0.0), torque=120000.0),),
    )
    return transient_problem(
        [Scenario(
            system=system, objective=Maximum(quantity=Deviation(bodies=("1",), reference="2"), refine=False),
            t_end=window, steps=round(400 * window), scheme=VelocityVerlet(),
        )],
        start=np.full(springs, 0.1), budgets=[(np.ones(springs), 0.1 * springs)], lower=1e-4,
        title=f"{springs} springs, {window:g} s", unit="m^2", response="largest squared displacement",
    )  # fmt: skip


def started(whole: LayoutProblem, start: int) -> LayoutProblem:
    """The problem from its even layout (0) or from random densities, few of them large where `start` is."""
    if start == 0:
        return whole
    rng = np.random.default_rng([start, whole.members])
    return replace(whole, start=whole.into_budgets(rng.random(whole.members) ** rng.integers(1, 6)))


def run(
    springs: int,
    windows: tuple[float, ...],
    starts: int,
    *,
    first: int = 0,
    plain: int | None = None,
    evaluations: int = EVALUATIONS,
    phases: tuple[float, float] = PHASES,
) -> Iterator[Reached]:
    """Both searches on each window from each start; plain: from so many starts the plain search, too."""
    wholes = [problem(springs, window, phases=phases) for window in windows]
    even = [float(np.max(whole.evaluate(whole.start).values)) for whole in wholes]
    for start in range(first, first + starts):
        for window, whole, unit in zip(windows, wholes, even, strict=True):
            for probes in (PROBES * evaluations, 0):
                if probes == 0 and plain is not None and start >= first + plain:
                    continue
                began = time.process_time()
                found = optimise_layout(started(whole, start), max_evaluations=evaluations, probes=probes)
                yield Reached(
                    window=window, start=start, probes=found.probes, value=found.value / unit,
                    evaluations=found.evaluations, kkt=found.kkt, status=found.status.name,
                    cpu=time.process_time() - began,
                )  # fmt: skip


def summary(rows: list[Reached]) -> list[str]:
    """A line for each window: the best known, how many starts came within 3 % of it, the worst of them."""
    lines = []
    for window in sorted({row.window for row in rows}):
        here = [row for row in rows if row.window == window]
        best = min(row.value for row in here)
        said = f"{window:g} s: best {best:.4f}"
        for name, chosen in (
            ("with runs without gradients", [row for row in here if row.probes]),
            ("plain", [row for row in here if not row.probes]),
        ):
            if chosen:
                near = sum(row.value <= 1.03 * best for row in chosen)
                worst = max(row.value for row in chosen) / best - 1
                said += f"; {name} {near} of {len(chosen)} within 3 %, the worst {100 * worst:.1f} % above"
        pairs = [
            row.value / other.value - 1
            for row in here if row.probes
            for other in here if not other.probes and other.start == row.start
        ]  # fmt: skip
        if pairs:
            said += f"; against the plain search from the same start at most {100 * max(pairs):+.1f} %"
        lines.append(said)
    return lines


def main() -> None:
    """Print a line for every search, and the counts."""
    springs = int(sys.argv[1]) if len(sys.argv) > 1 else 260
    given = sys.argv[2] if len(sys.argv) > 2 else "0.5,1.0,1.6,2.0,2.5"
    windows = tuple(float(t) for t in given.split(","))
    starts = int(sys.argv[3]) if len(sys.argv) > 3 else 10
    plain = int(sys.argv[4]) if len(sys.argv) > 4 else None
    rows = []
    for row in run(springs, windows, starts, plain=plain):
        rows.append(row)
        print(
            f"{springs:5d} {row.window:4.1f} s start {row.start:2d} {row.probes:5d} runs  {row.value:.4f}"
            f"  {row.evaluations:3d} evaluations {row.status:9s} {row.kkt:.1e} {row.cpu:6.1f} CPU s",
            flush=True,
        )
    print(*summary(rows), sep="\n")


if __name__ == "__main__":
    main()
