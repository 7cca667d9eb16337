"""How often does an adversary break a wrong claim, and with how many runs?

The measure is that of the falsification category of ARCH-COMP: success over repetitions, against uniform
random draws as the base line. Every problem is drawn at random from one of seven families in which worst
cases of engineering responses stand, with its largest value known; the claim under attack is too low by 2 %
or 10 % of the range. Attackers: uniform draws, random corners, half of each, and `attack`.

    corners   multilinear with interactions of both signs, 10 inputs: many corners from which no change gains
    modes     eight peaks inside, 4 inputs
    faces     linear in 8 inputs, with a narrow resonance inside a ninth
    cliff     linear in 12 inputs, doubled where six of them stand high together
    edge      rises in 8 inputs up to a limit, beyond which it has fallen to a third
    failing   linear in 8 inputs, fails beyond a limit that cuts off the worst corner
    levels    24 combinations of unordered levels, each multilinear in 6 inputs of its own

`python -m studies.adversary 300 20 7` prints the success rates of 20 problems of each family for 300 runs,
drawn with seed 7. The split of the budget was chosen with seed 1.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linprog, minimize

from workbench import Parameter, Space
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.evidence.attack.adversary import DEFAULT_SPLIT, Split, attack

__all__ = ["ATTACKERS", "FAMILIES", "Problem", "run"]

TOO_LOW = (0.02, 0.1)  # of the range: how far the claims are below the truth
NEAR_MISS = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A function over a space with its largest value and, roughly, its smallest."""

    function: Callable[..., float]
    space: Space
    high: float
    low: float


def _cube(d: int) -> Space:
    return Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(d)])


def _vector(function: Callable[[np.ndarray], float]) -> Callable[..., float]:
    return lambda **x: float(function(np.array(list(x.values()), dtype=float)))


def _corner_table(d: int) -> np.ndarray:
    return np.array(list(product((0.0, 1.0), repeat=d)))


def _multilinear(d: int, rng: np.random.Generator) -> Callable[[np.ndarray], Any]:
    slopes, pairs = rng.normal(size=d), np.triu(rng.normal(size=(d, d)), 1)

    def value(u: np.ndarray) -> Any:
        s = 2 * u - 1
        return s @ slopes + ((s @ pairs) * s).sum(axis=-1)

    return value


def corners(rng: np.random.Generator) -> Problem:
    """Interactions of both signs: many corners from which no single change gains."""
    f = _multilinear(10, rng)
    table = f(_corner_table(10))
    return Problem(function=_vector(f), space=_cube(10), high=float(table.max()), low=float(table.min()))


def modes(rng: np.random.Generator) -> Problem:
    """Peaks inside, of different height and width."""
    centres, widths = rng.random((8, 4)), rng.uniform(0.12, 0.35, (8, 4))
    heights = rng.uniform(0.5, 1.0, 8)

    def f(u: np.ndarray) -> float:
        return float(heights @ np.exp(-(((u - centres) / widths) ** 2).sum(axis=1)))

    def down(u: np.ndarray) -> float:
        return -f(u)

    tops = [float(minimize(down, centre, bounds=[(0, 1)] * 4).fun) for centre in centres]
    return Problem(function=_vector(f), space=_cube(4), high=-min(tops), low=0.0)


def faces(rng: np.random.Generator) -> Problem:
    """Linear, with a resonance of 4 % width inside the last input."""
    slopes, centre = rng.normal(size=8), rng.uniform(0.1, 0.9)

    def f(u: np.ndarray) -> float:
        peak = 1 / (1 + ((u[8] - centre) / 0.04) ** 2)
        return float(u[:8] @ slopes + (1 + 0.5 * u[0]) * 3 * peak)

    high = max(f(np.append(corner, centre)) for corner in _corner_table(8))
    return Problem(function=_vector(f), space=_cube(9), high=high, low=float(np.minimum(slopes, 0).sum()))


def cliff(rng: np.random.Generator) -> Problem:
    """Twice as bad where six inputs stand high together."""
    slopes = rng.uniform(0.2, 1.0, 12) * rng.choice([-1, 1], 12)
    together = rng.choice(12, 6, replace=False)
    ends = rng.integers(0, 2, 6).astype(float)

    def f(u: np.ndarray) -> float:
        base = float(u @ slopes - np.minimum(slopes, 0).sum())
        return base * (2.0 if np.abs(u[together] - ends).sum() < 0.6 else 1.0)

    best = np.where(slopes > 0, 1.0, 0.0)
    within = best.copy()
    within[together] = ends
    # inside the region the distances from the ends add up to 0.6: spent where the slope is steepest
    gains = np.abs(slopes[together]) * (best[together] != ends)
    high = 2 * (float(within @ slopes - np.minimum(slopes, 0).sum()) + 0.6 * float(gains.max()))
    return Problem(function=_vector(f), space=_cube(12), high=max(high, f(best)), low=0.0)


def _limit(slopes: np.ndarray, load: np.ndarray, limit: float) -> float:
    found = linprog(-slopes, A_ub=load[None], b_ub=[limit], bounds=(0, 1))
    return float(found.x @ slopes)


