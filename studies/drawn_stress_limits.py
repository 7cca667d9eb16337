"""Least volumes of drawn trusses under stress limits, beside the linear programme of plastic design.

    python -m studies.drawn_stress_limits first_seed number fewest_bars most_bars [cases]

Rectangular ground structures of 3 to 10 by 2 to 6 points, held on the left, each with a load in a drawn
direction at a drawn point of the right edge, or with several such load cases. The search begins at the even
design and has 100 evaluations. Under one load case the programme is the optimum; under several it is a lower
bound, which an elastic truss need not reach.
"""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from studies.trusses import Truss, ground_structure, least_volume, stress_limited
from workbench.engine.layout.optimise import optimise_layout

__all__ = ["EVALUATIONS", "Held", "drawn", "run"]

EVALUATIONS = 100
NEAR = 1.01  # of the programme


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


def drawn(seed: int, *, cases: int = 1) -> Truss:
    """A truss of a seed.

    >>> len(drawn(1).ends)
    409
    """
    rng = np.random.default_rng([seed, 39])
    columns, rows = int(rng.integers(3, 11)), int(rng.integers(2, 7))
    width, height = rng.uniform(1.0, 5.0, 2)
    loads = []
    for _ in range(cases):
        angle, place = rng.uniform(0.0, 2.0 * np.pi), int(rng.integers(0, rows))
        force = (float(np.cos(angle)), float(np.sin(angle)))
        loads.append(((force, (float(width), place * float(height) / (rows - 1))),))
    return ground_structure(columns=columns, rows=rows, width=width, height=height, loads=loads)


def run(first: int, number: int, *, fewest: int, most: int, cases: int = 1) -> Iterator[Held]:
    """So many searches on trusses of `fewest` to `most` bars, from a seed on."""
    seed = first
    while number:
        truss = drawn(seed, cases=cases)
        if fewest <= len(truss.ends) <= most:
            optimum, begun = least_volume(truss), time.process_time()
            found = optimise_layout(stress_limited(truss), max_evaluations=EVALUATIONS)
            near = (k + 1 for k, made in enumerate(found.history) if made.best <= NEAR * optimum)
            yield Held(
                seed=seed, bars=len(truss.ends), cases=cases, ratio=found.value / optimum,
                near_after=next(near, None), refused=sum(not made.accepted for made in found.history),
                status=found.status.name, cpu=time.process_time() - begun,
            )  # fmt: skip
            number -= 1
        seed += 1


def main() -> None:
    """A line for each search, as it ends."""
    first, number, fewest, most = map(int, sys.argv[1:5])
    cases = int(sys.argv[5]) if len(sys.argv) > 5 else 1
    held = 0
    for search in run(first, number, fewest=fewest, most=most, cases=cases):
        held += search.ratio <= NEAR
        print(
            f"{search.seed:6} {search.bars:5} bars {search.cases} cases {search.ratio:.4f} of the programme "
            f"{search.status} 1 % after {search.near_after} refused {search.refused} {search.cpu:.1f} CPU s",
            flush=True,
        )
    print(f"{held} of {number} within 1 % of the programme")


if __name__ == "__main__":
    main()
