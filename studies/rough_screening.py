"""Screenings of responses with steps and kinks: 64 runs of 20 inputs.

Sobol's g, steps, steps that act as a product, stairs and kinks beside smooth functions; columns shuffled,
random Latin hypercubes. They are screened by a smooth correlation (eta 2), by `KrigingScreener` as it comes,
and by `workbench.screen` as it comes, which is what a user gets: it chooses the scale, too. All three ask the
second witness. Counted are

    right             screenings whose list is exactly the inputs with a total index above 1 %
    with_beside       the same of the list and what stands beside it, as below 1 % or named by one witness
    missing, inert    inputs above 1 % that are not listed, below 1 % that are
    beyond            screenings that lack an input above x, the share that their verdict names
    resolved          screenings so called, and wrongly_resolved those of them that are not right

`python -m studies.rough_screening 0 10` prints a line per function for seeds 0 to 9; `... 0 10 user`, what a
user gets alone.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import doe
from studies.asked_range import asked_range
from studies.screening_functions import FUNCTIONS as PUBLISHED
from surrogates import KrigingScreener
from workbench.screening.kriging import screen
from workbench.space.box import Space
from workbench.space.parameter import Parameter

__all__ = ["FUNCTIONS", "METHODS", "run"]

Array = NDArray[np.float64]

INPUTS, RUNS = 20, 64
ACTIVE = 0.01  # total index from which on an input counts


def _g(*a: float) -> Callable[[Array], Array]:
    """Sobol's g of the first inputs; the others do not act."""

    def evaluate(x: Array) -> Array:
        return np.asarray(np.prod((np.abs(4 * x[:, : len(a)] - 2) + a) / (1 + np.array(a)), axis=1))

    return evaluate


FUNCTIONS: dict[str, Callable[[Array], Array]] = {
    "g 0, 0.5, 3, 9": _g(0.0, 0.5, 3.0, 9.0),
    "g 0, 1, 4.5, 9": _g(0.0, 1.0, 4.5, 9.0),
    "g 0, 1, 4.5, 99": _g(0.0, 1.0, 4.5, *[99.0] * 17),
    "three steps": lambda x: 2.0 * (x[:, 0] > 0.5) + 1.5 * (x[:, 1] > 0.3) + 1.0 * (x[:, 2] < 0.6),
    "steps and a product": lambda x: (
        2.0 * (x[:, 0] > 0.5) + 1.5 * (x[:, 1] < 0.4) + 2.5 * ((x[:, 2] > 0.5) & (x[:, 3] > 0.5))
    ),
    "four steps": lambda x: (
        2.0 * (x[:, 0] > 0.4) + 1.5 * (x[:, 1] > 0.7) + 1.3 * (x[:, 2] < 0.5) + 0.8 * (x[:, 3] > 0.5)
    ),
    "stairs": lambda x: np.floor(4 * x[:, 0]) + 0.7 * np.floor(3 * x[:, 1]) * (x[:, 2] > 0.4),
    "kinks": lambda x: (
        3 * np.abs(x[:, 0] - 0.3) + 2 * np.abs(x[:, 1] - 0.6) + 3 * np.maximum(x[:, 2] - 0.5, 0.0)
    ),
    "welch": PUBLISHED["welch"].evaluate,
    "friedman": PUBLISHED["friedman"].evaluate,
}


@cache
def _totals(name: str) -> Array:
    """Total indices (20,): Jansen's estimator on 2^13 pairs of Sobol' points."""
    points = doe.sobol(2**13, 2 * INPUTS, rng=np.random.default_rng(0))
    a, b = points[:, :INPUTS], points[:, INPUTS:]
    y = FUNCTIONS[name](a)
    found = np.zeros(INPUTS)
    for k in range(INPUTS):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        found[k] = 0.5 * float(((y - FUNCTIONS[name](mixed)) ** 2).mean()) / float(y.var())
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _Told:
    """What a screening says of the inputs, as columns of the function.

    listed: its list of drivers    beside: what it names besides, as below 1 % or by the second witness alone
    x: no input above this share is missing, it says
    """

    listed: frozenset[int]
    beside: frozenset[int]
    resolved: bool
    x: float