def edge(rng: np.random.Generator) -> Problem:
    """Worst just before a limit, a third of it beyond."""
    slopes, load = rng.uniform(0.2, 1.0, 8), rng.uniform(0.2, 1.0, 8)
    limit = 0.6 * load.sum()
    f = _vector(lambda u: float(u @ slopes) * (1.0 if u @ load <= limit else 1 / 3))
    return Problem(function=f, space=_cube(8), high=_limit(slopes, load, limit), low=0.0)


def failing(rng: np.random.Generator) -> Problem:
    """Fails beyond a limit that cuts off the worst corner."""
    slopes, load = rng.uniform(0.2, 1.0, 8), rng.uniform(0.2, 1.0, 8)
    limit = 0.6 * load.sum()

    def f(**x: float) -> float:
        u = np.array(list(x.values()))
        if u @ load > limit:
            raise ArithmeticError("no convergence")
        return float(u @ slopes)

    return Problem(function=f, space=_cube(8), high=_limit(slopes, load, limit), low=0.0)


def levels(rng: np.random.Generator) -> Problem:
    """Twenty-four combinations of unordered levels with a response of their own each."""
    grip, seat = ("one", "two", "none"), ("soft", "stiff", "air", "mesh")
    parts = {key: (_multilinear(6, rng), rng.normal()) for key in product((0, 1), grip, seat)}

    def f(*, belt: int, hands: str, cushion: str, **x: float) -> float:
        part, offset = parts[belt, hands, cushion]
        return float(part(np.array(list(x.values())))) + 3 * offset

    tables = [part(_corner_table(6)) + 3 * offset for part, offset in parts.values()]
    space = Space(
        [
            Parameter("belt", kind="binary"),
            Parameter("hands", kind="categorical", levels=grip),
            Parameter("cushion", kind="categorical", levels=seat),
            *_cube(6).parameters,
        ]
    )
    return Problem(
        function=f, space=space, high=max(t.max() for t in tables), low=min(t.min() for t in tables)
    )


FAMILIES = {f.__name__: f for f in (corners, modes, faces, cliff, edge, failing, levels)}


def _uniform(problem: Problem, budget: int, seed: int) -> np.ndarray:
    return _drawn(problem, np.random.default_rng((seed, 1)).random((budget, problem.space.dimension)))


def _random_corners(problem: Problem, budget: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng((seed, 2))
    u = rng.integers(0, 2, (budget, problem.space.dimension)).astype(float)
    for j, parameter in enumerate(problem.space.parameters):
        if parameter.kind == "categorical":
            u[:, j] = rng.random(budget)
    return _drawn(problem, u)


def _half_of_each(problem: Problem, budget: int, seed: int) -> np.ndarray:
    return np.append(
        _uniform(problem, budget // 2, seed), _random_corners(problem, budget - budget // 2, seed)
    )


def _drawn(problem: Problem, u: np.ndarray) -> np.ndarray:
    evaluate = FunctionEvaluator(problem.function)
    outcomes = evaluate(problem.space.rows(u), purpose="draw")
    return np.array([o.outputs["y"] if o.status == "ok" else -np.inf for o in outcomes])


def adversary(problem: Problem, budget: int, seed: int, split: Split = DEFAULT_SPLIT) -> np.ndarray:
    """Values (budget,) of the attack in the order run; -inf where a run failed."""
    made = attack(
        FunctionEvaluator(problem.function),
        problem.space,
        value=problem.high,
        budget=budget,
        seed=seed,
        split=split,
    )
    return np.array([-np.inf if a.value is None else a.value for a in made.attempts])


ATTACKERS: dict[str, Callable[[Problem, int, int], np.ndarray]] = {
    "uniform": _uniform,
    "random corners": _random_corners,
    "half of each": _half_of_each,
    "adversary": adversary,
}


def run(seed: int = 0, *, budget: int = 300, problems: int = 10) -> xr.Dataset:
    """Success of every attacker on `problems` problems of each family.

    `broken` (attacker, family, problem, too_low) of bool: a run beyond the claim was made within the budget.
    """
    broken = np.zeros((len(ATTACKERS), len(FAMILIES), problems, len(TOO_LOW)), dtype=bool)
    for j, (name, family) in enumerate(FAMILIES.items()):
        for k in range(problems):
            problem = family(np.random.default_rng((seed, k, *name.encode())))
            for i, attacker in enumerate(ATTACKERS.values()):
                largest = attacker(problem, budget, 1000 * seed + k).max()
                if largest > problem.high + NEAR_MISS * max(1.0, abs(problem.high)):
                    raise ValueError(f"{name} {k}: {largest} lies beyond the known largest {problem.high}")
                for m, share in enumerate(TOO_LOW):
                    broken[i, j, k, m] = largest > problem.high - share * (problem.high - problem.low)
    return xr.Dataset(
        {"broken": (("attacker", "family", "problem", "too_low"), broken)},
        coords={"attacker": list(ATTACKERS), "family": list(FAMILIES), "too_low": list(TOO_LOW)},
        attrs={"seed": seed, "budget": budget},
    )


if __name__ == "__main__":
    budget, problems, seed = (
        int(text) for text in (*sys.argv[1:4], *("300", "10", "7")[len(sys.argv) - 1 :])
    )
    rates = run(seed, budget=budget, problems=problems).broken.mean("problem")
    for share in TOO_LOW:
        print(f"claims {share:.0%} of the range too low, {budget} runs: share of {problems} problems broken")
        print(rates.sel(too_low=share).to_pandas().assign(all=lambda t: t.mean(axis=1)).round(2).to_string())
