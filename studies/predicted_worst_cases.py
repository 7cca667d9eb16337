"""Does the bound hold where nothing can be run? Worst cases that a Kriging predicts from a table of runs.

A table is all there is: rows of a function of known extremes in a random Latin hypercube, 5 or 10 per input.
The worst case is the Kriging's, and the stated bound says how much worse it could be. It covers when the
function's own extreme does not lie beyond that bound.

Functions: those of `studies.worst_case_calibration`, both extremes. In every second table a tenth of the rows
has no value, on one side of the box: that of a random direction.

`python -m studies.predicted_worst_cases 0 3` prints a line per table for seeds 0, 1, 2, all as shares of the
function's range beyond the worst row, then the totals.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from studies.asked_range import asked_range
from studies.worst_case_calibration import COVERED, FUNCTIONS, Extremes
from workbench.search.worst_case import surrogate_worst_case

__all__ = ["Predicted", "run", "tables"]

PER_INPUT = (5, 10)  # rows, by turns
CUT = 0.1  # of the rows, without a value in every second table


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """One table: the function's extreme, the predicted worst and how much worse it is said to be at most, as
    shares of the function's range beyond the worst row; `confirmed` where a row is the worst case."""

    case: str
    seed: int
    extreme: float
    predicted: float
    upper: float
    confirmed: bool

    @property
    def is_covered(self) -> bool:
        """Whether the extreme lies within the bound."""
        return self.extreme <= self.upper + COVERED


def _table(f: Extremes, sense: str, seed: int, number: int) -> Predicted:
    rng = np.random.default_rng([seed, number])
    d = len(f.space.names)
    n = PER_INPUT[(seed + number) % 2] * d
    u = (rng.permuted(np.tile(np.arange(n)[:, None], (1, d)), axis=0) + rng.random((n, d))) / n
    place = u @ rng.standard_normal(d)
    is_cut = number // 2 % 2 == 1
    kept = place <= np.quantile(place, 1 - CUT) if is_cut else np.full(n, True)
    bounds = [(p.lower, p.upper) for p in f.space.parameters]
    rows = []
    for at, has_value in zip(u, kept, strict=True):
        x = {
            p.name: low + a * (high - low)
            for p, a, (low, high) in zip(f.space.parameters, at, bounds, strict=True)
        }
        rows.append({**x, "y": f.function(**x) if has_value else float("nan")})
    found = surrogate_worst_case(f.space, rows, response="y", sense=sense, seed=seed)
    sign, size = (1.0 if sense == "max" else -1.0), f.high - f.low
    best = max(sign * row["y"] for row in rows if np.isfinite(row["y"]))
    extreme = f.high if sense == "max" else -f.low
    return Predicted(
        case=f"{f.name} {sense}{' cut' if is_cut else ''}", seed=seed, extreme=(extreme - best) / size,
        predicted=(sign * found.value - best) / size, upper=(sign * found.gap.upper - best) / size,
        confirmed=found.confirmed,
    )  # fmt: skip


def tables(seeds: Sequence[int] = (0,), *, functions: Sequence[Extremes] = FUNCTIONS) -> Iterator[Predicted]:
    """A table of every function for each of its extremes, with every seed."""
    for seed in seeds:
        for k, f in enumerate(functions):
            for j, sense in enumerate(("max", "min")):
                yield _table(f, sense, seed, 2 * k + j)


def run(seeds: Sequence[int] = (0,), *, functions: Sequence[Extremes] = FUNCTIONS) -> xr.Dataset:
    """All tables; shares of the range beyond the worst row."""
    made = list(tables(seeds, functions=functions))
    columns = ("extreme", "predicted", "upper", "confirmed")
    return xr.Dataset(
        {name: ("table", np.array([getattr(t, name) for t in made])) for name in columns},
        coords={"case": ("table", [t.case for t in made]), "seed": ("table", [t.seed for t in made])},
        attrs={"covered": float(np.mean([t.is_covered for t in made]))},
    )


if __name__ == "__main__":
    done: list[Predicted] = []
    for t in tables(asked_range(sys.argv[1:])):
        done.append(t)
        word = "" if t.is_covered else "   not covered"
        kind = "a row" if t.confirmed else f"predicted {t.predicted:6.3f}"
        shares = f"bound {t.upper:6.3f}   extreme {t.extreme:6.3f}"
        print(f"{t.case:24s} seed {t.seed:3d}   {kind:17s} {shares}{word}", flush=True)
    bounded = [t for t in done if np.isfinite(t.upper)]
    covered = np.mean([t.is_covered for t in bounded])
    width = np.median([t.upper - max(t.predicted, 0.0) for t in bounded])
    print(
        f"{len(done)} tables, a bound is stated of {len(bounded)}: it covers in {covered:.1%}, "
        f"median width {width:.1%} of the range"
    )
