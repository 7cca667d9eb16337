"""Worst cases at the border of failures: how many runs fail, how close the search comes, whether it says so.

Eight models of 2 to 10 inputs in [0, 1] fail in a part of the box towards which their response grows.
The worst of the runs that give a value lies on the border, where no slope says that the response ends:

    plane d     linear response, fails beyond a plane      (d = 2, 4, 7, 10; the worst by linear programming)
    own d       fails where the response itself is too large  (d = 4, 6; the worst is the limit)
    sphere 3    linear response, fails beyond a sphere        (closed form)
    product 8   product of affine factors, fails beyond a plane (worst by many starts of SLSQP)

Any number of others is `drawn`: a linear response with a diagonal bend in 2 to 7 inputs, which fails beyond a
plane or inside an ellipsoid around a place where it is large. No method was tuned to them.

`python -m studies.failure_border 0 10` prints a line per model for seeds 0 to 9, and
`python -m studies.failure_border drawn 0 20` a line per drawn problem 0 to 19, one search each.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linprog, minimize

from studies.asked_range import asked_range
from workbench import Parameter, Space
from workbench.search.worst_case import worst_case

__all__ = [
    "CLOSE",
    "MODELS",
    "Bordered",
    "as_dataset",
    "constrained_worst",
    "drawn",
    "run",
    "run_drawn",
    "searched",
]

WORDS = "SolverError: step size underflow"
CLOSE = 0.01  # of the constrained worst
TOLD = ("failed", "short", "says", "covers")  # of a search, see `searched`
SPHERE, LIMIT = 1.15, 0.6

Array = np.ndarray


class SolverError(RuntimeError):
    """What a solver says when it gives up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bordered:
    """A response (d,) -> number, which fails where `margin` is negative; `worst` of those that succeed."""

    name: str
    dimension: int
    response: Callable[[Array], float]
    margin: Callable[[Array], float]
    worst: float

    def __call__(self, **x: float) -> float:
        """The response, or the solver's error."""
        u = np.array([x[f"x{i + 1}"] for i in range(self.dimension)])
        if self.margin(u) < 0:
            raise SolverError("step size underflow")
        return float(self.response(u))

    @property
    def space(self) -> Space:
        """The unit cube."""
        return Space([Parameter(f"x{i + 1}", lower=0.0, upper=1.0) for i in range(self.dimension)])


def _weights(d: int, key: int) -> tuple[Array, Array, float]:
    """Slopes of a response and of a border, and where the border lies: a sixth of the box fails or so."""
    rng = np.random.default_rng([d, key])
    a, b = 0.3 + rng.random(d), 0.3 + rng.random(d)
    return a, b, float(b.sum() / 2 + 1.0 * np.sqrt((b**2).sum() / 12))


def _plane(d: int) -> Bordered:
    a, b, c = _weights(d, 1)
    solve: Any = linprog
    found = solve(-a, A_ub=b[None], b_ub=[c], bounds=[(0, 1)] * d)
    return Bordered(
        name=f"plane {d}", dimension=d, response=lambda u: a @ u, margin=lambda u: c - b @ u, worst=-found.fun
    )


def _own(d: int) -> Bordered:
    a, _, _ = _weights(d, 2)

    def response(u: Array) -> float:
        return float(a @ u**2 + 0.5 * a @ u)

    limit = LIMIT * response(np.ones(d))
    return Bordered(
        name=f"own {d}", dimension=d, response=response, margin=lambda u: limit - response(u), worst=limit
    )


def _sphere() -> Bordered:
    a = np.array([1.0, 0.8, 0.4])
    return Bordered(
        name="sphere 3", dimension=3, response=lambda u: a @ u, margin=lambda u: SPHERE**2 - u @ u,
        worst=SPHERE * float(np.linalg.norm(a)),
    )  # fmt: skip


def _product() -> Bordered:
    a, b, c = _weights(8, 3)

    def response(u: Array) -> float:
        return float(np.prod(1 + 0.5 * a * u))

    rng = np.random.default_rng(0)
    climb: Any = minimize
    left = {"type": "ineq", "fun": lambda u: c - b @ u}
    ends = [
        climb(
            lambda u: -float(np.log(response(u))), start, bounds=[(0, 1)] * 8, method="SLSQP",
            constraints=left,
        )
        for start in rng.random((20, 8)) * 0.6
    ]  # fmt: skip
    worst = float(np.exp(-min(end.fun for end in ends if end.success)))
    return Bordered(name="product 8", dimension=8, response=response, margin=lambda u: c - b @ u, worst=worst)


MODELS: dict[str, Callable[[], Bordered]] = {
    "plane 2": cache(lambda: _plane(2)),
    "plane 4": cache(lambda: _plane(4)),
    "plane 7": cache(lambda: _plane(7)),
    "plane 10": cache(lambda: _plane(10)),
    "own 4": cache(lambda: _own(4)),
    "own 6": cache(lambda: _own(6)),
    "sphere 3": cache(_sphere),
    "product 8": cache(_product),
}


FAILING = (0.05, 0.35)  # share of the box that fails in a drawn problem
DRAWN_INPUTS = (2, 3, 4, 5, 6, 7)
BEST, OTHERS = 20, 150  # starts of SLSQP: the largest responses, and others from the largest to the smallest
CUT = 0.02  # of the worst: a drawn border takes at least so much of the response's range


