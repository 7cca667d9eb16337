"""Exchange algorithms: the best n rows of a list of candidates for a regression model.

Fedorov's exchange (Fedorov 1972; Cook & Nachtsheim 1980; Atkinson, Donev & Tobias 2007, chapter 12) with
rank-one updates on log|X'X|: the determinant itself is 1e-41 for 45 terms, where a test on raw determinants
stops improving. After the first climb the design is shaken and climbed again (iterated local search), which
costs a tenth of a new start and finds more.

Three sizes: D on few candidates keeps the tableau of all pairs; otherwise one design row at a time; long
lists are read in blocks, and exchanges run on the candidates of largest variance until no other one gains.
"""

from dataclasses import replace
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.criteria.regression import (
    Floats,
    Integers,
    Model,
    checked,
    model_matrix,
    moment_matrix,
)
from doe.optimal.row_search import CRITERIA, RIDGE, SINGULAR, Task, padded, row_search
from doe.portable.linear import gram

__all__ = ["exchange"]

# exchanges work on this many candidates at a time, or on 4 per run and term; lists twice as long are read in
# blocks of BLOCK rows, at most ROUNDS times
ACTIVE = 2_000
BLOCK = 65_536
ROUNDS = 12
# runs x candidates x terms up to which all starts are made by default, and from which one is all there is, so
# that a call takes about 60 ms at most. On 34 corners of 2^7 for the two-factor interactions one start misses
# the best in all of 10 seeds, twenty in one, 60 in none of 40
SMALL_WORK, LARGE_WORK = 4e5, 1.8e6
MOST_STARTS = 60


def exchange(
    candidates: ArrayLike,
    n: int,
    *,
    model: Model = "quadratic",
    criterion: str = "D",
    replicates: bool = False,
    include: ArrayLike = (),
    existing: ArrayLike | None = None,
    starts: int | None = None,
    shakes: int | None = None,
    rng: np.random.Generator,
) -> NDArray[np.int64]:
    """Row indices (n,) of the candidates that make the best design, ascending.

    Args:
        candidates: (N, d) points of the unit cube, N up to 1e6 and more; the model is taken in x = 2 u - 1.
            Points outside the cube are allowed: D and I do not depend on the scale of a column.
        n: runs to choose, `include` among them.
        model: linear | interactions | quadratic, a table of exponents, or a function (see `doe.model_terms`).
        criterion: D maximises |X'X|; A minimises trace (X'X)^-1; I minimises the prediction variance averaged
            over the unit cube.
        replicates: whether a candidate may be chosen several times.
        include: rows of `candidates` that must be in the design.
        existing: (m, d) runs already made: they count in X'X and are not handed back.
        starts: independent searches, each from its own stream spawned from `rng`; the best is handed back.
            By default the more the less one costs: 60 up to 4e5 = n times the candidates times the terms, 60
            ms in all at most, falling to 1 at 1.8e6, and 1 on long lists.
        shakes: how often each search shakes its design and climbs again; by default 8 for D with fewer than
            2.5e5 pairs of run and active candidate, where a shake costs a fraction of a climb, otherwise 0.

    >>> corners = [[a, b] for a in (0, 0.5, 1) for b in (0, 0.5, 1)]
    >>> exchange(corners, 4, model="interactions", rng=np.random.default_rng(0)).tolist()
    [0, 2, 6, 8]

    Raises: ValueError for NaN, duplicate candidates without replicates, fewer candidates than n, fewer runs
    than terms, and candidates that cannot estimate the model.
    """
    points = checked(candidates, "candidates")
    fixed, done = _settle(points, n, criterion, replicates, include, existing, starts, shakes)
    d = points.shape[1]
    first = model_matrix(points[:1], model=model)
    p = first.shape[1]
    made = np.zeros((0, p)) if done is None else model_matrix(done, model=model)
    if n + len(made) < p:
        raise ValueError(
            f"n={n} runs cannot estimate the {p} terms of the model in {d} factors;"
            f" ask for n >= {p - len(made)} or a smaller model"
        )
    task = Task(
        n=n,
        terms=p,
        criterion=criterion,
        replicates=replicates,
        fixed=fixed,
        information=gram(made),
        moments=moment_matrix(model, d) if criterion == "I" else np.eye(p),
    )
    if len(points) <= 2 * _active_size(task):
        if starts is None:
            starts = default_starts(n * len(points) * p)
        f = padded(model_matrix(points, model=model))
        design, score = row_search(f, task, starts=starts, shakes=shakes, rng=rng)
        if not np.isfinite(score):
            _explain_failure(f[:, :p].T @ f[:, :p] + task.information)
    else:
        design = _search_blocks(points, model, task, starts=starts or 1, shakes=shakes, rng=rng)
    return np.sort(design)


def default_starts(work: float) -> int:
    """Searches that are worth their time for a problem of `work` = runs x candidates x terms.

    >>> default_starts(34 * 128 * 29), default_starts(48 * 512 * 46), default_starts(64 * 640 * 45)
    (60, 28, 1)
    """
    share = (LARGE_WORK - work) / (LARGE_WORK - SMALL_WORK)
    return int(np.clip(MOST_STARTS * share, 1, MOST_STARTS))


