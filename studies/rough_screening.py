"""Screenings of responses with steps and kinks: 64 runs of 20 inputs, smooth correlation and default.

Sobol's g, steps, steps that act as a product, stairs and kinks beside smooth functions; columns shuffled,
random Latin hypercubes. Counted are screenings that select exactly the inputs with a total index above 1 %,
inputs missing and inert ones selected, and screenings called resolved that are not right.

`python -m studies.rough_screening 0 10` prints a line per function for seeds 0 to 9.
"""

import sys
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import doe
from studies.screening_functions import FUNCTIONS as PUBLISHED
from surrogates import KrigingScreener

__all__ = ["FUNCTIONS", "run"]

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
def _active(name: str) -> frozenset[int]:
    """Inputs with a total index above 1 %: Jansen's estimator on 2^13 pairs of Sobol' points."""
    points = doe.sobol(2**13, 2 * INPUTS, rng=np.random.default_rng(0))
    a, b = points[:, :INPUTS], points[:, INPUTS:]
    y = FUNCTIONS[name](a)
    found = []
    for k in range(INPUTS):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        if 0.5 * float(((y - FUNCTIONS[name](mixed)) ** 2).mean()) > ACTIVE * float(y.var()):
            found.append(k)
    return frozenset(found)


def run(seeds: Sequence[int] = (0,), *, names: Sequence[str] = tuple(FUNCTIONS)) -> xr.Dataset:
    """Every function with every seed, smooth (eta 2) and default: right, missing, inert, wrongly resolved."""
    variables = ("right", "missing", "inert", "wrongly_resolved")
    made = np.zeros((len(variables), len(names), len(seeds), 2), dtype=int)
    for i, name in enumerate(names):
        for j, seed in enumerate(seeds):
            rng = np.random.default_rng([seed, sum(map(ord, name))])
            x, order = doe.lhs(RUNS, INPUTS, rng=rng), rng.permutation(INPUTS)
            y = FUNCTIONS[name](x)
            for k, eta in enumerate((2.0, None)):
                screener = KrigingScreener(eta=eta).fit(x[:, order], y)
                chosen = {int(order[c]) for c in screener.selected_}
                missing, inert = _active(name) - chosen, chosen - _active(name)
                right = not missing and not inert
                wrong = screener.diagnosis_.resolved and not right
                made[:, i, j, k] = right, len(missing), len(inert), wrong
    axes = ("function", "seed", "method")
    return xr.Dataset(
        {key: (axes, values) for key, values in zip(variables, made, strict=True)},
        coords={"function": list(names), "seed": list(seeds), "method": ["smooth", "default"]},
    )


if __name__ == "__main__":
    first, last = (int(text) for text in (sys.argv[1:3] or ("0", "1")))
    for name in FUNCTIONS:
        sums = run(range(first, last), names=(name,)).sum(("function", "seed"))
        words = "  ".join(f"{key} {sums[key].values.tolist()}" for key in sums.data_vars)
        print(
            f"{name:20s} {len(_active(name))} active, {last - first} screenings, smooth and default: {words}",
            flush=True,
        )
