"""Does the stated gap hold where a response has what no run has met? Drawn functions with known extremes.

Twelve makes have a feature that few runs meet, on a base of one-input curves: jumps across the threshold of
one input (`step`, `late step`) or of two together (`cliff`), a resonance or an oblique ridge 2 to 8 % wide
(`resonance`, `ridge`), a hill, a step or another slope that one word of a categorical input has (`word hill`,
`word step`, `word slope`), a step that only two words together have (`word pair`), plateaus (`stairs`,
`capped`), and a slope that begins late (`kink`). Extremes are sought from random points and all corners of
every combination of words, far more than a search can afford.
Six makes are smooth, as controls: `additive`, `rotated`, `waves`, `product`, `peaks`, `words`.

`python -m studies.unforeseen_features 2 9100 3` prints a line per search of two functions of each make, drawn
from seed 9100, with three seeds each; then for both kinds how many of the searches settled, how many stated
gaps cover, their median width and the runs used.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product as combinations_of

import numpy as np
import xarray as xr
from scipy.optimize import minimize

from workbench import Parameter, Space
from workbench.search.record import Status
from workbench.search.worst_case import worst_case

__all__ = ["FEATURES", "MAKES", "SMOOTH", "Drawn", "Search", "drawn", "run", "searches"]

Array = np.ndarray
Value = Callable[[Array, tuple[int, ...]], Array]  # of points (n, d) and one word per categorical input
LABELS = ("a", "b", "c", "d", "e")
NEAR = 1e-9  # behind a threshold
LOOKED = 2000  # random points of each combination of words that the known extreme is polished from
POLISHED = 12
NARROW = 0.005  # of the range: a gap that says that the search is over
COVERED = 1e-4  # of the range: what a known extreme itself may be off


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A function of named parameters over its space, to be made large, with both extremes."""

    name: str
    function: Callable[..., float]
    space: Space
    high: float
    low: float


def _curves(d: int, rng: np.random.Generator) -> Callable[[Array], Array]:
    """A sum of slopes of each input, with bends in every second draw; three deviations are about one."""
    slopes, centres = rng.normal(size=d), rng.random(d)
    bends = rng.normal(size=d) * (rng.random() < 0.5)
    size = 3 * float(np.std(_sums(rng.random((256, d)), slopes, bends, centres)))
    return lambda u: _sums(u, slopes, bends, centres) / size


def _sums(u: Array, slopes: Array, bends: Array, centres: Array) -> Array:
    return u @ slopes + ((u - centres) ** 2) @ bends


def _height(rng: np.random.Generator) -> float:
    """Of a feature, beside a base of about one."""
    return float(rng.uniform(0.3, 1.5))


def _hill(u: Array, centre: Array, width: float) -> Array:
    return np.exp(-(((u - centre) / width) ** 2).sum(axis=1))


def _size(rng: np.random.Generator, most: int = 9) -> int:
    return int(rng.integers(2, most))


def _step(
    rng: np.random.Generator, low: float = 0.3, high: float = 0.9
) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    base, j, at, up = _curves(d, rng), 0, rng.uniform(low, high), _height(rng)
    return d, (), lambda u, _: base(u) + up * (u[:, j] > at)


