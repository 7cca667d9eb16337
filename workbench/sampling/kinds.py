"""From a space, a kind and a number of runs to unit points: the `[design]` table of a study.

Every kind is one function of `doe`; the options it takes are listed in `KINDS`, and an option that a kind
does not take is refused. Space-filling kinds follow the parameters' distributions; the others use the bounds.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

import doe
from doe.latin.swaps import Columns, swap_search
from doe.portable.draws import splitmix
from workbench.errors import StudyError
from workbench.sampling.factors import POOL, Factors
from workbench.space.box import Space

__all__ = ["KINDS", "DesignOptions", "points_of_kind"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """What a kind may be asked for; None leaves the kind's own default.

    criterion: phi_p | cd2 | maxpro | correlation (optimised_lhs), D | A | I (optimal)
    swaps: swaps tried (optimised_lhs, d_optimal_within)    duplication, target: see `doe.ihs`
    model: linear | interactions | quadratic    pool: candidates (d_optimal_select, optimal)
    levels: per continuous parameter (grid, factorial)    resolution: of a fractional design
    alpha: axial distance of a central composite design    centre: runs in the middle
    """

    criterion: str | None = None
    swaps: int | None = None
    duplication: int | None = None
    target: str | None = None
    model: str | None = None
    pool: int | None = None
    levels: int | None = None
    resolution: int | None = None
    alpha: str | None = None
    centre: int | None = None

    def given(self) -> dict[str, Any]:
        """The options that are set."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}


# kind -> options it takes
KINDS: dict[str, tuple[str, ...]] = {
    "lhs": (),
    "optimised_lhs": ("criterion", "swaps"),
    "ihs": ("duplication", "target"),
    "d_optimal_select": ("model", "pool"),
    "d_optimal_within": ("model", "swaps"),
    "optimal": ("model", "criterion", "pool"),
    "sobol": (),
    "halton": (),
    "grid": ("levels",),
    "factorial": ("levels",),
    "fractional": ("resolution",),
    "plackett_burman": (),
    "central_composite": ("alpha", "centre"),
    "box_behnken": ("centre",),
}
FIXED = ("factorial", "fractional", "plackett_burman", "central_composite", "box_behnken")
# swaps by default; fewer where each has to ask the constraints, which are Python
SWAPS, ASKED_SWAPS = 100_000, 20_000
SLACK = 1e-9


def points_of_kind(
    space: Space, kind: str, runs: int | None, *, rng: np.random.Generator, options: DesignOptions
) -> tuple[np.ndarray, dict[str, Any]]:
    """Unit points (n, d) of a kind and the options that were used.

    Raises: StudyError for an unknown kind, an option that the kind does not take, a number of runs that it
    cannot have, and constraints that cannot be met.
    """
    if kind not in KINDS:
        raise StudyError(f"design kind needs one of {', '.join(KINDS)}, got {kind!r}")
    given = options.given()
    stray = [name for name in given if name not in KINDS[kind]]
    if stray:
        takes = ", ".join(KINDS[kind]) or "no options"
        raise StudyError(f"design kind {kind!r} does not take {stray[0]!r}; it takes {takes}")
    try:
        if kind == "grid":
            return _feasible_part(space, _grid(space, runs, options.levels), kind), given
        if kind in FIXED:
            return _classical(space, kind, runs, given), given
        if runs is None or runs < 1:
            raise StudyError(f"design kind {kind!r} needs runs >= 1, got {runs}")
        if kind in ("d_optimal_select", "optimal"):
            return _chosen(Factors(space, follow=False), runs, rng, given)
        return _spread(Factors(space), kind, runs, rng, given)
    except ValueError as exc:  # of doe: the same words, as an error of the study
        if isinstance(exc, StudyError):
            raise
        raise StudyError(f"design kind {kind!r}: {exc}") from exc


