"""Do attacked values stand? Worst cases that an adversary has looked at, tried by another sampler.

Each function is searched with `attack` on; whatever is stated is then tried with 1 500 fresh true runs that
share neither seed nor method with search and adversary:

    a third   even random points
    a third   random corners, every second one with its coordinates moved inwards a little
    a third   ascents from the five worst cases known by then (the stated one is among them): random steps of
              some coordinates, that grow after a gain and shrink without one

A value is beaten when a fresh run exceeds it by more than 2 % of it, or of a hundredth of the range of all
runs where the value is nearly zero. Functions: the 18 of `studies.worst_case_calibration`, by turns the
largest and the smallest value, those of `studies.adversary` with cliffs, edges, narrow peaks, failures and
levels, the switches of `studies.worst_case_mixed`, and a rough one of twelve inputs.

`python -m studies.attacked_values 0` prints a line per function, then how many of the values that are graded
proved or attacked were beaten, and how many of the others. `python -m studies.attacked_values drawn 22 100`
does so for 22 functions of `studies.rough_functions`, drawn with that seed or with each of several;
`... makes 13 9700` for 13 of each of the eleven makes of that study and the seven of `studies.adversary`.
With `--attack 300` the attacks have as many runs.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from studies import rough_functions
from studies.adversary import FAMILIES
from studies.rough_functions import drawn
from studies.worst_case_calibration import FUNCTIONS
from studies.worst_case_mixed import SWITCHES, switches_response
from workbench import Parameter, Space
from workbench.search.evidence.grade import Grade
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.worst_case import worst_case

__all__ = ["CASES", "Case", "fresh_best", "main", "of_each_make", "run"]

BUDGET, ATTACK, FRESH = 40, 1200, 1500
BEATEN = 0.02
TWICE = ("corners", "cliff", "levels")  # families that two problems are drawn from
STARTS, NEAR = 5, 0.1
FIRST_STEP, GROWTH, SHRINK = 0.2, 1.5, 0.85

Array = np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A function over a space, and the sense in which it is bad."""

    name: str
    function: Callable[..., float]
    space: Space
    sense: str = "max"


def _rough(**x: float) -> float:
    """A ridge with ripples in twelve inputs."""
    u = np.array(list(x.values()))
    slope = np.linspace(1.0, 0.1, 12) * np.where(np.arange(12) % 3 == 0, -1, 1)
    return float(u @ slope + 0.25 * np.cos(9 * u + np.arange(12)).sum() + 2.0 * u[0] * u[4])


def _cases() -> dict[str, Case]:
    known = [
        Case(name=f"{f.name} {sense}", function=f.function, space=f.space, sense=sense)
        for i, f in enumerate(FUNCTIONS)
        for sense in (("max", "min")[i % 2],)
    ]
    numbered = [(name, k) for name in FAMILIES for k in range(2 if name in TWICE else 1)]
    drawn = [(name, k, FAMILIES[name](np.random.default_rng([1900, k]))) for name, k in numbered]
    own = [Case(name=f"{name} {k}", function=p.function, space=p.space) for name, k, p in drawn]
    switches = Case(name="switches", function=switches_response, space=SWITCHES)
    cube = Space([Parameter(f"x{i}", lower=0.0, upper=1.0) for i in range(12)])
    rough = Case(name="rough 12", function=_rough, space=cube)
    return {case.name: case for case in (*known, *own, switches, rough)}


CASES = _cases()


def of_each_make(seed: int, *, count: int) -> list[tuple[Case, int]]:
    """`count` functions of each make of both studies, by turns, with the seeds of their searches."""
    cases = []
    for k in range(count):
        for name, make in rough_functions.FAMILIES.items():
            function, space = make(np.random.default_rng([seed, k, *name.encode()]))
            cases.append((Case(name=f"{name} {k}", function=function, space=space), seed + k))
        for name, family in FAMILIES.items():
            p = family(np.random.default_rng([seed, k, *name.encode()]))
            cases.append((Case(name=f"known {name} {k}", function=p.function, space=p.space), seed + k))
    return cases