def _search_blocks(
    points: Floats, model: Model, task: Task, *, starts: int, shakes: int | None, rng: np.random.Generator
) -> Integers:
    """Search a long list: exchanges on an active part of it, which then takes in whatever else could gain."""
    size = _active_size(task)
    active = np.union1d(rng.choice(len(points), size, replace=False), task.fixed)
    design, score = np.zeros(0, dtype=np.int64), -np.inf
    for turn in range(ROUNDS):
        f = padded(model_matrix(points[active], model=model))
        place = np.searchsorted(active, design) if turn else None
        local = replace(task, fixed=np.searchsorted(active, task.fixed))
        rows, now = row_search(f, local, starts=1 if turn else starts, shakes=shakes, rng=rng, start=place)
        inverse, _ = task.inverse(f[rows], 0.0 if np.isfinite(now) else RIDGE)
        if turn and now <= score + 1e-6:
            break
        design, score = active[rows], now
        weight = _block_scores(points, model, task, inverse)
        # rounded, so that symmetric candidates tie whatever library multiplied them
        order = np.argsort(-np.round(weight / weight.max(), 9), kind="stable")
        active = np.union1d(order[:size], design)
    if not np.isfinite(score):
        _explain_failure(_whole_information(points, model) + task.information)
    return design


def _active_size(task: Task) -> int:
    return max(ACTIVE, 4 * task.n, 4 * task.terms)


def _block_scores(points: Floats, model: Model, task: Task, inverse: Floats) -> Floats:
    """What adding each candidate would gain: its variance (D), or the fall of the trace."""
    p = task.terms
    root = np.linalg.cholesky(inverse[:p, :p])
    middle = root.T @ task.moments @ root
    scores = np.empty(len(points))
    for k in range(0, len(points), BLOCK):
        z = model_matrix(points[k : k + BLOCK], model=model) @ root
        v = np.einsum("ij,ij->i", z, z)
        if task.criterion != "D":
            v = np.einsum("ij,ij->i", z @ middle, z) / (1.0 + v)
        scores[k : k + BLOCK] = v
    return scores


def _whole_information(points: Floats, model: Model) -> Floats:
    blocks = (model_matrix(points[k : k + BLOCK], model=model) for k in range(0, len(points), BLOCK))
    return np.asarray(sum(x.T @ x for x in blocks))


def _explain_failure(information: Floats) -> NoReturn:
    """Raise: some terms of the model cannot be told apart on the candidates, or on those allowed."""
    eigenvalues = np.linalg.eigvalsh(information)
    rank = int(np.sum(eigenvalues > SINGULAR * eigenvalues[-1]))
    if rank < len(information):
        raise ValueError(
            f"candidates can only estimate {rank} of the {len(information)} terms of the model: some are"
            " equal or constant on all of them, as the square of a factor with two levels is. Choose a"
            " smaller model, or give a table of exponents without these terms"
        )
    raise ValueError(
        "no regular design was found though the candidates can estimate the model: the included rows leave"
        " too few to choose, or the model is nearly singular; include fewer rows or raise starts"
    )


def _settle(
    points: Floats,
    n: int,
    criterion: str,
    replicates: bool,
    include: ArrayLike,
    existing: ArrayLike | None,
    starts: int | None,
    shakes: int | None,
) -> tuple[Integers, Floats | None]:
    """Check the arguments of `exchange`; the included rows and the runs already made."""
    if criterion not in CRITERIA:
        raise ValueError(f"criterion needs one of {', '.join(CRITERIA)}, got {criterion!r}")
    if n < 1:
        raise ValueError(f"n needs a whole number of runs >= 1, got {n}")
    if (starts is not None and starts < 1) or (shakes is not None and shakes < 0):
        raise ValueError(f"starts needs a number >= 1 and shakes >= 0, got starts={starts}, shakes={shakes}")
    fixed = np.asarray(include, dtype=np.int64).reshape(-1)
    if len(fixed) > n:
        raise ValueError(f"include names {len(fixed)} rows but n={n}; ask for n >= {len(fixed)}")
    if len(fixed) and (fixed.min() < 0 or fixed.max() >= len(points)):
        raise ValueError(
            f"include needs rows of the {len(points)} candidates, got {fixed.min()}..{fixed.max()}"
        )
    if not replicates:
        if len(points) < n:
            raise ValueError(
                f"candidates has {len(points)} rows, fewer than n={n}; give more or allow replicates=True"
            )
        if len(np.unique(fixed)) < len(fixed):
            raise ValueError("include names a row twice; allow replicates=True for repeated runs")
        _refuse_duplicates(points)
    done = None if existing is None else checked(existing, "existing")
    if done is not None and done.shape[1] != points.shape[1]:
        raise ValueError(
            f"existing needs the {points.shape[1]} columns of the candidates, got {done.shape[1]}"
        )
    return fixed, done


def _refuse_duplicates(points: Floats) -> None:
    """Raise when two candidates are equal; found by a sort of one irrational combination of the columns."""
    weights = np.sqrt(np.arange(2, points.shape[1] + 2)) % 1.0 + 0.5
    key = points @ weights
    order = np.argsort(key, kind="stable")
    near = np.flatnonzero(np.diff(key[order]) <= 1e-12 * np.abs(key[order[1:]]).max())
    same = near[(points[order[near]] == points[order[near + 1]]).all(axis=1)]
    if len(same):
        i, j = sorted((int(order[same[0]]), int(order[same[0] + 1])))
        raise ValueError(
            f"candidates has equal rows {i} and {j} ({len(same)} such pairs); remove them or allow"
            " replicates=True"
        )
