"""From a space, a kind and a number of runs to unit points: what a `[design]` table asks for.

`KINDS` names the function of `doe` and the way it goes; the ways are here. Space-filling kinds follow the
parameters' distributions; the others use the bounds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import doe
from doe.latin.columns import CRITERIA, Columns
from doe.latin.joint import JOINT, STARTS, joint_search, joint_swaps
from doe.latin.swaps import swap_search
from doe.portable.draws import Draws, splitmix
from workbench.errors import StudyError
from workbench.sampling.factors import POOL, Factors
from workbench.sampling.kinds import KINDS, DesignOptions, check_kind
from workbench.space.box import Space

__all__ = ["points_of_kind", "random_points"]

# swaps for one criterion; fewer where each has to ask the constraints, which are Python
SWAPS, ASKED_SWAPS = 100_000, 20_000
SLACK = 1e-9

Found = tuple[np.ndarray, dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What is asked for: `given` holds the options that are set; `runs` is None where the kind fixes it."""

    space: Space
    kind: str
    runs: int | None
    given: dict[str, Any]
    rng: np.random.Generator

    @property
    def n(self) -> int:
        """The number of runs, of a kind that needs one."""
        assert self.runs is not None
        return self.runs

    def sampled(self) -> np.ndarray:
        """What the kind's sampler gives: (n, d) in the unit cube."""
        function = getattr(doe, KINDS[self.kind].function)
        points: np.ndarray = function(self.n, self.space.dimension, rng=self.rng, **self.given)
        return points


def points_of_kind(
    space: Space, kind: str, runs: int | None, *, rng: np.random.Generator, options: DesignOptions
) -> Found:
    """Unit points (n, d) of a kind and the options that were used.

    Raises:
        StudyError: an unknown kind, an option that the kind does not take, a number of runs that it cannot
            have, or constraints that cannot be met.
    """
    given = options.given()
    check_kind(kind, runs=runs, options=given)
    try:
        return WAYS[KINDS[kind].way](Request(space=space, kind=kind, runs=runs, given=given, rng=rng))
    except ValueError as exc:  # of doe: the same words, as an error of the study
        if isinstance(exc, StudyError):
            raise
        raise StudyError(f"design kind {kind!r}: {exc}") from exc


def random_points(space: Space, n: int, *, rng: np.random.Generator) -> np.ndarray:
    """A random feasible Latin hypercube (n, d) on the levels of the space: what designs are compared with."""
    factors = Factors(space)
    return _on_units(factors, factors.start(doe.lhs(n, space.dimension, rng=rng), rng))


def _spread(asked: Request) -> Found:
    factors = Factors(asked.space)
    return _on_units(factors, factors.start(asked.sampled(), asked.rng)), dict(asked.given)


def _sequence(asked: Request) -> Found:
    factors = Factors(asked.space)
    return _on_units(factors, _first_points(factors, asked.kind, asked.n, asked.rng)), dict(asked.given)


def _arranged(asked: Request) -> Found:
    factors = Factors(asked.space)
    n, d = asked.n, asked.space.dimension
    constrained = bool(asked.space.constraints)
    names = _criteria(asked.given.get("criterion", ", ".join(JOINT)))
    joint = len(names) > 1 and set(names) <= set(JOINT)
    if constrained:
        usual = ASKED_SWAPS
    else:
        usual = joint_swaps(n, d) if joint else SWAPS
    used = {"swaps": usual, **asked.given, "criterion": ", ".join(names)}

    def start() -> np.ndarray:
        # from strata's middles: the search that follows is judged by distances
        latin: np.ndarray = getattr(doe, KINDS[asked.kind].function)(n, d, rng=asked.rng)
        return factors.start(latin, asked.rng)

    starts = [start() for _ in range(STARTS if joint and not constrained else 1)]
    return _on_units(factors, _swapped(factors, starts, names, used["swaps"], splitmix(asked.rng))), used


