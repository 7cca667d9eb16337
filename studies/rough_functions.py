"""Functions on which claims about a worst case are easily wrong: drawn at random, of eleven families.

    jumps       quadratic, with steps where two to four inputs stand beyond a threshold together
    stairs      a smooth hill seen in 5 to 12 steps: plateaus with edges
    shelf       rises up to a curved limit, beyond which a part of it is left
    breaking    the same, but beyond the limit there is no value
    needle      a broad hill and a narrow one that holds a stated share of the box, 1e-4 to 1e-2
    levels      unordered and ordered levels, each with steps of its own in the other inputs
    ridge       a narrow bent ridge
    tuned       a resonance where a frequency, smooth in all inputs, meets that of the excitation
    ripples     a slope with waves in oblique directions
    smooth      quadratic with interactions
    switches    multilinear: one of many corners

Inputs, from 2 to 14, stand in [0, 1]. A family draws another function from every generator; none has a known
largest value, since the true runs of an attacker are what a claim is held against.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench import Parameter, Space

__all__ = ["FAMILIES", "Drawn", "drawn"]

Array = np.ndarray
LABELS = ("a", "b", "c", "d", "e")


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A function of named parameters over its space, to be made large."""

    name: str
    function: Callable[..., float]
    space: Space


def _over_cube(d: int, value: Callable[[Array], float]) -> tuple[Callable[..., float], Space]:
    def function(**x: float) -> float:
        return float(value(np.array(list(x.values()), dtype=float)))

    return function, Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(d)])


def _hill(d: int, rng: np.random.Generator) -> Callable[[Array], float]:
    """A quadratic with slopes and interactions of both signs, about one in size."""
    slopes, centre = rng.normal(size=d), rng.random(d)
    bends = -np.abs(rng.normal(size=d))
    pairs = np.triu(rng.normal(size=(d, d)), 1) / np.sqrt(d)

    def value(u: Array) -> float:
        s = u - centre
        return float(slopes @ s + bends @ s**2 + s @ pairs @ s)

    return value


def _rise(d: int, rng: np.random.Generator) -> Callable[[Array], float]:
    """Positive and rising in every input of its own orientation, more than linearly in some."""
    slopes, powers, ups = rng.uniform(0.2, 1.0, d), rng.choice([1.0, 1.5, 2.0], d), rng.random(d) < 0.5
    return lambda u: float(slopes @ np.where(ups, u, 1 - u) ** powers) + 0.2


