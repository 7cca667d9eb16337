"""The lists of drivers of screenings called resolved: what is in them that hardly acts, and what is missing.

Functions of 6 to 15 inputs on the unit cube, published ones and drawn ones, whose true total indices come
from 2^13 Sobol' points (Jansen's estimator). A screening of 4 d + 6 runs is made on several designs and with
noise; counted over those called resolved:

    crumbs      lists that hold an input with a true total index below 1 %
    missing     lists that lack one above 5 %
    lacking     lists that lack one above 1 %
    agree       pairs of designs of the same function and noise, both resolved, with the same list

and over all screenings: those that lack an input above x ("missing above x") and those that list apart, as
below 1 %, an input that has more than 1.5 %.

`python -m studies.screening_lists 0 4` prints a line per function for seeds 0 to 3, `... 0 4 8` with 8 d + 6
runs.
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
from surrogates import KrigingScreener

__all__ = [
    "DRAWN",
    "FUNCTIONS",
    "Listed",
    "counts",
    "drawn_function",
    "jansen_indices",
    "main",
    "run",
    "total_indices",
]

Array = NDArray[np.float64]

CRUMB, STRONG = 0.01, 0.05  # of the variance
CLEAR = 0.015  # more than this is no crumb by any reading
DESIGNS = ("optimised_lhs", "lhs")
NOISES = (0.0, 0.05, 0.1)  # standard deviation of the noise over that of the response
DRAWN = tuple(f"drawn {k}" for k in range(12))


@dataclass(frozen=True, slots=True)
class Listed:
    """A function (n, d) -> (n,) of d inputs on the unit cube."""

    d: int
    evaluate: Callable[[Array], Array]


def _scaled(bounds: Sequence[tuple[float, float]], x: Array) -> Array:
    """Columns of x (n, d) in [0, 1] in their own units, (d, n)."""
    low, high = np.array(bounds).T
    return np.asarray((low + (high - low) * x[:, : len(low)]).T)


def _wing(x: Array) -> Array:
    """Forrester, Sobester and Keane (2008)."""
    bounds = [(150, 200), (220, 300), (6, 10), (-10, 10), (16, 45), (0.5, 1), (0.08, 0.18), (2.5, 6),
              (1700, 2500), (0.025, 0.08)]  # fmt: skip
    sw, wfw, a, sweep, q, taper, tc, nz, wdg, wp = _scaled(bounds, x)
    c = np.cos(np.deg2rad(sweep))
    size = 0.036 * sw**0.758 * wfw**0.0035 * (a / c**2) ** 0.6 * q**0.006 * taper**0.04
    return np.asarray(size * (100 * tc / c) ** -0.3 * (nz * wdg) ** 0.49 + sw * wp)


def _flood(x: Array) -> Array:
    """De Rocquigny (2006): height above the dyke, all inputs uniform."""
    bounds = [(500, 3000), (15, 50), (49, 51), (54, 56), (7, 9), (55, 56), (4990, 5010), (295, 305)]
    q, ks, zv, zm, hd, cb, length, b = _scaled(bounds, x)
    h = (q / (b * ks * np.sqrt((zm - zv) / length))) ** 0.6
    return np.asarray(zv + h - hd - cb)


def _robot(x: Array) -> Array:
    """Reach of an arm of four links, An and Owen (2001), its angles within a quarter turn."""
    angles, links = 0.5 * np.pi * x[:, :4].cumsum(axis=1), x[:, 4:8]
    return np.asarray(np.hypot((links * np.cos(angles)).sum(axis=1), (links * np.sin(angles)).sum(axis=1)))


def _cantilever(x: Array) -> Array:
    """Tip deflection of a beam under two loads, with inputs that do not act."""
    bounds = [(400, 600), (800, 1200), (2.4e7, 3.4e7), (2.2, 2.8), (3.4, 4.4), (95, 105)]
    px, py, e, w, t, length = _scaled(bounds, x)
    return np.asarray(4 * length**3 / (e * w * t) * np.hypot(py / t**2, px / w**2))


def _environment(x: Array) -> Array:
    """Curved response with one ratio, Dette and Pepelyshev (2010), eight inputs."""
    first = 4 * (x[:, 0] - 2 + 8 * x[:, 1] - 8 * x[:, 1] ** 2) ** 2 + (3 - 4 * x[:, 1]) ** 2
    third = 16 * np.sqrt(x[:, 2] + 1) * (2 * x[:, 2] - 1) ** 2
    rest = sum(j * np.log1p(x[:, 2 : j + 1].sum(axis=1)) for j in range(3, 8))
    return np.asarray(first + third + rest)


def _loeppky(x: Array) -> Array:
    """Loeppky, Sacks and Welch (2009)'s ten inputs, of which three hardly act."""
    z = x[:, :7]
    return np.asarray(
        6 * z[:, 0] + 4 * z[:, 1] + 5.5 * z[:, 2] + 3 * z[:, 0] * z[:, 1] + 2.2 * z[:, 0] * z[:, 2]
        + 1.4 * z[:, 1] * z[:, 2] + z[:, 3] + 0.5 * z[:, 4] + 0.2 * z[:, 5] + 0.1 * z[:, 6]
    )  # fmt: skip


