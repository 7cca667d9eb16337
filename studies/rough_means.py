"""The worst mean of rough models with noise: does the gap that is stated hold, and the interval?

Functions on the unit cube of 2 to 6 inputs, drawn of eight kinds, with their range known:

    dead zone   max(0, g - c) of a curved g, zero over 50 to 95 % of the box
    plateau     min(g, c), flat over 10 to 40 % of the box
    kinks       a sum of hinges w max(0, n u - c) in oblique directions, of both signs
    tent        the lowest of several planes: a peak with edges inside
    two peaks   two hills far apart, broad or narrow, the second within 20 % of the first
    ridge       a narrow bent ridge with a slope along it
    smooth      quadratic with interactions
    hump        max(0, c - q) of a bowl q round an inner point, zero over 70 to 97 % of the box

By turns normal noise of 5, 10 and 20 % of the range, and 60 and 120 runs. Counted are

    bias       stated mean less the true mean at the reported point, over the noise
    held       share of the intervals that hold that true mean
    short      largest mean over the box less the mean at the reported point, over the range
    gap        stated gap over the range; infinite where no bound is stated
    covered    share of the stated bounds that the largest mean does not exceed

`python -m studies.rough_means 0 12` prints a line per kind for draws 0 to 11 of each: two of every noise and
budget.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from studies.asked_range import asked_range
from workbench import Parameter, Space
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.search.worst_case import worst_case

__all__ = ["KINDS", "NOISES", "RUNS", "Rough", "drawn", "run"]

Array = np.ndarray
Value = Callable[[Array], Array]  # of points (n, d), (n,)

NOISES, RUNS = (0.05, 0.1, 0.2), (60, 120)  # of the range; of a search
POINTS, CLIMBS = 40_000, 20  # from which the range of a function is found


@dataclass(frozen=True, slots=True, kw_only=True)
class Rough:
    """A function over the unit cube of d inputs with its smallest and largest value, the noise of a run as a
    share of their difference, and the runs of a search.
    """

    value: Value
    d: int
    low: float
    high: float
    noise: float
    budget: int

    @property
    def space(self) -> Space:
        """The inputs."""
        return Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(self.d)])

    def at(self, **x: float) -> float:
        """The mean of runs at one point."""
        return float(self.value(np.array([list(x.values())], dtype=float))[0])

    def noisy(self, rng: np.random.Generator) -> Callable[..., float]:
        """The model that a search sees."""
        deviation = self.noise * (self.high - self.low)
        return lambda **x: self.at(**x) + float(deviation * rng.standard_normal())


def _hill(d: int, rng: np.random.Generator) -> Value:
    """A quadratic with slopes, interactions of both signs and a peak that may stand inside."""
    slopes, centre = rng.normal(size=d), rng.random(d)
    bends = -np.abs(rng.normal(size=d))
    pairs = np.triu(rng.normal(size=(d, d)), 1) / np.sqrt(d)

    def value(u: Array) -> Array:
        s = u - centre
        return np.asarray(s @ slopes + s**2 @ bends + np.einsum("ij,jk,ik->i", s, pairs, s))

    return value


def _dead_zone(d: int, rng: np.random.Generator) -> Value:
    g, share = _hill(d, rng), rng.uniform(0.5, 0.95)
    level = float(np.quantile(g(rng.random((4000, d))), share))
    return lambda u: np.maximum(g(u) - level, 0.0)


def _plateau(d: int, rng: np.random.Generator) -> Value:
    g, share = _hill(d, rng), rng.uniform(0.6, 0.9)
    level = float(np.quantile(g(rng.random((4000, d))), share))
    return lambda u: np.minimum(g(u), level)


def _kinks(d: int, rng: np.random.Generator) -> Value:
    count = int(rng.integers(3, 7))
    normals = rng.normal(size=(count, d))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    through, weights = rng.uniform(0.2, 0.8, (count, d)), rng.normal(size=count)
    offsets = np.einsum("ij,ij->i", normals, through)
    return lambda u: np.maximum(u @ normals.T - offsets, 0.0) @ weights


def _tent(d: int, rng: np.random.Generator) -> Value:
    count = int(rng.integers(d + 1, 2 * d + 3))
    normals, through = rng.normal(size=(count, d)), rng.uniform(0.2, 0.8, d)
    offsets = normals @ through
    return lambda u: np.asarray((u @ normals.T - offsets).min(axis=1))


def _two_peaks(d: int, rng: np.random.Generator) -> Value:
    first = rng.random(d)
    others = rng.random((200, d))
    second = others[int(np.argmax(np.linalg.norm(others - first, axis=1) * rng.uniform(0.7, 1.0, 200)))]
    widths = rng.uniform(0.12, 0.4, 2) * np.sqrt(d / 2)
    height = rng.uniform(0.8, 1.0)

    def value(u: Array) -> Array:
        one, two = (
            np.exp(-0.5 * ((u - at) ** 2).sum(axis=1) / width**2)
            for at, width in zip((first, second), widths, strict=True)
        )
        return np.asarray(one + height * two)

    return value


def _ridge(d: int, rng: np.random.Generator) -> Value:
    normal, along = rng.normal(size=d), rng.normal(size=d)
    normal /= np.linalg.norm(normal)
    bend, through, width = rng.uniform(-0.5, 0.5), rng.uniform(0.25, 0.75, d), rng.uniform(0.1, 0.3)

    def value(u: Array) -> Array:
        off = (u - through) @ normal + bend * (u[:, 0] - through[0]) ** 2
        return np.asarray(1 / (1 + (off / width) ** 2) + 0.3 * (u - 0.5) @ along / np.sqrt(d))

    return value


def _hump(d: int, rng: np.random.Generator) -> Value:
    centre, stretch, share = rng.uniform(0.1, 0.9, d), rng.uniform(0.4, 1.6, d), rng.uniform(0.7, 0.97)

    def bowl(u: Array) -> Array:
        return np.asarray(((stretch * (u - centre)) ** 2).sum(axis=1))

    level = float(np.quantile(bowl(rng.random((4000, d))), 1 - share))
    return lambda u: np.maximum(level - bowl(u), 0.0)


KINDS: dict[str, Callable[[int, np.random.Generator], Value]] = {
    "dead zone": _dead_zone, "plateau": _plateau, "kinks": _kinks, "tent": _tent, "two peaks": _two_peaks,
    "ridge": _ridge, "smooth": _hill, "hump": _hump,
}  # fmt: skip


def drawn(kind: str, number: int) -> Rough:
    """The function of a kind with that number; numbers take turns over noises and budgets."""
    rng = np.random.default_rng([324, list(KINDS).index(kind), number])
    d = int(rng.integers(2, 7))
    value = KINDS[kind](d, rng)
    return Rough(
        value=value,
        d=d,
        low=-_largest(lambda u: -value(u), d, rng),
        high=_largest(value, d, rng),
        noise=NOISES[number % 3],
        budget=RUNS[number // 3 % 2],
    )


def _largest(value: Value, d: int, rng: np.random.Generator) -> float:
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * d), axis=-1).reshape(-1, d)
    points = np.vstack([rng.random((POINTS, d)), corners])
    top = points[np.argsort(value(points))[-CLIMBS:]]
    return float(maximise_score(value, top, [None] * d)[1].max())


def _searched(kind: str, number: int) -> tuple[float, ...]:
    f = drawn(kind, number)
    size = f.high - f.low
    rng = np.random.default_rng([325, list(KINDS).index(kind), number])
    found = worst_case(f.noisy(rng), f.space, budget=f.budget, seed=number, noise=True)
    true = f.at(**found.parameters)
    assert found.interval is not None
    return (
        (found.value - true) / (f.noise * size),
        float(found.interval[0] <= true <= found.interval[1]),
        (f.high - true) / size,
        found.gap.width / size,
        float(f.high <= found.gap.upper),
    )


def run(numbers: Sequence[int] = (0,), *, kinds: Sequence[str] = tuple(KINDS)) -> xr.Dataset:
    """Every kind with every number; variables over (kind, number) as above."""
    made = np.array([[_searched(kind, number) for number in numbers] for kind in kinds])
    names = ("bias", "held", "short", "gap", "covered")
    return xr.Dataset(
        {name: (("kind", "number"), made[:, :, k]) for k, name in enumerate(names)},
        coords={"kind": list(kinds), "number": list(numbers)},
    )


def _told(ds: xr.Dataset) -> str:
    stated = np.isfinite(ds["gap"])
    n, held = int(stated.sum()), int(ds["held"].sum())
    return (
        f"bias {float(ds['bias'].mean()):5.2f}   interval holds {held} of {ds['held'].size}   "
        f"gap covers {int(ds['covered'].where(stated).sum())} of {n} stated, median "
        f"{float(ds['gap'].median()):.1%}"
    )


if __name__ == "__main__":
    parts = []
    for kind in KINDS:
        parts.append(run(asked_range(sys.argv[1:]), kinds=(kind,)))
        print(f"{kind:10s} {_told(parts[-1])}", flush=True)
    print(f"{'all':10s} {_told(xr.concat(parts, 'kind'))}")