def jumps(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Steps up in boxes of two to four inputs."""
    d = int(rng.integers(3, 13))
    base = _hill(d, rng)
    boxes = []
    for _ in range(3):
        inputs = rng.choice(d, min(int(rng.integers(2, 5)), d), replace=False)
        share = rng.uniform(0.005, 0.1) ** (1 / len(inputs))  # of the range of each, so of the box together
        boxes.append((inputs, rng.random(len(inputs)) < 0.5, share, rng.uniform(0.3, 2.0)))

    def value(u: Array) -> float:
        return base(u) + sum(
            height * bool(np.all(np.where(ups, 1 - u[inputs], u[inputs]) < share))
            for inputs, ups, share, height in boxes
        )

    return _over_cube(d, value)


def stairs(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """A hill in steps, with a hundredth of its slope left on the plateaus."""
    d = int(rng.integers(2, 9))
    base, step = _hill(d, rng), float(rng.uniform(0.2, 0.5))

    def value(u: Array) -> float:
        height = base(u)
        return step * np.floor(height / step) + 0.01 * height

    return _over_cube(d, value)


def _limit(d: int, rng: np.random.Generator) -> Callable[[Array], float]:
    """A load that rises in the orientation of nothing in particular; its limit is zero."""
    loads, powers = rng.uniform(0.1, 1.0, d), rng.choice([1.0, 2.0], d)
    ups = rng.random(d) < 0.7
    level = rng.uniform(0.5, 0.7) * loads.sum()
    return lambda u: float(loads @ np.where(ups, u, 1 - u) ** powers - level)


def shelf(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Rises up to a limit and falls beyond it."""
    d = int(rng.integers(2, 13))
    rise, load, left = _rise(d, rng), _limit(d, rng), rng.uniform(0.2, 0.7)
    return _over_cube(d, lambda u: rise(u) * (1.0 if load(u) <= 0 else left))


def breaking(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Rises up to a limit and has no value beyond it."""
    d = int(rng.integers(2, 13))
    rise, load = _rise(d, rng), _limit(d, rng)

    def value(u: Array) -> float:
        if load(u) > 0:
            raise ArithmeticError("no convergence")
        return rise(u)

    return _over_cube(d, value)


def needle(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """A narrow hill beside a broad one: at half its height it holds 1e-4 to 1e-2 of the box."""
    d = int(rng.integers(2, 6))
    share = 10 ** rng.uniform(-4, -2)
    width = share ** (1 / d) / 2  # a cube of the stated share, nearly all of it inside the box
    broad, narrow = rng.random(d), rng.uniform(width, 1 - width, d)
    height = rng.uniform(1.1, 2.0)

    def value(u: Array) -> float:
        return float(
            np.exp(-(((u - broad) / 0.6) ** 2).sum())
            + height * 0.5 ** (np.abs(u - narrow) / width).max() ** 2
        )

    return _over_cube(d, value)


def levels(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Two unordered inputs, one ordered; steps of the others depend on them."""
    n, m, d = int(rng.integers(2, 6)), int(rng.integers(2, 4)), int(rng.integers(3, 8))
    parts = {
        (i, j): (_hill(d, rng), rng.integers(0, d), rng.random(), rng.normal())
        for i in range(n)
        for j in range(m)
    }
    gears = rng.normal(size=4)

    def function(*, kind: str, way: str, gear: int, **x: float) -> float:
        u = np.array(list(x.values()), dtype=float)
        hill, column, threshold, height = parts[LABELS.index(kind), LABELS.index(way)]
        return float(hill(u) + height * (u[column] > threshold) + gears[int(gear)] * u[0])

    space = Space(
        [
            Parameter("kind", kind="categorical", levels=LABELS[:n]),
            Parameter("way", kind="categorical", levels=LABELS[:m]),
            Parameter("gear", kind="integer", lower=0, upper=3),
            *(Parameter(f"x{i}", lower=0, upper=1) for i in range(d)),
        ]
    )
    return function, space


def ridge(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """A ridge of 3 to 10 % width that bends through the box."""
    d = int(rng.integers(2, 8))
    across, bend = rng.normal(size=d), rng.normal(size=d)
    across /= np.linalg.norm(across)
    along, width = rng.normal(size=d) / np.sqrt(d), rng.uniform(0.03, 0.1)
    centre = rng.uniform(0.3, 0.7, d)

    def value(u: Array) -> float:
        s = u - centre
        off = across @ s - 0.3 * (bend @ s) ** 2
        return float((1.5 + along @ s) / (1 + (off / width) ** 2))

    return _over_cube(d, value)


def tuned(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Stiffnesses and masses tune a frequency; an amplitude depends on other inputs."""
    k, m, a = int(rng.integers(1, 4)), int(rng.integers(1, 3)), int(rng.integers(1, 5))
    d, ratio, damping = k + m + a, rng.uniform(0.9, 1.3), rng.uniform(0.02, 0.08)
    stiff, heavy, push = rng.uniform(0.5, 1.0, k), rng.uniform(0.5, 1.0, m), rng.uniform(-0.5, 0.5, a)

    def value(u: Array) -> float:
        square = (0.6 + stiff @ u[:k] / k) / (0.6 + heavy @ u[k : k + m] / m) / ratio
        amplitude = 1 + push @ u[k + m :]
        return float(amplitude / np.sqrt((1 - square) ** 2 + (2 * damping) ** 2 * square))

    return _over_cube(d, value)


def ripples(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """A slope with six waves."""
    d = int(rng.integers(2, 15))
    slopes, waves = rng.normal(size=d), rng.normal(size=(6, d)) * 10 / np.sqrt(d)
    phases, heights = rng.uniform(0, 2 * np.pi, 6), rng.uniform(0.1, 0.4, 6)
    return _over_cube(d, lambda u: float(slopes @ u + heights @ np.cos(waves @ u + phases)))


def smooth(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Nothing rough at all."""
    d = int(rng.integers(2, 15))
    return _over_cube(d, _hill(d, rng))


def switches(rng: np.random.Generator) -> tuple[Callable[..., float], Space]:
    """Multilinear, with interactions of both signs."""
    d = int(rng.integers(4, 13))
    slopes, pairs = 1.5 * rng.normal(size=d), np.triu(rng.normal(size=(d, d)), 1) / np.sqrt(d)

    def value(u: Array) -> float:
        s = 2 * u - 1
        return float(s @ slopes + s @ pairs @ s)

    return _over_cube(d, value)


FAMILIES: dict[str, Callable[[np.random.Generator], Any]] = {
    f.__name__: f
    for f in (
        jumps,
        stairs,
        shelf,
        breaking,
        needle,
        levels,
        ridge,
        tuned,
        ripples,
        smooth,
        switches,
    )
}


def drawn(seed: int, *, count: int) -> list[Drawn]:
    """`count` functions, the families by turns."""
    made = []
    for k in range(count):
        name = list(FAMILIES)[k % len(FAMILIES)]
        function, space = FAMILIES[name](np.random.default_rng([seed, k]))
        made.append(Drawn(name=f"{name} {k // len(FAMILIES)}", function=function, space=space))
    return made
