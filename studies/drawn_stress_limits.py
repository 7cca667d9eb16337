"""Least volumes of drawn trusses under stress limits, beside the linear programme of plastic design.

    python -m studies.drawn_stress_limits first_seed number fewest_bars most_bars [--cases N]
        [--grid COLUMNS ROWS]

Rectangular ground structures of 3 to 10 by 2 to 6 points, or of the grid that is asked for, held on the
left, each with a load in a drawn direction at a drawn point of the right edge, or with several such load
cases. The search begins at the even design and has 100 evaluations. Under one load case the programme is the
optimum; under several it is a lower bound, which an elastic truss need not reach.
"""

import time
from argparse import ArgumentParser
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from studies.trusses import Truss, ground_structure, least_volume, stress_limited
from workbench.engine.layout.optimise import optimise_layout

__all__ = ["EVALUATIONS", "Held", "drawn", "run"]

EVALUATIONS = 100
NEAR = 1.01  # of the programme
DRAWS = 1000  # seeds without a truss of the size that is asked for


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """A search: its value over that of the programme, and after how many evaluations it was within 1 %.

    refused: trial steps that were not taken    cpu: s
    """

    seed: int
    bars: int
    cases: int
    ratio: float
    near_after: int | None
    refused: int
    status: str
    cpu: float


def drawn(seed: int, *, cases: int = 1, grid: tuple[int, int] | None = None) -> Truss:
    """A truss of a seed, with so many columns and rows of points; both are drawn where they are not given.

    >>> len(drawn(1).ends)
    409
    >>> len(drawn(1, grid=(16, 3)).ends)
    685
    """
    rng = np.random.default_rng([seed, 39])
    columns, rows = grid or (int(rng.integers(3, 11)), int(rng.integers(2, 7)))
    width, height = rng.uniform(1.0, 5.0, 2)
    loads = []
    for _ in range(cases):
        angle, place = rng.uniform(0.0, 2.0 * np.pi), int(rng.integers(0, rows))
        force = (float(np.cos(angle)), float(np.sin(angle)))
        loads.append(((force, (float(width), place * float(height) / (rows - 1))),))
    return ground_structure(columns=columns, rows=rows, width=width, height=height, loads=loads)


def run(
    first: int, number: int, *, fewest: int, most: int, cases: int = 1, grid: tuple[int, int] | None = None
) -> Iterator[Held]:
    """So many searches on trusses of `fewest` to `most` bars, from a seed on.

    Raises ValueError where a thousand seeds in a row draw none of that size.
    """
    seed = last = first
    while number:
        if seed - last > DRAWS:
            raise ValueError(f"no truss of {fewest} to {most} bars in {DRAWS} draws: ask for other sizes")
        truss = drawn(seed, cases=cases, grid=grid)
        if fewest <= len(truss.ends) <= most:
            optimum, begun = least_volume(truss), time.process_time()
            found = optimise_layout(stress_limited(truss), max_evaluations=EVALUATIONS)
            near = (k + 1 for k, made in enumerate(found.history) if made.best <= NEAR * optimum)
            yield Held(
                seed=seed, bars=len(truss.ends), cases=cases, ratio=found.value / optimum,
                near_after=next(near, None), refused=sum(not made.accepted for made in found.history),
                status=found.status.name, cpu=time.process_time() - begun,
            )  # fmt: skip
            number, last = number - 1, seed
        seed += 1


def main() -> None:
    """A line for each search, as it ends."""
    parser = ArgumentParser(description="Least volumes of drawn trusses beside the linear programme.")
    parser.add_argument("first", type=int, help="seed of the first draw")
    parser.add_argument("number", type=int, help="of searches")
    parser.add_argument("fewest", type=int, help="bars")
    parser.add_argument("most", type=int, help="bars; at most 1,132 are drawn")
    parser.add_argument("--cases", type=int, default=1, help="load cases (default 1)")
    parser.add_argument("--grid", type=int, nargs=2, help="columns and rows of points (default drawn)")
    asked = parser.parse_args()
    grid = (asked.grid[0], asked.grid[1]) if asked.grid else None
    held = 0
    try:
        for one in run(
            asked.first, asked.number, fewest=asked.fewest, most=asked.most, cases=asked.cases, grid=grid
        ):
            held += one.ratio <= NEAR
            after = "never within 1 %" if one.near_after is None else f"1 % after {one.near_after}"
            print(
                f"{one.seed:5} {one.bars:5} bars  {one.ratio:.4f}  {one.status}  {after}  "
                f"refused {one.refused}  {one.cpu:.1f} CPU s",
                flush=True,
            )
    except ValueError as error:
        parser.error(str(error))
    print(f"{held} of {asked.number} within 1 % of the programme")


if __name__ == "__main__":
    main()