def _circuit(x: Array) -> Array:
    """Mid-point voltage of a push-pull circuit, Ben-Ari and Steinberg (2007), with four inert inputs."""
    bounds = [(50, 150), (25, 70), (0.5, 3), (1.2, 2.5), (0.25, 1.2), (50, 300)]
    rb1, rb2, rf, rc1, rc2, beta = _scaled(bounds, x)
    vb1, gain = 12 * rb2 / (rb1 + rb2), beta * (rc2 + 9)
    return np.asarray(
        (vb1 + 0.74) * gain / (gain + rf) + 11.35 * rf / (gain + rf) + 0.74 * rf * gain / ((gain + rf) * rc1)
    )


def _pulse(x: Array) -> Array:
    """A saturating sum of waves and a product, twelve inputs."""
    inner = 2 * x[:, 0] + np.sin(4 * x[:, 3]) + 3 * (x[:, 5] - 0.5) * (x[:, 8] - 0.4) + 0.3 * x[:, 10]
    return np.asarray(np.tanh(inner - 1.2) + 0.15 * x[:, 1] ** 2)


def drawn_function(seed: int) -> Listed:
    """A function of 7 to 15 inputs: sizes of its terms over a decade and a half, some inputs inert."""
    rng = np.random.default_rng([20, seed])
    d = int(rng.integers(7, 16))
    acting = rng.permutation(d)[: int(rng.integers(4, d))]
    shapes: tuple[Callable[[Array], Array], ...] = (
        lambda z: z, lambda z: (z - 0.4) ** 2, lambda z: np.sin(5 * z), lambda z: np.exp(2 * z),
        lambda z: np.abs(z - 0.5), lambda z: 1 / (0.3 + z),
    )  # fmt: skip
    grid = np.linspace(0.0, 1.0, 201)
    terms = []
    for k in acting:
        shape = shapes[int(rng.integers(len(shapes)))]
        size = 10 ** rng.uniform(-1.5, 0.0) / shape(grid).std()
        terms.append((int(k), shape, size * rng.choice([-1.0, 1.0]), shape(grid).mean()))
    pairs = [
        (int(i), int(j), 10 ** rng.uniform(-1.0, 0.3) / (1 / 12))
        for i, j in (rng.choice(acting, 2, replace=False) for _ in range(int(rng.integers(0, 4))))
    ]

    def evaluate(x: Array) -> Array:
        y = sum(size * (shape(x[:, k]) - mean) for k, shape, size, mean in terms)
        return np.asarray(y + sum(a * (x[:, i] - 0.5) * (x[:, j] - 0.5) / 4 for i, j, a in pairs))

    return Listed(d, evaluate)


FUNCTIONS: dict[str, Listed] = {
    "wing": Listed(10, _wing), "flood": Listed(8, _flood), "robot": Listed(8, _robot),
    "cantilever": Listed(9, _cantilever), "environment": Listed(8, _environment),
    "loeppky": Listed(10, _loeppky), "circuit": Listed(10, _circuit), "pulse": Listed(12, _pulse),
} | {name: drawn_function(k) for k, name in enumerate(DRAWN)}  # fmt: skip


@cache
def _named(name: str) -> Listed:
    """One of FUNCTIONS, or "drawn k" for any k."""
    return FUNCTIONS[name] if name in FUNCTIONS else drawn_function(int(name.removeprefix("drawn ")))


@cache
def total_indices(name: str) -> Array:
    """True total indices (d,) of one of FUNCTIONS, or of "drawn k"."""
    return jansen_indices(_named(name))