def _spread(
    factors: Factors, kind: str, runs: int, rng: np.random.Generator, given: dict[str, Any]
) -> tuple[np.ndarray, dict[str, Any]]:
    """The space-filling kinds and the D-optimal Latin hypercube."""
    d = factors.space.dimension
    used = dict(given)
    if kind in ("sobol", "halton"):
        q = _sequence(factors, kind, runs, rng)
    elif kind == "ihs":
        q = factors.start(doe.ihs(runs, d, rng=rng, **given), rng)
    else:
        # random inside the strata, except where a search follows that is judged by distances
        latin = doe.lhs if kind == "lhs" else doe.centred_lhs
        q = factors.start(latin(runs, d, rng=rng), rng)
    if kind == "optimised_lhs":
        swaps = ASKED_SWAPS if factors.space.constraints else SWAPS
        used = {"criterion": "phi_p", "swaps": swaps, **given}
        q = _arranged(factors, q, used["criterion"], used["swaps"], rng)
    if kind == "d_optimal_within":
        used = {"model": "linear", "swaps": SWAPS, **given}
        model = factors.model(used["model"])
        if callable(model):
            raise StudyError(
                "design kind 'd_optimal_within' does not know words with three or more levels; use"
                " 'd_optimal_select'"
            )
        q = doe.d_optimal_within(runs, d, model=model, swaps=used["swaps"], start=q, rng=rng)
        if factors.space.constraints:
            q = factors.start(q, rng)
    return np.ascontiguousarray(factors.unit(q)), used


def _arranged(
    factors: Factors, q: np.ndarray, criterion: str, swaps: int, rng: np.random.Generator
) -> np.ndarray:
    """q after swaps inside its columns, all factors together; every swap keeps the constraints."""
    order = np.argsort(q, axis=0, kind="stable")
    columns = Columns(
        levels=np.ascontiguousarray(np.sort(q, axis=0).T),
        nominal=np.array([not p.is_numeric for p in factors.space.parameters]),
    )
    entries = np.ascontiguousarray(np.argsort(order, axis=0, kind="stable").T, dtype=np.int32)
    found = swap_search(
        columns,
        entries,
        criterion=criterion,
        swaps=swaps,
        feasible=factors.feasible if factors.space.constraints else None,
        draws=splitmix(rng),
    )
    return found.points


def _sequence(factors: Factors, kind: str, runs: int, rng: np.random.Generator) -> np.ndarray:
    """The first points of a scrambled sequence, those that meet the constraints."""
    from scipy.stats import qmc

    d = factors.space.dimension
    sequence = qmc.Sobol(d, rng=rng) if kind == "sobol" else qmc.Halton(d, rng=rng)
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


def _chosen(
    factors: Factors, runs: int, rng: np.random.Generator, given: dict[str, Any]
) -> tuple[np.ndarray, dict[str, Any]]:
    """Rows of a pool of feasible points that are best for a regression model."""
    used = {"model": "linear", "pool": max(1000, 10 * runs), **given}
    if used["pool"] < runs:
        raise StudyError(f"pool needs at least runs = {runs} points to choose from, got {used['pool']}")
    points = factors.pool(min(used["pool"], POOL) if factors.space.constraints else used["pool"], rng)
    if len(points) < runs:
        raise StudyError(
            f"the pool holds {len(points)} different feasible points, {runs} runs are asked for; loosen the"
            " constraints or ask for fewer runs"
        )
    criterion = used.get("criterion", "D")
    model = factors.model(used["model"])
    return points[doe.exchange(points, runs, model=model, criterion=criterion, rng=rng)], used


def _grid(space: Space, runs: int | None, levels: int | None) -> np.ndarray:
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


def _classical(space: Space, kind: str, runs: int | None, given: dict[str, Any]) -> np.ndarray:
    d = space.dimension
    makers: dict[str, Callable[[], np.ndarray]] = {
        "factorial": lambda: doe.full_factorial(
            [given.get("levels", 2) if v is None else len(v) for v in space.unit_levels]
        ),
        "fractional": lambda: doe.two_level_fraction(d, **given),
        "plackett_burman": lambda: doe.plackett_burman(d),
        "central_composite": lambda: doe.central_composite(d, **given),
        "box_behnken": lambda: doe.box_behnken(d, **given),
    }
    points = makers[kind]()
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