def _by_likelihood(x: Array, y: Array, eta: float | None) -> _Told:
    found = KrigingScreener(eta=eta).fit(x, y)
    facts = found.diagnosis_
    return _Told(
        listed=frozenset(found.selected_.tolist()),
        beside=frozenset(found.minor_.tolist()) | frozenset(facts.disputed),
        resolved=facts.resolved,
        x=facts.hidden_share,
    )


def _as_a_user(x: Array, y: Array) -> _Told:
    """`workbench.screen` as it comes: it chooses the scale, and both witnesses speak."""
    space = Space(tuple(Parameter(f"x{k}", lower=0.0, upper=1.0) for k in range(x.shape[1])))
    rows = [{**row, "y": value} for row, value in zip(space.rows(x), y.tolist(), strict=True)]
    found = screen(rows, space, "y", effects=False, regimes="off")
    column = {name: k for k, name in enumerate(space.names)}
    return _Told(
        listed=frozenset(column[name] for name in found.selected),
        beside=frozenset(column[name] for name in (*found.minor, *found.diagnosis["disputed"])),
        resolved=found.state == "resolved",
        x=found.hidden_share,
    )


METHODS: dict[str, Callable[[Array, Array], _Told]] = {
    "smooth": lambda x, y: _by_likelihood(x, y, 2.0),
    "default": lambda x, y: _by_likelihood(x, y, None),
    "user": _as_a_user,
}


def run(
    seeds: Sequence[int] = (0,),
    *,
    names: Sequence[str] = tuple(FUNCTIONS),
    methods: Sequence[str] = ("smooth", "default"),
) -> xr.Dataset:
    """Every function with every seed, screened by some of METHODS: the counts of the module's docstring."""
    variables = ("right", "with_beside", "missing", "inert", "beyond", "resolved", "wrongly_resolved")
    made = np.zeros((len(variables), len(names), len(seeds), len(methods)), dtype=int)
    for i, name in enumerate(names):
        for j, seed in enumerate(seeds):
            rng = np.random.default_rng([seed, sum(map(ord, name))])
            x, order = doe.lhs(RUNS, INPUTS, rng=rng), rng.permutation(INPUTS)
            y, totals = FUNCTIONS[name](x), _totals(name)[order]
            for k, method in enumerate(methods):
                told = METHODS[method](x[:, order], y)
                made[:, i, j, k] = _judged(told, totals)
    axes = ("function", "seed", "method")
    return xr.Dataset(
        {key: (axes, values) for key, values in zip(variables, made, strict=True)},
        coords={"function": list(names), "seed": list(seeds), "method": list(methods)},
    )


def _judged(told: _Told, totals: Array) -> tuple[int, ...]:
    def above(share: float) -> set[int]:
        return set(np.flatnonzero(totals > share).tolist())

    active, known = above(ACTIVE), told.listed | told.beside
    right = told.listed == active
    return (
        right,
        known == active,
        len(active - told.listed),
        len(told.listed - active),
        bool(above(told.x) - known),
        told.resolved,
        told.resolved and not right,
    )


if __name__ == "__main__":
    seeds, asked = asked_range(sys.argv[1:]), sys.argv[3:] or list(METHODS)
    if stray := [word for word in asked if word not in METHODS]:
        raise SystemExit(f"methods are {', '.join(METHODS)}, got {stray[0]!r}")
    for name in FUNCTIONS:
        sums = run(seeds, names=(name,), methods=asked).sum(("function", "seed"))
        words = "  ".join(f"{key} {sums[key].values.tolist()}" for key in sums.data_vars)
        active = int((_totals(name) > ACTIVE).sum())
        print(f"{name:20s} {active} active, {len(seeds)} screenings, {', '.join(asked)}: {words}", flush=True)