def jansen_indices(f: Listed) -> Array:
    """True total indices (d,), from 2^13 Sobol' points.

    Jansen: mean (f(a) - f(a with one input of b))^2/2 over Var f.
    """
    points = doe.sobol(2**13, 2 * f.d, rng=np.random.default_rng(0))
    a, b = points[:, : f.d], points[:, f.d :]
    at = f.evaluate(a)
    found = []
    for k in range(f.d):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        found.append(0.5 * float(((at - f.evaluate(mixed)) ** 2).mean()))
    return np.array(found) / float(at.var())


def _points(kind: str, n: int, d: int, rng: np.random.Generator) -> Array:
    return doe.lhs(n, d, rng=rng) if kind == "lhs" else doe.optimised_lhs(n, d, swaps=20_000, rng=rng)


def run(
    seeds: Sequence[int] = (0,),
    *,
    names: Sequence[str] = tuple(FUNCTIONS),
    designs: Sequence[str] = DESIGNS,
    noises: Sequence[float] = NOISES,
    runs_per_input: int = 4,
) -> xr.Dataset:
    """Every function on every design, noise and seed: state, x, and sets of inputs as rows of booleans.

    `crumbs`, `missing`, `lacking`, `beyond` (above x and not listed) and `apart` are booleans of each
    screening; `listed` is the list as text; `state` and `x` are the verdict's.
    """
    shape = (len(names), len(seeds), len(designs), len(noises))
    found = {key: np.zeros(shape, dtype=bool) for key in ("crumbs", "missing", "lacking", "beyond", "apart")}
    state, listed = np.empty(shape, dtype=object), np.empty(shape, dtype=object)
    x = np.empty(shape)
    for at in np.ndindex(shape):
        name, seed, kind, noise = names[at[0]], seeds[at[1]], designs[at[2]], noises[at[3]]
        f, total = _named(name), total_indices(name)
        rng = np.random.default_rng([seed, DESIGNS.index(kind), sum(map(ord, name)), round(100 * noise)])
        n = runs_per_input * f.d + 6
        points = _points(kind, n, f.d, rng)
        y = f.evaluate(points)
        screener = KrigingScreener().fit(points, y + noise * y.std() * rng.standard_normal(n))
        facts, inside = screener.diagnosis_, screener.get_support()
        state[at], x[at] = facts.state, facts.hidden_share
        listed[at] = " ".join(str(k) for k in np.flatnonzero(inside))
        found["crumbs"][at] = (inside & (total < CRUMB)).any()
        found["missing"][at] = (~inside & (total > STRONG)).any()
        found["lacking"][at] = (~inside & (total > CRUMB)).any()
        found["beyond"][at] = (~inside & (total > facts.hidden_share)).any()
        found["apart"][at] = (total[screener.minor_] > CLEAR).any()
    axes = ("function", "seed", "design", "noise")
    variables = found | {"state": state.astype(str), "x": x, "listed": listed.astype(str)}
    return xr.Dataset(
        {key: (axes, value) for key, value in variables.items()},
        coords={"function": list(names), "seed": list(seeds), "design": list(designs), "noise": list(noises)},
        attrs={"runs_per_input": runs_per_input},
    )


def counts(ds: xr.Dataset) -> dict[str, int]:
    """What the module's docstring counts; pairs are the first two designs of `ds`."""
    resolved = ds["state"] == "resolved"
    found = {"screenings": int(resolved.size), "resolved": int(resolved.sum())}
    found |= {key: int((ds[key] & resolved).sum()) for key in ("crumbs", "missing", "lacking")}
    found |= {key: int(ds[key].sum()) for key in ("beyond", "apart")}
    if ds.sizes["design"] > 1:
        both = resolved.isel(design=0) & resolved.isel(design=1)
        same = ds["listed"].isel(design=0) == ds["listed"].isel(design=1)
        found |= {"pairs": int(both.sum()), "agree": int((both & same).sum())}
    return found


def main(seeds: Sequence[int], runs_per_input: int) -> None:
    """Print a line per function, and the sum."""
    parts = []
    for name in FUNCTIONS:
        parts.append(run(seeds, names=(name,), runs_per_input=runs_per_input))
        print(f"{name:12s} {counts(parts[-1])}  median x {float(parts[-1]['x'].median()):.4f}", flush=True)
    print(counts(xr.concat(parts, "function")))


if __name__ == "__main__":
    main(asked_range(sys.argv[1:]), int((sys.argv[3:4] or ["4"])[0]))