def _late_step(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    return _step(rng, 0.9, 0.97)


def _cliff(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    base, at, up = _curves(d, rng), rng.uniform(0.6, 0.85, 2), _height(rng)
    return d, (), lambda u, _: base(u) + up * (u[:, :2] > at).all(axis=1)


def _resonance(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    base, at, width = _curves(d, rng), rng.uniform(0.1, 0.9), rng.uniform(0.02, 0.08)
    up = _height(rng)
    return d, (), lambda u, _: base(u) + up / (1 + ((u[:, 0] - at) / width) ** 2)


def _ridge(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    base, turn, width = _curves(d, rng), rng.uniform(0.3, 1.2), rng.uniform(0.02, 0.08)
    along, at, up = np.array([np.cos(turn), np.sin(turn)]), rng.uniform(0.4, 0.9), _height(rng)
    return d, (), lambda u, _: base(u) + up * np.exp(-(((u[:, :2] @ along - at) / width) ** 2))


def _word_hill(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d, words = _size(rng, 7), int(rng.integers(2, 6))
    base, shifts = _curves(d, rng), 0.1 * rng.normal(size=words)
    one, centre, up = int(rng.integers(words)), rng.random(d), _height(rng)
    width = rng.uniform(0.15, 0.3) * np.sqrt(d)
    return d, (words,), lambda u, w: base(u) + shifts[w[0]] + up * (w[0] == one) * _hill(u, centre, width)


def _word_step(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d, words = _size(rng, 7), int(rng.integers(2, 6))
    base, shifts = _curves(d, rng), 0.1 * rng.normal(size=words)
    one, at, up = int(rng.integers(words)), rng.uniform(0.5, 0.95), _height(rng)
    return d, (words,), lambda u, w: base(u) + shifts[w[0]] + up * (w[0] == one) * (u[:, 0] > at)


def _word_slope(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d, words = _size(rng, 7), int(rng.integers(2, 6))
    base, shifts = _curves(d, rng), 0.2 * rng.normal(size=words)
    one, at = int(rng.integers(words)), rng.uniform(0.5, 0.8)
    up = _height(rng) / (1 - at)
    return (
        d,
        (words,),
        lambda u, w: base(u) + shifts[w[0]] + up * (w[0] == one) * np.maximum(u[:, 0] - at, 0) * u[:, 1],
    )


def _word_pair(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d, words = _size(rng, 6), (int(rng.integers(2, 5)), int(rng.integers(2, 4)))
    base, first, second = _curves(d, rng), 0.1 * rng.normal(size=words[0]), 0.1 * rng.normal(size=words[1])
    one, at, up = tuple(int(rng.integers(n)) for n in words), rng.uniform(0.3, 0.8), _height(rng)
    return d, words, lambda u, w: base(u) + first[w[0]] + second[w[1]] + up * (w == one) * (u[:, 0] > at)


def _stairs(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d, step = _size(rng, 7), rng.uniform(0.1, 0.3)
    base = _curves(d, rng)
    return d, (), lambda u, _: step * np.floor(base(u) / step) + 0.01 * base(u)


def _capped(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    """A plateau over most of the box, and a late slope in another input."""
    d = _size(rng)
    base, at = _curves(d, rng), rng.uniform(0.75, 0.9)
    up = _height(rng) / (1 - at)
    return d, (), lambda u, _: np.minimum(base(u), 0.1) + up * np.maximum(u[:, 0] - at, 0) * u[:, 1]


def _kink(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    base, at = _curves(d, rng), rng.uniform(0.7, 0.92)
    up = _height(rng) / (1 - at)
    return d, (), lambda u, _: base(u) + up * np.maximum(u[:, 0] - at, 0)


def _additive(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    base = _curves(d, rng)
    return d, (), lambda u, _: base(u)


def _rotated(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    turned = np.linalg.qr(rng.normal(size=(d, d)))[0] * rng.uniform(0.5, 2.0, d)
    centre = rng.uniform(0.2, 0.8, d)
    return d, (), lambda u, _: -(((u - centre) @ turned) ** 2).sum(axis=1)


def _waves(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng, 5)
    slopes, waves, phases = rng.normal(size=d), 5 * rng.normal(size=(3, d)) / np.sqrt(d), rng.uniform(0, 6, 3)
    return d, (), lambda u, _: u @ slopes + 0.5 * np.cos(u @ waves.T + phases).sum(axis=1)


def _product(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng)
    powers = rng.uniform(-1.5, 1.5, d)
    return d, (), lambda u, _: np.exp(np.log(0.5 + u) @ powers)


def _peaks(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d = _size(rng, 5)
    centres, heights = rng.random((4, d)), rng.uniform(0.5, 1.0, 4)
    width = rng.uniform(0.25, 0.4) * np.sqrt(d)
    return d, (), lambda u, _: sum(h * _hill(u, c, width) for h, c in zip(heights, centres, strict=True))


def _words(rng: np.random.Generator) -> tuple[int, tuple[int, ...], Value]:
    d, words = _size(rng, 6), (int(rng.integers(2, 5)), int(rng.integers(2, 4)))
    base, tilts = _curves(d, rng), 0.5 * rng.normal(size=(words[0], d))
    shifts = rng.normal(size=words[1])
    return d, words, lambda u, w: base(u) + u @ tilts[w[0]] + shifts[w[1]]


Make = Callable[[np.random.Generator], tuple[int, tuple[int, ...], Value]]
FEATURES: dict[str, Make] = {
    "step": _step,
    "late step": _late_step,
    "cliff": _cliff,
    "resonance": _resonance,
    "ridge": _ridge,
    "word hill": _word_hill,
    "word step": _word_step,
    "word slope": _word_slope,
    "word pair": _word_pair,
    "stairs": _stairs,
    "capped": _capped,
    "kink": _kink,
}
SMOOTH: dict[str, Make] = {
    "additive": _additive,
    "rotated": _rotated,
    "waves": _waves,
    "product": _product,
    "peaks": _peaks,
    "words": _words,
}
MAKES = (*FEATURES, *SMOOTH)


def _extreme(value: Callable[[Array], Array], d: int, rng: np.random.Generator) -> float:
    """The largest value over the cube: random points and corners, polished by steps along random directions
    that grow after a gain and shrink without one, and by L-BFGS-B.
    """
    corners = np.array(list(combinations_of((0.0, 1.0), repeat=d)))
    dense = rng.random((LOOKED, d))
    pool = np.vstack([corners, dense, np.where(rng.random(dense.shape) < 0.7, np.round(dense), dense)])
    found = value(pool)
    top = np.argsort(-found)[:POLISHED]
    points, best = pool[top], found[top]
    lengths = np.full(len(top), 0.1)
    for _ in range(800):
        mask = rng.random(points.shape) < max(0.5, 1 / d)
        tried = np.clip(points + lengths[:, None] * rng.standard_normal(points.shape) * mask, 0, 1)
        reached = value(tried)
        gained = reached > best
        points[gained], best[gained] = tried[gained], reached[gained]
        lengths = np.clip(np.where(gained, 1.5 * lengths, 0.95 * lengths), 1e-7, 0.3)

    def down(u: Array) -> float:
        return -float(value(u[None])[0])

    for point in points[np.argsort(-best)[:3]]:
        end = minimize(down, point, bounds=[(0, 1)] * d)
        best = np.append(best, -end.fun)
    return float(best.max())


def _drawn(name: str, make: Make, seed: int, k: int) -> Drawn:
    rng = np.random.default_rng([seed, k, *name.encode()])
    d, words, value = make(rng)
    order, ups = rng.permutation(d), rng.random(d) < 0.5  # so that no input and no end is a favourite

    def turned(u: Array, w: tuple[int, ...], sign: float = 1.0) -> Array:
        return sign * value(np.where(ups, u, 1 - u)[:, order], w)

    def function(**x: float | str) -> float:
        given = list(x.values())
        word = tuple(LABELS.index(str(label)) for label in given[d:])
        return float(turned(np.array([given[:d]], dtype=float), word)[0])

    each = list(combinations_of(*(range(n) for n in words)))
    high = max(_extreme(partial(turned, w=w), d, rng) for w in each)
    low = -max(_extreme(partial(turned, w=w, sign=-1.0), d, rng) for w in each)
    numbers = [Parameter(f"x{i}", lower=0, upper=1) for i in range(d)]
    labels = [Parameter(f"w{i}", kind="categorical", levels=LABELS[:n]) for i, n in enumerate(words)]
    return Drawn(name=f"{name} {k}", function=function, space=Space([*numbers, *labels]), high=high, low=low)


def drawn(seed: int, *, count: int, makes: Sequence[str] = MAKES) -> list[Drawn]:
    """`count` functions of each make."""
    every = {**FEATURES, **SMOOTH}
    return [_drawn(name, every[name], seed, k) for k in range(count) for name in makes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """One search; gaps are shares of the function's range, `runs_to` those until within 1 % of it."""

    case: str
    seed: int
    status: Status
    true_gap: float
    stated_gap: float
    evaluations: int
    runs_to: float

    @property
    def is_covered(self) -> bool:
        """Whether the known extreme lies within the stated gap."""
        return self.true_gap <= self.stated_gap + COVERED

    @property
    def is_smooth(self) -> bool:
        """Whether the function is a control."""
        return self.case.rsplit(" ", 1)[0] in SMOOTH

    @property
    def is_narrow(self) -> bool:
        """Whether next to nothing is said to be left."""
        return self.stated_gap < NARROW


def searches(
    functions: Sequence[Drawn], seeds: Sequence[int] = (0,), *, budget: int = 60
) -> Iterator[Search]:
    """Search the largest value of every function with every seed, without an attack."""
    for f in functions:
        for seed in seeds:
            found = worst_case(f.function, f.space, budget=budget, seed=seed)
            size = f.high - f.low
            near = np.flatnonzero(found.history >= f.high - 0.01 * size)
            yield Search(
                case=f.name,
                seed=seed,
                status=found.status,
                true_gap=max(f.high - found.value, 0.0) / size,
                stated_gap=found.gap.width / size,
                evaluations=found.evaluations,
                runs_to=float(near[0]) + 1 if len(near) else np.inf,
            )


def run(
    seed: int = 0, *, count: int = 1, seeds: Sequence[int] = (0,), makes: Sequence[str] = MAKES
) -> xr.Dataset:
    """All searches of `count` functions of each make as a dataset; `coverage` of them is its attribute."""
    made = list(searches(drawn(seed, count=count, makes=makes), seeds))
    columns = ("true_gap", "stated_gap", "evaluations", "runs_to")
    return xr.Dataset(
        {name: ("search", np.array([getattr(s, name) for s in made])) for name in columns},
        coords={"case": ("search", [s.case for s in made]), "seed": ("search", [s.seed for s in made])},
        attrs={"coverage": float(np.mean([s.is_covered for s in made]))},
    )


def _totals(word: str, made: Sequence[Search]) -> str:
    """One line of a table."""
    if not made:
        return f"{word}: none"
    width, spent, to = (
        float(np.median([getattr(s, name) for s in made]))
        for name in ("stated_gap", "evaluations", "runs_to")
    )
    held = sum(s.is_covered for s in made)
    return f"{word}: {held} of {len(made)} covered, median gap {width:.2%}, runs {spent:g}, to 1 % {to:g}"


def main(words: Sequence[str]) -> None:
    """Print a line per search, then the totals."""
    count, seed, repeats = (int(word) for word in (*words, *("1", "0", "1")[len(words) :]))
    made = []
    for s in searches(drawn(seed, count=count, makes=MAKES), range(repeats)):
        made.append(s)
        word = "" if s.is_covered else "   not covered"
        gaps = f"true {s.true_gap:.1e}   stated {s.stated_gap:.1e}"
        print(f"{s.case:14s} {s.seed}  {s.status.name:9s} {s.evaluations:3d} runs   {gaps}{word}", flush=True)
    for kind, chosen in (
        ("features", [s for s in made if not s.is_smooth]),
        ("smooth", [s for s in made if s.is_smooth]),
    ):
        print(_totals(kind, chosen))
        print(_totals("  settled", [s for s in chosen if s.status is Status.CONVERGED]))
        print(_totals(f"  gap below {NARROW:.1%}", [s for s in chosen if s.is_narrow]))


if __name__ == "__main__":
    main(sys.argv[1:])