def _criteria(text: str) -> tuple[str, ...]:
    """The criteria named in a text such as "phi_p, cd2"."""
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in CRITERIA:
            raise ValueError(f"criterion needs {', '.join(CRITERIA)}, or several of them, got {name!r}")
    return names


def _within(asked: Request) -> Found:
    factors, n, d = Factors(asked.space), asked.n, asked.space.dimension
    q = factors.start(doe.centred_lhs(n, d, rng=asked.rng), asked.rng)
    used = {"model": "linear", "swaps": SWAPS, **asked.given}
    model = factors.model(used["model"])
    if callable(model):
        raise StudyError(
            f"design kind {asked.kind!r} does not know words with three or more levels; use"
            " 'd_optimal_select'"
        )
    sampler = getattr(doe, KINDS[asked.kind].function)
    q = sampler(n, d, model=model, swaps=used["swaps"], start=q, rng=asked.rng)
    return _on_units(factors, factors.start(q, asked.rng) if asked.space.constraints else q), used


def _chosen(asked: Request) -> Found:
    """Rows of a pool of feasible points that are best for a regression model."""
    factors, runs = Factors(asked.space, follow=False), asked.n
    used = {"model": "linear", "pool": max(1000, 10 * runs), **asked.given}
    if used["pool"] < runs:
        raise StudyError(f"pool needs at least runs = {runs} points to choose from, got {used['pool']}")
    most = min(used["pool"], POOL) if asked.space.constraints else used["pool"]
    points = factors.pool(most, asked.rng)
    if len(points) < runs:
        raise StudyError(
            f"the pool holds {len(points)} different feasible points, {runs} runs are asked for; loosen the"
            " constraints or ask for fewer runs"
        )
    exchange = getattr(doe, KINDS[asked.kind].function)
    criterion, model = used.get("criterion", "D"), factors.model(used["model"])
    return points[exchange(points, runs, model=model, criterion=criterion, rng=asked.rng)], used


def _grid(asked: Request) -> Found:
    points = _grid_points(asked.space, asked.runs, asked.given.get("levels"))
    return _feasible_part(asked.space, points, asked.kind), asked.given


def _factorial(asked: Request) -> Found:
    levels = [asked.given.get("levels", 2) if v is None else len(v) for v in asked.space.unit_levels]
    points = getattr(doe, KINDS[asked.kind].function)(levels)
    return _on_levels(asked.space, asked.kind, asked.runs, points), asked.given


def _classical(asked: Request) -> Found:
    points = getattr(doe, KINDS[asked.kind].function)(asked.space.dimension, **asked.given)
    return _on_levels(asked.space, asked.kind, asked.runs, points), asked.given


WAYS: dict[str, Callable[[Request], Found]] = {
    "spread": _spread,
    "sequence": _sequence,
    "arranged": _arranged,
    "within": _within,
    "chosen": _chosen,
    "grid": _grid,
    "factorial": _factorial,
    "classical": _classical,
}


def _on_units(factors: Factors, q: np.ndarray) -> np.ndarray:
    """Unit points of sampler points, contiguous."""
    return np.ascontiguousarray(factors.unit(q))


def _swapped(
    factors: Factors, starts: list[np.ndarray], criteria: tuple[str, ...], swaps: int, draws: Draws
) -> np.ndarray:
    """Starts with the same sorted columns after swaps inside them; every swap keeps the constraints."""
    columns = Columns(
        levels=np.ascontiguousarray(np.sort(starts[0], axis=0).T),
        nominal=np.array([not p.is_numeric for p in factors.space.parameters]),
    )
    feasible = factors.feasible if factors.space.constraints else None
    places = [_places(q) for q in starts]
    if len(criteria) > 1 and set(criteria) <= set(JOINT):
        return joint_search(
            columns, places, swaps=swaps, criteria=criteria, feasible=feasible, draws=draws
        ).points
    return swap_search(
        columns, places[0], criterion=criteria, swaps=swaps, feasible=feasible, draws=draws
    ).points


def _places(q: np.ndarray) -> np.ndarray:
    """Of points (n, d): the place of every value among the sorted ones of its column, (d, n)."""
    order = np.argsort(q, axis=0, kind="stable")
    return np.ascontiguousarray(np.argsort(order, axis=0, kind="stable").T, dtype=np.int32)