def fresh_best(case: Case, known: Array, *, runs: int = FRESH, seed: int) -> tuple[float, float]:
    """The worst and the least bad signed value of fresh runs; at `known` (d,) the stated value was found."""
    where = SearchSpace.of(case.space)
    rng = np.random.default_rng([seed, 4711])
    sign = 1.0 if case.sense == "max" else -1.0
    values = partial(_values, case, where, sign)
    each = runs // 3
    even = where.snap(rng.random((each, where.dimension)))
    ends = rng.integers(0, 2, (each, where.dimension)).astype(float)
    inwards = NEAR * np.abs(rng.standard_normal(ends.shape)) * (np.arange(each) % 2)[:, None]
    levelled = rng.random(ends.shape)  # a corner has no level of its own in between
    corners = np.abs(ends - inwards)
    for j in where.discrete:
        corners[:, j] = levelled[:, j]
    points = np.vstack([known[None], even, where.snap(corners)])
    found = values(points)
    lowest = float(found[np.isfinite(found)].min())
    reached = -np.inf
    for i in np.argsort(-found)[:STARTS]:
        reached = max(
            reached, _ascent(values, where, points[i], float(found[i]), runs=each // STARTS, rng=rng)
        )
    return max(reached, float(found[1:].max())), lowest


def _values(case: Case, where: SearchSpace, sign: float, points: Array) -> Array:
    out = np.full(len(points), -np.inf)
    for i, row in enumerate(where.rows(points)):
        try:
            out[i] = sign * float(case.function(**row))
        except ArithmeticError:
            continue  # a failed run beats no value
    return out


def _ascent(
    values: Callable[[Array], Array],
    where: SearchSpace,
    point: Array,
    value: float,
    *,
    runs: int,
    rng: np.random.Generator,
) -> float:
    """The worst value of an ascent from a point (d,) of known value."""
    length, d = FIRST_STEP, where.dimension
    for _ in range(runs):
        moved = rng.random(d) < max(1.5 / d, 0.3)
        step = length * rng.standard_normal(d) * moved
        tried = where.snap((point + step)[None])[0]
        for j in where.discrete:
            if moved[j]:
                tried[j] = where.snap(rng.random((1, d)))[0, j]
        (reached,) = values(tried[None])
        if reached > value:
            point, value, length = tried, float(reached), min(length * GROWTH, 1.0)
        else:
            length = max(length * SHRINK, 1e-3)
    return value


def _tried(case: Case, seed: int, attack: int) -> tuple[float, float, float, bool]:
    found = worst_case(
        case.function, case.space, sense=case.sense, budget=BUDGET, attack=attack, seed=seed, noise=False
    )
    where = SearchSpace.of(case.space)
    sign = 1.0 if case.sense == "max" else -1.0
    stated = sign * found.value
    best, lowest = fresh_best(case, where.unit([dict(found.parameters)])[0], seed=seed)
    scale = max(abs(stated), 0.01 * (max(best, stated) - lowest))
    return found.value, sign * best, (best - stated) / scale, found.grade is not Grade.SEARCHED


def run(
    seeds: Sequence[int] = (0,), *, names: Sequence[str] = tuple(CASES), attack: int = ATTACK
) -> xr.Dataset:
    """Every function with every seed: `stated`, the worst `fresh` run, its `excess` over the stated value as
    a share of it, and whether the value was `graded` attacked or proved.
    """
    made: Any = np.array([[_tried(CASES[name], seed, attack) for seed in seeds] for name in names])
    return xr.Dataset(
        {
            key: (("case", "seed"), made[:, :, k])
            for k, key in enumerate(("stated", "fresh", "excess", "graded"))
        },
        coords={"case": list(names), "seed": list(seeds)},
        attrs={"budget": BUDGET, "attack": attack, "fresh": FRESH, "beaten": BEATEN},
    )


def _asked(arguments: Sequence[str]) -> list[tuple[Case, int]]:
    """What the command line asks for."""
    if arguments[:1] == ["makes"]:
        count, *seeds = (int(text) for text in arguments[1:])
        return [one for seed in seeds for one in of_each_make(seed, count=count)]
    if arguments[:1] == ["drawn"]:
        count, *seeds = (int(text) for text in arguments[1:])
        return [
            (Case(name=f.name, function=f.function, space=f.space), seed)
            for seed in seeds
            for f in drawn(seed, count=count)
        ]
    return [(case, int(text)) for case in CASES.values() for text in arguments or ["0"]]


def main() -> None:
    """Print a line per function, and how many values were beaten."""
    ask = ArgumentParser(
        prog="python -m studies.attacked_values", description=(__doc__ or "").splitlines()[0]
    )
    ask.add_argument("asked", nargs="*", help="seeds; or `drawn` or `makes`, a number and seeds")
    ask.add_argument("--attack", type=int, default=ATTACK, help=f"runs of each attack ({ATTACK})")
    given = ask.parse_args()
    made = []
    for case, seed in _asked(given.asked):
        stated, fresh, excess, graded = _tried(case, seed, given.attack)
        made.append((excess, graded))
        word = "attacked" if graded else "searched"
        print(f"{case.name:18s} {seed} {word}  {stated:12.5g} {fresh:12.5g} {excess:8.2%}", flush=True)
    is_beaten, is_graded = np.array([e > BEATEN for e, _ in made]), np.array([bool(g) for _, g in made])
    for word, chosen in (("attacked or proved", is_graded), ("searched", ~is_graded)):
        print(f"{word}: {int((is_beaten & chosen).sum())} of {int(chosen.sum())} beaten by more than 2 %")


if __name__ == "__main__":
    main()
