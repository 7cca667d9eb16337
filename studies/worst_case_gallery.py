"""Worst-case problems with known answers: engineering functions whose worst case sits in a corner, and test
functions of global optimisation whose extreme sits inside.

Each problem carries its space with units, the sense of the search and the extreme value known from analysis
or from the literature. `run(seed)` searches all of them, `spread(seeds)` does so several times;
`python -m studies.worst_case_gallery 0 10` prints the runs to 1 % of ten seeds with their median.

References: borehole and piston as in the collection of Surjanovic and Bingham; Welch et al. 1992 (eq. 3.14
    of the dissertation); Dixon and Szego 1978 for the minimised functions.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from studies.asked_range import asked_range
from studies.welch20 import welch20
from workbench import Parameter, Space
from workbench.search.worst_case import worst_case

__all__ = ["BUDGET", "PROBLEMS", "Problem", "evaluations_to", "run", "spread"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A function, its box, the sense in which it is bad, and the known extreme."""

    name: str
    function: Callable[..., float]
    space: Space
    sense: str
    value: float


def borehole(
    *, rw: float, r: float, Tu: float, Hu: float, Tl: float, Hl: float, L: float, Kw: float
) -> float:
    """Water flow through a borehole, m3/yr; lengths in m, transmissivities in m2/yr, Kw in m/yr."""
    log = np.log(r / rw)
    return 2 * np.pi * Tu * (Hu - Hl) / (log * (1 + 2 * L * Tu / (log * rw**2 * Kw) + Tu / Tl))


def piston(*, M: float, S: float, V0: float, k: float, P0: float, Ta: float, T0: float) -> float:
    """Cycle time of a piston in its cylinder, s; M kg, S m2, V0 m3, k N/m, P0 N/m2, temperatures K."""
    A = P0 * S + 19.62 * M - k * V0 / S
    V = S / (2 * k) * (np.sqrt(A**2 + 4 * k * P0 * V0 * Ta / T0) - A)
    return 2 * np.pi * np.sqrt(M / (k + S**2 * P0 * V0 * Ta / (T0 * V**2)))


def branin(*, x1: float, x2: float) -> float:
    """Three equal minima inside its box."""
    return (
        (x2 - 5.1 * x1**2 / (4 * np.pi**2) + 5 * x1 / np.pi - 6) ** 2
        + 10 * (1 - 1 / (8 * np.pi)) * np.cos(x1)
        + 10
    )


def goldstein_price(*, x1: float, x2: float) -> float:
    """Values over five decades: a test of the output warp."""
    a = 1 + (x1 + x2 + 1) ** 2 * (19 - 14 * x1 + 3 * x1**2 - 14 * x2 + 6 * x1 * x2 + 3 * x2**2)
    b = 30 + (2 * x1 - 3 * x2) ** 2 * (18 - 32 * x1 + 12 * x1**2 + 48 * x2 - 36 * x1 * x2 + 27 * x2**2)
    return a * b


_WEIGHTS = np.array([1.0, 1.2, 3.0, 3.2])
_A3 = np.array([[3, 10, 30], [0.1, 10, 35], [3, 10, 30], [0.1, 10, 35]])
_P3 = 1e-4 * np.array([[3689, 1170, 2673], [4699, 4387, 7470], [1091, 8732, 5547], [381, 5743, 8828]])
_A6 = np.array(
    [
        [10, 3, 17, 3.5, 1.7, 8],
        [0.05, 10, 17, 0.1, 8, 14],
        [3, 3.5, 1.7, 10, 17, 8],
        [17, 8, 0.05, 10, 0.1, 14],
    ]
)
_P6 = 1e-4 * np.array(
    [
        [1312, 1696, 5569, 124, 8283, 5886],
        [2329, 4135, 8307, 3736, 1004, 9991],
        [2348, 1451, 3522, 2883, 3047, 6650],
        [4047, 8828, 8732, 5743, 1091, 381],
    ]
)


def hartmann3(**x: float) -> float:
    """Four local minima in three dimensions."""
    return float(-_WEIGHTS @ np.exp(-(_A3 * (np.array(list(x.values())) - _P3) ** 2).sum(axis=1)))


def hartmann6(**x: float) -> float:
    """Six dimensions, with a local minimum at -3.2032 that holds many searches."""
    return float(-_WEIGHTS @ np.exp(-(_A6 * (np.array(list(x.values())) - _P6) ** 2).sum(axis=1)))


def _box(bounds: dict[str, tuple[float, float, str]]) -> Space:
    return Space([Parameter(name, lower=lo, upper=hi, unit=unit) for name, (lo, hi, unit) in bounds.items()])


