"""How an adversary climbs: plain moves from case to case, none of which knows a surrogate.

A climb is a generator: it yields a `Step`, the next case it wants run, and is sent the signed value of that
case, minus infinity where the run failed or a constraint refused the case. Many climbs go on side by side,
so that an evaluator gets a batch; each sees its own answers alone, and so the numbers do not depend on how
many there are at once.

    change     one parameter moved to its other end or to another level, kept where it gains (ends first:
               worst cases of engineering responses stand in corners)
    pair       two parameters moved at once to other ends, where no single change gains: the two sides of a
               cliff may be two changes apart, with a small loss between
    cliff      bisection between a high case and a much lower, or failing, neighbour: the worst often stands
               at the very edge, on the bad side
    pattern    Hooke and Jeeves 1961: coordinate steps, halved when none gains, and the whole move repeated;
               before they are halved, steps along the way climbed so far and of two coordinates at once
    gradient   along the projected gradient, where the model gives one, with steps doubled and halved
    local      short coordinate steps from a case that was found to be bad already; once none gains, a step to
               the top of the parabolas through them, and shorter ones
    fine       the same from the worst case known, in steps that end at a hundredth of theirs or so
"""

from collections.abc import Callable, Generator, Sequence
from typing import NamedTuple

import numpy as np

from workbench.search.runs.unit_space import SearchSpace

__all__ = ["Climb", "Step", "bisection", "corner_climb", "interior_climb", "local_climb"]

FIRST_STEP, LAST_STEP = 0.25, 0.02  # of the side of the cube: a worst case is sought, not its last digit
FIRST_LOCAL, LAST_LOCAL, SHORTER = 1 / 16, 1 / 128, 4  # a search has been there: its top is near
FIRST_FINE, LAST_FINE = 1 / 32, 1 / 2048  # sharp tops and bent ridges ask for more than a climb's last step
OBLIQUE = 1  # steps of two coordinates per coordinate, where no single step gains
HALVINGS = 5  # of a cliff: 3 % of the distance
CLIFF = 0.3  # of the range of the values seen: a larger drop by a single change is a cliff
FIRST_STRIDE, LAST_STRIDE = 0.2, 0.01  # of a gradient step
NOTHING = -np.inf


class Step(NamedTuple):
    """A case (d,) that a climb wants run, and the kind of move that leads there."""

    kind: str
    point: np.ndarray


Climb = Generator[Step, float, None]
Slope = Callable[[np.ndarray], "np.ndarray | None"]
Range = Callable[[], float]


def corner_climb(
    where: SearchSpace,
    start: np.ndarray,
    value: float,
    *,
    slope: Slope,
    spread: Range,
    rng: np.random.Generator,
    holds_labels: bool = False,
    pairs: int = 0,
) -> Climb:
    """Single changes from `start` (d,) of signed `value`, pairs, then cliffs, then by pattern or gradient.

    holds_labels: unordered levels stay as they are until no single change nor pair gains. A climb that may
    change them leaves a combination whose values are low for one where they are higher, and never comes upon
    a cliff of the first.    pairs: tried at the top, at most.

    `slope` gives the gradient (d,) at a case that was run, or None; `spread` the range of the values so far.
    """
    every = list(range(where.dimension))
    free = [j for j in every if where.space.parameters[j].kind != "categorical"] if holds_labels else every
    top, best, drops = yield from _changes(where, start, value, free, rng=rng)
    while (pair := (yield from _pair(where, top, best, free, pairs, rng=rng))) is not None:
        top, best, drops = yield from _changes(where, *pair, free, rng=rng)
    if len(free) < len(every):
        top, best, more = yield from _changes(where, top, best, every, rng=rng)
        drops += more
    for other, low in sorted(drops, key=lambda drop: drop[1])[:2]:
        if best - low > CLIFF * spread():
            edge, high = yield from bisection(where, top, best, other, low)
            if high > best:
                top, best, _ = yield from _changes(where, edge, high, every, rng=rng)
    yield from _inside(where, top, best, slope=slope, rng=rng)


def interior_climb(
    where: SearchSpace,
    start: np.ndarray,
    value: float,
    *,
    slope: Slope,
    rng: np.random.Generator,
) -> Climb:
    """By pattern or gradient from `start` (d,) of signed `value`, then single changes of the top."""
    top, best = yield from _inside(where, start, value, slope=slope, rng=rng)
    yield from _changes(where, top, best, range(where.dimension), rng=rng)