def _first_points(factors: Factors, kind: str, runs: int, rng: np.random.Generator) -> np.ndarray:
    """The first points of a scrambled sequence, those that meet the constraints."""
    from scipy.stats import qmc

    d = factors.space.dimension
    sequence = getattr(qmc, KINDS[kind].function)(d, rng=rng)
    if not factors.space.constraints:
        # up to the next power of two, which the balance of Sobol' needs
        size = 1 << max(runs - 1, 0).bit_length() if kind == "sobol" else runs
        return factors.balanced(np.asarray(sequence.random(size))[:runs])
    factors.pool(1, rng)  # raises, with the reasons, where there is no feasible point
    kept = np.empty((0, d))
    size = 1 << max(10, (runs - 1).bit_length())
    for _ in range(64):
        q = factors.balanced(np.asarray(sequence.random(size)))
        kept = np.vstack([kept, q[factors.feasible(q)]])
        if len(kept) >= runs:
            return kept[:runs]
    raise StudyError(
        f"the constraints leave {len(kept)} of {64 * size} points of the sequence, {runs} runs are asked for;"
        " loosen the constraints or ask for fewer runs"
    )


def _grid_points(space: Space, runs: int | None, levels: int | None) -> np.ndarray:
    """All combinations: every level of a levelled parameter, even steps of a continuous one."""
    free = sum(own is None for own in space.unit_levels)
    own = int(np.prod([len(v) for v in space.unit_levels if v is not None], dtype=float))
    if free and levels is None:
        if runs is None:
            raise StudyError("design kind 'grid' needs levels, the number per continuous parameter, or runs")
        levels = int((runs / own) ** (1.0 / free) + SLACK)
        if levels < 2:
            raise StudyError(
                f"a grid of at most {runs} runs leaves no two levels for {free} continuous parameters; give"
                f" runs >= {own * 2**free}"
            )
    axes = [np.linspace(0.0, 1.0, levels or 2) if v is None else v for v in space.unit_levels]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, space.dimension)
    if runs is not None and len(points) > runs:
        raise StudyError(f"the grid has {len(points)} runs, more than runs = {runs}; leave runs out")
    return points


def _on_levels(space: Space, kind: str, runs: int | None, points: np.ndarray) -> np.ndarray:
    """The points of a fixed design, where they are as many as asked for and meet every levelled parameter."""
    if runs is not None and runs != len(points):
        raise StudyError(
            f"design kind {kind!r} has {len(points)} runs here, got runs = {runs}; leave runs out"
        )
    for p, levels, column in zip(space.parameters, space.unit_levels, points.T, strict=True):
        if not p.is_numeric and levels is not None and len(levels) > 2 and kind != "factorial":
            raise StudyError(
                f"parameter {p.name!r} has {len(levels)} words, design kind {kind!r} has ordered levels only;"
                " use 'factorial' or 'd_optimal_select'"
            )
        if levels is not None:
            gap = np.abs(column[:, None] - levels).min(axis=1)
            if gap.max() > SLACK:
                value = column[int(gap.argmax())]
                raise StudyError(
                    f"parameter {p.name!r} has {len(levels)} levels, none at {value:.4g} of its range where"
                    f" design kind {kind!r} needs one; use 'd_optimal_select'"
                )
    return _feasible_part(space, points, kind)


def _feasible_part(space: Space, points: np.ndarray, kind: str) -> np.ndarray:
    """All points of a grid that meet the constraints; other fixed designs must meet them whole."""
    good = space.feasible(points)
    if good.all():
        return points
    if kind not in ("grid", "factorial") or not good.any():
        row = space.rows(points[~good][:1])[0]
        count = int((~good).sum())
        raise StudyError(
            f"design kind {kind!r}: {count} of {len(points)} runs break the constraints, the first"
            f" {space.violated(row)!r}; use 'd_optimal_select', which stays inside"
        )
    return points[good]