BOREHOLE = _box(
    {
        "rw": (0.05, 0.15, "m"),
        "r": (100, 50_000, "m"),
        "Tu": (63_070, 115_600, "m2/yr"),
        "Hu": (990, 1110, "m"),
        "Tl": (63.1, 116, "m2/yr"),
        "Hl": (700, 820, "m"),
        "L": (1120, 1680, "m"),
        "Kw": (9855, 12_045, "m/yr"),
    }
)
PISTON = _box(
    {
        "M": (30, 60, "kg"),
        "S": (0.005, 0.020, "m2"),
        "V0": (0.002, 0.010, "m3"),
        "k": (1000, 5000, "N/m"),
        "P0": (90_000, 110_000, "N/m2"),
        "Ta": (290, 296, "K"),
        "T0": (340, 360, "K"),
    }
)
PROBLEMS = (
    Problem(name="borehole", function=borehole, space=BOREHOLE, sense="max", value=309.5755877),
    Problem(name="piston", function=piston, space=PISTON, sense="max", value=1.1990112),
    Problem(
        name="welch20",
        function=welch20,
        space=_box({f"x{i}": (-0.5, 0.5, "1") for i in range(1, 21)}),
        sense="max",
        value=13.3125,
    ),
    Problem(
        name="branin",
        function=branin,
        space=_box({"x1": (-5, 10, "1"), "x2": (0, 15, "1")}),
        sense="min",
        value=0.397887,
    ),
    Problem(
        name="goldstein_price",
        function=goldstein_price,
        space=_box({"x1": (-2, 2, "1"), "x2": (-2, 2, "1")}),
        sense="min",
        value=3.0,
    ),
    Problem(
        name="hartmann3",
        function=hartmann3,
        space=_box({f"x{i}": (0, 1, "1") for i in range(1, 4)}),
        sense="min",
        value=-3.862782,
    ),
    Problem(
        name="hartmann6",
        function=hartmann6,
        space=_box({f"x{i}": (0, 1, "1") for i in range(1, 7)}),
        sense="min",
        value=-3.322368,
    ),
)


def evaluations_to(history: np.ndarray, problem: Problem, *, share: float = 0.01) -> int | None:
    """How many true runs until the best is within `share` of the known extreme; None when never."""
    within = np.abs(np.asarray(history) - problem.value) <= share * abs(problem.value)
    return int(np.argmax(within)) + 1 if within.any() else None


BUDGET = {
    "borehole": 40, "piston": 40, "welch20": 80, "branin": 60, "goldstein_price": 80, "hartmann3": 60,
    "hartmann6": 150,
}  # fmt: skip


def run(
    seed: int = 0,
    *,
    budget: int | None = None,
    problems: tuple[Problem, ...] = PROBLEMS,
    workers: int = 1,
) -> xr.Dataset:
    """Search every problem once: evaluations to 1 %, value found, stated gap and true gap.

    `budget`: true runs for every problem; by default those of the published table. `workers`: runs that are
    proposed at once.
    """
    rows = []
    for problem in problems:
        most = BUDGET.get(problem.name, 60) if budget is None else budget
        found = worst_case(
            problem.function, problem.space, sense=problem.sense, budget=most, seed=seed, workers=workers
        )
        rows.append(
            (
                evaluations_to(found.history, problem) or np.nan,
                found.value,
                problem.value,
                found.gap.width,
                abs(problem.value - found.value),
                most,
            )
        )
    columns = ("evaluations_to_1_percent", "found", "known", "stated_gap", "true_gap", "budget")
    return xr.Dataset(
        {
            name: ("problem", np.array(column))
            for name, column in zip(columns, zip(*rows, strict=True), strict=True)
        },
        coords={"problem": [p.name for p in problems]},
        attrs={"seed": seed},
    )


def spread(
    seeds: Sequence[int],
    *,
    budget: int | None = None,
    problems: tuple[Problem, ...] = PROBLEMS,
    workers: int = 1,
) -> xr.Dataset:
    """`run` over several seeds: dims `seed, problem`, with the median count beside the counts.

    A search that never comes within 1 % counts as infinitely many runs in the median.
    """
    ds = xr.concat(
        [run(seed, budget=budget, problems=problems, workers=workers) for seed in seeds],
        "seed",
        combine_attrs="drop_conflicts",
    ).assign_coords(seed=list(seeds))
    ds["median"] = ds.evaluations_to_1_percent.fillna(np.inf).median("seed")
    return ds


if __name__ == "__main__":
    searches = spread(asked_range(sys.argv[1:]), workers=int((sys.argv[3:4] or ["1"])[0]))
    table = searches.evaluations_to_1_percent.to_pandas().T
    table["median"] = searches["median"].to_pandas()
    table["covered"] = (searches.true_gap <= searches.stated_gap + 1e-6).mean("seed").to_pandas()
    print(table.to_string(float_format="%.4g"))