def local_climb(
    where: SearchSpace,
    start: np.ndarray,
    value: float,
    *,
    slope: Slope,
    rng: np.random.Generator,
    is_fine: bool = False,
) -> Climb:
    """To the top next to `start` (d,) of signed `value`, a case that was found to be bad already.

        u_j* = u_j + h (f+ - f-) / (2 (2 f - f+ - f-)),    f+- = f(u +- h e_j), where neither gains

    A known case stands on the flank of its peak, where long steps leave the peak and a climb has spent its
    runs before its steps are short.
    """
    first, last = (FIRST_FINE, LAST_FINE) if is_fine else (FIRST_LOCAL, LAST_LOCAL)
    if slope(start) is not None:
        kind = "fine" if is_fine else "gradient"
        yield from _gradient(where, start, value, slope=slope, kind=kind, first=first, last=last)
        return
    kind = "fine" if is_fine else "local"
    numeric = [j for j in range(where.dimension) if where.space.parameters[j].is_numeric]
    top, best, step = start, value, first
    while step >= last:
        before = top
        peak = top.copy()
        for j in rng.permutation(numeric):
            reached = [-np.inf, -np.inf]  # below and above
            for side in rng.permutation(2):
                other = _moved(where, top, j, step if side else -step)
                if other is None:
                    continue
                reached[side] = yield Step(kind, other)
                if reached[side] > best:
                    top, best = other, reached[side]
                    break
            peak[j] = _vertex(before[j], step, best, *reached) if top is before else peak[j]
        if top is before:
            peak = where.snap(peak[None])[0]
            if not np.array_equal(peak, top):
                reached_there = yield Step(kind, peak)
                if reached_there > best:
                    top, best = peak, reached_there
            step /= SHORTER
            continue
        leap = where.snap((2 * top - before)[None])[0]
        if not np.array_equal(leap, top):
            reached_there = yield Step(kind, leap)
            if reached_there > best:
                top, best = leap, reached_there


def _vertex(place: float, step: float, value: float, below: float, above: float) -> float:
    """The top of the parabola through three values, one `step` apart; `place` itself where one is missing."""
    bend = 2 * value - below - above
    if not (np.isfinite(bend) and bend > 0):
        return place
    return min(max(place + 0.5 * step * (above - below) / bend, 0.0), 1.0)


def bisection(
    where: SearchSpace, high: np.ndarray, above: float, low: np.ndarray, below: float
) -> Generator[Step, float, tuple[np.ndarray, float]]:
    """The edge of a cliff between two cases, and the highest case met on its bad side with its value."""
    top, best = high, above
    for _ in range(HALVINGS):
        middle = where.snap((0.5 * (high + low))[None])[0]
        if np.array_equal(middle, high) or np.array_equal(middle, low):
            break
        value = yield Step("cliff", middle)
        if value > best:
            top, best = middle, value
        is_high = value > NOTHING and (below == NOTHING or value - below > above - value)
        if is_high:
            high, above = middle, value
        else:
            low, below = middle, value
    return top, best


def _changes(
    where: SearchSpace, start: np.ndarray, value: float, free: Sequence[int], *, rng: np.random.Generator
) -> Generator[Step, float, tuple[np.ndarray, float, list[tuple[np.ndarray, float]]]]:
    """Single changes of the `free` coordinates to other ends and levels until none gains; the neighbours of
    the top and values."""
    top, best = start, value
    unchanged = 0
    drops: list[tuple[np.ndarray, float]] = []
    order = rng.permutation(free)
    at = 0
    while unchanged < len(order):
        j = int(order[at % len(order)])
        at, unchanged = at + 1, unchanged + 1
        for place in _places(where, j, top, rng):
            other = top.copy()
            other[j] = place
            reached = yield Step("change", other)
            if reached > best:
                top, best = other, reached
                unchanged, drops = 1, []
            else:
                drops.append((other, reached))
    return top, best, drops


def _pair(
    where: SearchSpace,
    start: np.ndarray,
    value: float,
    free: Sequence[int],
    at_most: int,
    *,
    rng: np.random.Generator,
) -> Generator[Step, float, tuple[np.ndarray, float] | None]:
    """The first gain among changes of two of the `free` coordinates at once; None where none gains."""
    pairs = [(i, j) for j in free for i in free if i < j]
    for k in rng.permutation(len(pairs))[:at_most]:
        other = start.copy()
        for j in pairs[k]:
            other[j] = _places(where, j, start, rng)[0]
        reached = yield Step("pair", other)
        if reached > value:
            return other, reached
    return None