def drawn(number: int) -> Bordered:
    """The drawn problem of a number: its worst by many starts of SLSQP and an even sample beside them."""
    rng = np.random.default_rng([19, number])
    d = DRAWN_INPUTS[number % len(DRAWN_INPUTS)]
    even = rng.random((4000, d))
    while True:
        slope, bend = rng.standard_normal(d), 0.5 * rng.standard_normal(d)
        size, metric = rng.standard_normal(d), rng.uniform(0.5, 2.0, d)
        is_plane, share = bool(rng.random() < 0.5), float(rng.uniform(*FAILING))

        def response(u: Array, slope: Array = slope, bend: Array = bend) -> float:
            return float(3.0 + np.abs(slope).sum() + u @ slope + (u - 0.5) ** 2 @ bend)

        top = max((even, np.round(even)), key=lambda at: max(map(response, at)))
        peak = top[int(np.argmax([response(u) for u in top]))]
        normal = slope + 0.5 * size

        def reached(u: Array, metric: Array = metric, peak: Array = peak, normal: Array = normal,
                    is_plane: bool = is_plane) -> float:  # fmt: skip
            return float(u @ normal if is_plane else -((u - peak) ** 2 @ metric))

        limit = float(np.quantile([reached(u) for u in even], 1 - share))

        def margin(u: Array, reached: Callable[[Array], float] = reached, limit: float = limit) -> float:
            return limit - reached(u)

        worst = constrained_worst(response, margin, even)
        if response(peak) > (1 + CUT) * worst:
            kind = "plane" if is_plane else "ellipsoid"
            return Bordered(
                name=f"{kind} {d} #{number}", dimension=d, response=response, margin=margin, worst=worst
            )


def constrained_worst(
    response: Callable[[Array], float], margin: Callable[[Array], float], even: Array
) -> float:
    """The largest response where `margin` is not negative: SLSQP from the best of `even` and others of it.

    The best may all lie in one basin, and from them alone one worst in forty was 0.1 to 1.4 % too small.
    """
    inside = even[[margin(u) >= 0 for u in even]]
    values = np.array([response(u) for u in inside])
    order = np.argsort(-values)
    starts = inside[np.concatenate([order[:BEST], order[BEST :: max(len(order) // OTHERS, 1)]])]
    climb: Any = minimize
    left = {"type": "ineq", "fun": margin}
    ends = [
        climb(
            lambda u: -response(u), start, bounds=[(0, 1)] * even.shape[1], method="SLSQP", constraints=left
        )
        for start in starts
    ]
    return max([float(values.max()), *(-float(end.fun) for end in ends if margin(end.x) >= -1e-9)])


def searched(model: Bordered, seed: int, budget: int) -> tuple[float, ...]:
    """Of one search: the share of its runs that failed, how far it stays short of the worst, relative to it,
    whether the result says that it borders on failures, and whether its gap covers the worst.
    """
    found = worst_case(model, model.space, budget=budget, seed=seed)
    own = [run for run in found.runs if run.proposal != "start"]
    failed = sum(run.value is None for run in own)
    border = found.border
    says = border is not None and border.borders and WORDS in border.sentence
    covers = found.gap.width >= model.worst - found.value
    return failed / max(len(own), 1), (model.worst - found.value) / model.worst, float(says), float(covers)


def run(
    seeds: Sequence[int] = (0,), *, budget: int = 30, models: Sequence[str] = tuple(MODELS)
) -> xr.Dataset:
    """Every model with every seed: the share of search runs that `failed`, how far the worst found is `short`
    of the constrained worst, relative to it, whether the result `says` that it borders on failures, and
    whether its gap `covers` the worst.
    """
    made = np.array([[searched(MODELS[name](), seed, budget) for seed in seeds] for name in models])
    return as_dataset(made, {"model": models, "seed": seeds}, budget=budget)


def run_drawn(numbers: Sequence[int], *, budget: int = 30) -> xr.Dataset:
    """One search of each drawn problem, with its number for a seed, as `run`."""
    made = np.array([searched(drawn(number), number, budget) for number in numbers])
    return as_dataset(made, {"number": numbers}, budget=budget)


def as_dataset(made: Array, axes: Mapping[str, Sequence[Any]], *, budget: int) -> xr.Dataset:
    """What was told of searches, `made` (..., 4) over the axes, by the names of `TOLD`."""
    return xr.Dataset(
        {name: (tuple(axes), made[..., k]) for k, name in enumerate(TOLD)},
        coords={axis: list(values) for axis, values in axes.items()},
        attrs={"budget": budget, "close": CLOSE},
    )


if __name__ == "__main__" and sys.argv[1:2] == ["drawn"]:
    found = run_drawn(asked_range(sys.argv[2:]))
    for number, failed, short in zip(found["number"].values, found["failed"], found["short"], strict=True):
        print(f"{drawn(int(number)).name:18s} failed {float(failed):5.1%}   short {float(short):7.2%}")
    print(
        f"{found['short'].size} problems: {float(found['failed'].mean()):.1%} of the search's runs fail, "
        f"{float((found['short'] <= CLOSE).mean()):.1%} within 1 %, "
        f"median short {float(found['short'].median()):.2%}"
    )
elif __name__ == "__main__":
    seeds = asked_range(sys.argv[1:])
    parts = []
    for name in MODELS:
        part = run(seeds, models=(name,))
        parts.append(part)
        print(
            f"{name:10s} failed {float(part['failed'].mean()):5.1%}   within 1 % "
            f"{float((part['short'] <= CLOSE).mean()):5.1%}   short {float(part['short'].median()):7.2%}   "
            f"says {float(part['says'].mean()):5.1%}",
            flush=True,
        )
    every = xr.concat(parts, "model")
    print(
        f"{every['short'].size} searches: {float(every['failed'].mean()):.1%} of the search's runs fail, "
        f"{float((every['short'] <= CLOSE).mean()):.1%} within 1 %, {float(every['says'].mean()):.1%} say so"
    )
