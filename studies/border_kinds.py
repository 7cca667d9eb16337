"""Worst cases at borders of six kinds: of few inputs, of the response itself, behind a steep rise.

Drawn responses with bends along every input, in 2 to 10 inputs, grow towards a part of the box where runs
fail, between a twelfth and a third of it:

    one      beyond a value of the input that matters most
    two      beyond a weighted sum of the two that matter most
    own      where the response itself is too large
    corner   inside an ellipsoid around the corner where it is largest
    plane    beyond a plane whose slopes are those of the response, times 0.3 to 1.7
    steep    beyond a plane, and the response is divided by the distance to another a little behind it

The worst of the runs that give a value comes from many starts of SLSQP. The search was changed after traces
of such problems with numbers below 30; from 30 on nobody had looked at any.

`python -m studies.border_kinds 0 7` prints a line per kind for problems 0 to 6 of each, one search each.
"""

import sys
from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from studies.asked_range import asked_range
from studies.failure_border import CLOSE, Bordered, as_dataset, constrained_worst, searched

__all__ = ["KINDS", "drawn_kind", "run"]

KINDS = ("one", "two", "own", "corner", "plane", "steep")
INPUTS = (2, 3, 4, 5, 6, 8, 10)
FAILING = (0.08, 0.3)  # share of the box that fails
BEHIND = 1.15  # the pole of a steep response lies so much farther than the border

Array = np.ndarray


def drawn_kind(kind: str, number: int) -> Bordered:
    """The problem of a kind and a number."""
    rng = np.random.default_rng([77, KINDS.index(kind), number])
    d = INPUTS[number % len(INPUTS)]
    slope = rng.uniform(0.2, 1.2, d) * rng.choice([-1.0, 1.0], d)
    bend = 2.0 * rng.uniform(-0.4, 0.4, d) * np.abs(slope)
    even, share = rng.random((4000, d)), float(rng.uniform(*FAILING))
    worst_end = (slope > 0).astype(float)
    order = np.argsort(-np.abs(slope))

    def response(u: Array) -> float:
        return float(2.0 + np.abs(slope).sum() + u @ slope + (u - 0.5) ** 2 @ bend)

    reached = _reached(kind, slope, worst_end, order, response, rng)
    limit = float(np.quantile([reached(u) for u in even], 1.0 - share))

    def margin(u: Array) -> float:
        return limit - reached(u)

    def steep(u: Array) -> float:
        return response(u) / max(BEHIND * limit - reached(u), 1e-3)

    grows = steep if kind == "steep" else response
    return Bordered(
        name=f"{kind} {d} #{number}", dimension=d, response=grows, margin=margin,
        worst=constrained_worst(grows, margin, np.vstack([even, np.round(even)])),
    )  # fmt: skip


def _reached(
    kind: str,
    slope: Array,
    worst_end: Array,
    order: Array,
    response: Callable[[Array], float],
    rng: np.random.Generator,
) -> Callable[[Array], float]:
    """What runs fail beyond a limit of, at a point (d,) of the unit cube."""
    d = len(slope)
    if kind == "own":
        return response
    if kind == "corner":
        metric = rng.uniform(0.5, 2.0, d)
        return lambda u: -float((u - worst_end) ** 2 @ metric)
    weights = np.zeros(d)
    if kind == "one":
        weights[order[0]] = 1.0
    elif kind == "two":
        weights[order[:2]] = rng.uniform(0.3, 1.3, 2)
    else:
        weights = rng.uniform(0.3, 1.7, d) * (1.0 if kind == "steep" else np.abs(slope))
    # from the end where the response is smallest, so that every input adds to what is reached
    return lambda u: float(np.abs(u - (1.0 - worst_end)) @ weights)


def run(numbers: Sequence[int], *, budget: int = 30, kinds: Sequence[str] = KINDS) -> xr.Dataset:
    """One search of each problem: the share of its runs that `failed`, how far it stays `short` of the worst,
    relative to it, whether the result `says` that it borders on failures, and whether its gap `covers`.
    """
    made = np.array([[searched(drawn_kind(kind, n), n, budget) for n in numbers] for kind in kinds])
    return as_dataset(made, {"kind": kinds, "number": numbers}, budget=budget)


def _line(name: str, part: xr.Dataset) -> str:
    return (
        f"{name:7s} failed {float(part['failed'].mean()):5.1%}   within 1 % "
        f"{float((part['short'] <= CLOSE).mean()):6.1%}   short {float(part['short'].median()):6.2%}   "
        f"says {float(part['says'].mean()):6.1%}   gap covers {float(part['covers'].mean()):6.1%}"
    )


if __name__ == "__main__":
    numbers = asked_range(sys.argv[1:])
    parts = []
    for kind in KINDS:
        parts.append(run(numbers, kinds=(kind,)))
        print(_line(kind, parts[-1]), flush=True)
    print(_line("all", xr.concat(parts, "kind")))