def _places(where: SearchSpace, j: int, point: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Where coordinate j of `point` may be moved: the other end, both ends from inside, the other levels of
    a categorical one."""
    grid = where.levels[j]
    is_label = where.space.parameters[j].kind == "categorical"
    places = np.array([0.0, 1.0]) if grid is None or not is_label else grid
    others: np.ndarray = places[np.abs(places - point[j]) > 1e-9]
    return rng.permutation(others)


def _inside(
    where: SearchSpace,
    start: np.ndarray,
    value: float,
    *,
    slope: Slope,
    rng: np.random.Generator,
) -> Generator[Step, float, tuple[np.ndarray, float]]:
    if slope(start) is None:
        return (yield from _pattern(where, start, value, rng=rng))
    return (yield from _gradient(where, start, value, slope=slope))


def _pattern(
    where: SearchSpace, start: np.ndarray, value: float, *, rng: np.random.Generator
) -> Generator[Step, float, tuple[np.ndarray, float]]:
    """Coordinate steps with repeated moves; the levels of a categorical coordinate are left as they are."""
    numeric = [j for j in range(where.dimension) if where.space.parameters[j].is_numeric]
    top, best, step = start, value, FIRST_STEP
    while step >= LAST_STEP:
        before = top
        for j in rng.permutation(numeric):
            for sign in rng.permutation([-1.0, 1.0]):
                other = _moved(where, top, j, sign * step)
                if other is None:
                    continue
                reached = yield Step("pattern", other)
                if reached > best:
                    top, best = other, reached
                    break
        if top is before:
            top, best = yield from _along(where, top, best, top - start, numeric, step)
        if top is before:
            top, best = yield from _oblique(where, top, best, numeric, step, rng=rng)
        if top is before:
            step /= 2
            continue
        leap = where.snap((2 * top - before)[None])[0]
        if not np.array_equal(leap, top):
            reached = yield Step("pattern", leap)
            if reached > best:
                top, best = leap, reached
    return top, best


def _along(
    where: SearchSpace,
    top: np.ndarray,
    best: float,
    path: np.ndarray,
    numeric: list[int],
    step: float,
) -> Generator[Step, float, tuple[np.ndarray, float]]:
    """A gain by a step along the way climbed so far, or back: a bent ridge leads on where it came from."""
    size = float(np.abs(path[numeric]).max()) if len(numeric) else 0.0
    if size < 1e-9:
        return top, best
    for sign in (1.0, -1.0):
        other = top.copy()
        other[numeric] = top[numeric] + sign * step * path[numeric] / size
        other = where.snap(other[None])[0]
        if np.array_equal(other, top):
            continue
        reached = yield Step("pattern", other)
        if reached > best:
            return other, reached
    return top, best


def _oblique(
    where: SearchSpace,
    top: np.ndarray,
    best: float,
    numeric: list[int],
    step: float,
    *,
    rng: np.random.Generator,
) -> Generator[Step, float, tuple[np.ndarray, float]]:
    """The first gain among steps of two coordinates at once: along an edge, single steps lead off it."""
    for _ in range(OBLIQUE * len(numeric) if len(numeric) > 1 else 0):
        other: np.ndarray | None = top
        for j, sign in zip(rng.choice(numeric, 2, replace=False), rng.choice([-1.0, 1.0], 2), strict=True):
            other = None if other is None else _moved(where, other, j, sign * step)
        if other is None:
            continue
        reached = yield Step("pattern", other)
        if reached > best:
            return other, reached
    return top, best


def _moved(where: SearchSpace, point: np.ndarray, j: int, step: float) -> np.ndarray | None:
    """`point` with coordinate j moved by `step`, by one level at least; None where it would stay."""
    other = point.copy()
    grid = where.levels[j]
    if grid is None:
        other[j] = min(max(point[j] + step, 0.0), 1.0)
    else:
        k = int(np.abs(grid - point[j]).argmin())
        shift = max(round(abs(step) * (len(grid) - 1)), 1)
        other[j] = grid[min(max(k + (shift if step > 0 else -shift), 0), len(grid) - 1)]
    return None if abs(other[j] - point[j]) < 1e-12 else other


def _gradient(
    where: SearchSpace,
    start: np.ndarray,
    value: float,
    *,
    slope: Slope,
    kind: str = "gradient",
    first: float = FIRST_STRIDE,
    last: float = LAST_STRIDE,
) -> Generator[Step, float, tuple[np.ndarray, float]]:
    """Along the gradient projected on the box."""
    top, best, stride = start, value, first
    while stride >= last:
        uphill = slope(top)
        if uphill is None:
            break
        uphill = np.nan_to_num(uphill)
        uphill[((top <= 0) & (uphill < 0)) | ((top >= 1) & (uphill > 0))] = 0.0
        length = float(np.abs(uphill).max())
        if length == 0:
            break
        other = where.snap((top + stride * uphill / length)[None])[0]
        reached = yield Step(kind, other)
        if reached > best:
            top, best, stride = other, reached, 2 * stride
        else:
            stride /= 4
    return top, best
