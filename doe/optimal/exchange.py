"""Exchange algorithms: the best n rows of a list of candidates for a regression model.

Fedorov's exchange (Fedorov 1972; Cook & Nachtsheim 1980; Atkinson, Donev & Tobias 2007, chapter 12) with
rank-one updates on log|X'X|: the determinant itself is 1e-41 for 45 terms, where a test on raw determinants
stops improving. After the first climb the design is shaken and climbed again (iterated local search), which
costs a tenth of a new start and finds more.

Three sizes: D on few candidates keeps the tableau of all pairs; otherwise one design row at a time; long
lists are read in blocks, and exchanges run on the candidates of largest variance until no other one gains.
"""

from dataclasses import dataclass, field, replace
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
from doe.optimal import _kernels_exchange as kernels
from doe.optimal import _kernels_tableau as tableau
from doe.portable.draws import splitmix_at
from doe.portable.linear import (
    gram,
    inverse_root,
    product,
    quadratic_forms,
)

__all__ = ["CRITERIA", "exchange", "padded", "row_search"]

CRITERIA = ("D", "A", "I")

# share of the first runs drawn at random; the rest follows by largest variance
RANDOM_SHARE = 0.3
# ridge, relative to the mean squared model row, while fewer runs than terms are chosen
RIDGE = 1e-7
# a design whose information matrix has a smaller reciprocal condition than this cannot estimate the model
SINGULAR = 1e-13
# design rows x candidates up to which the tableau of pairs is kept (float32, 1 MB)
TABLEAU = 250_000
# exchanges work on this many candidates at a time, or on 4 per run and term; lists twice as long are read in
# blocks of BLOCK rows, at most ROUNDS times
ACTIVE = 2_000
BLOCK = 65_536
ROUNDS = 12
# shakes where the tableau makes them cheap; none otherwise unless asked for
SHAKES = 8
# share of a shaken design's rows exchanged at random, at least two; a random exchange may halve |X'X|
DEPTH = 1 / 8
FLOOR = -0.5
# climbs between two exact factorisations; exchanges allowed in a climb, per run
REFRESH = 12
PATIENCE = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What a search needs besides the model rows: see `exchange`."""

    n: int
    terms: int
    criterion: str = "D"
    replicates: bool = False
    fixed: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    information: Floats  # of the runs already made, (p, p)
    moments: Floats  # B of the trace criteria, (p, p)

    def inverse(self, rows: Floats, ridge: float = 0.0) -> tuple[Floats, float]:
        """(X'X)^-1 padded with zeros, and the score: log|X'X| or -log trace (X'X)^-1 B; -inf if singular."""
        p = self.terms
        inverse = np.zeros((rows.shape[1], rows.shape[1]))
        root = inverse_root(self.information + gram(rows[:, :p]) + ridge * np.eye(p))
        if root is None:
            return inverse, -np.inf
        diagonal = np.diag(root)
        if diagonal.min() <= SINGULAR**0.5 * diagonal.max():
            return inverse, -np.inf
        inverse[:p, :p] = gram(root)
        if self.criterion == "D":
            return inverse, float(-2.0 * np.log(diagonal).sum())
        return inverse, float(-np.log(np.sum(inverse[:p, :p] * self.moments)))


def exchange(
    candidates: ArrayLike,
    n: int,
    *,
    model: Model = "quadratic",
    criterion: str = "D",
    replicates: bool = False,
    include: ArrayLike = (),
    existing: ArrayLike | None = None,
    starts: int = 1,
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
        f = padded(model_matrix(points, model=model))
        design, score = row_search(f, task, starts=starts, shakes=shakes, rng=rng)
        if not np.isfinite(score):
            _explain_failure(f[:, :p].T @ f[:, :p] + task.information)
    else:
        design = _search_blocks(points, model, task, starts=starts, shakes=shakes, rng=rng)
    return np.sort(design)


def row_search(
    f: Floats,
    task: Task,
    *,
    starts: int = 1,
    shakes: int | None = None,
    rng: np.random.Generator,
    start: Integers | None = None,
) -> tuple[Integers, float]:
    """Best rows of the padded model rows `f` (N, P) and their score; from `start` or at random."""
    best, score = np.zeros(task.n, dtype=np.int64), -np.inf
    pairs = task.criterion == "D" and task.n * len(f) <= TABLEAU
    climb = _climb_pairs if pairs else _climb_rows
    light = np.ascontiguousarray(f.T, dtype=np.float32) if pairs else np.zeros((0, 0), np.float32)
    if shakes is None:
        shakes = SHAKES if pairs else 0
    for child in rng.spawn(starts):
        design = _first(f, light, task, child) if start is None else start.copy()
        found = climb(f, light, design, task, shakes, child)
        if found[1] > score + kernels.TIE:
            best, score = found
    return best, score


def padded(x: Floats) -> Floats:
    """The columns of `x` followed by zeros up to a multiple of four: whole registers in the kernels."""
    n, p = x.shape
    f = np.zeros((n, -(-p // 4) * 4))
    f[:, :p] = x
    return f


def _first(f: Floats, light: NDArray[np.float32], task: Task, rng: np.random.Generator) -> Integers:
    """A first design: the fixed rows, some random ones, the rest by largest variance."""
    used = np.zeros(len(f), dtype=np.int64)
    design = np.zeros(task.n, dtype=np.int64)
    m = len(task.fixed)
    design[:m] = task.fixed
    np.add.at(used, task.fixed, 1)
    free = np.arange(len(f)) if task.replicates else np.flatnonzero(used == 0)
    kept = m + int(RANDOM_SHARE * (task.n - m))
    design[m:kept] = rng.choice(free, kept - m, replace=task.replicates)
    np.add.at(used, design[m:kept], 1)
    ridge = RIDGE * float(np.mean(np.sum(f[design] ** 2, axis=1)))
    inverse, _ = task.inverse(f[design[:kept]], ridge)
    variance = quadratic_forms(f, inverse)
    if light.size:
        blocked = np.where(used > 0, tableau.BLOCK, np.float32(0.0)) * np.float32(not task.replicates)
        variance32 = variance.astype(np.float32)
        tableau.add_greedily(f, light, design, blocked, kept, inverse, variance32, task.replicates)
    else:
        kernels.add_greedily(f, design, used, kept, inverse, variance, task.replicates)
    return design


def _climb_pairs(
    f: Floats, light: NDArray[np.float32], design: Integers, task: Task, shakes: int, rng: np.random.Generator
) -> tuple[Integers, float]:
    """Climb and shake on the tableau of all pairs, refreshed every few shakes."""
    state = splitmix_at(int(rng.integers(0, 2**64, dtype=np.uint64)))
    limit = PATIENCE * task.n
    depth = max(2, round(DEPTH * task.n))
    best, score = design.copy(), -np.inf
    left = shakes if task.n > len(task.fixed) else 0
    while True:
        inverse, now = task.inverse(f[design])
        if now > score + kernels.TIE:
            best, score = design.copy(), now
        if not np.isfinite(now) or left < 0:
            return best, score
        variance = quadratic_forms(f, inverse).astype(np.float32)
        w = np.empty((task.n, len(f)), dtype=np.float32)
        tableau.fill(f, light, design, inverse, w)
        blocked = np.zeros(len(f), dtype=np.float32)
        if not task.replicates:
            blocked[design] = tableau.BLOCK
        given = (f, light, design, len(task.fixed), blocked, w, variance, inverse)
        tableau.climb(*given, task.replicates, limit)
        turn = min(left, REFRESH)
        if turn > 0:
            tableau.shake(*given, state, depth, turn, FLOOR, task.replicates, limit)
        left = left - turn if left > turn else -1


def _climb_rows(
    f: Floats, light: NDArray[np.float32], design: Integers, task: Task, shakes: int, rng: np.random.Generator
) -> tuple[Integers, float]:
    """Climb and shake one design row at a time; every climb starts from an exact factorisation."""
    del light
    m = len(task.fixed)
    depth = max(2, round(DEPTH * task.n))
    best, score = design.copy(), -np.inf
    for turn in range(shakes + 1 if task.n > m else 1):
        trial = best.copy()
        if turn > 0:
            rows = m + rng.permutation(task.n - m)[:depth]
            open_ = np.arange(len(f)) if task.replicates else np.setdiff1d(np.arange(len(f)), best)
            if len(open_) == 0:
                break
            trial[rows] = rng.choice(open_, len(rows), replace=task.replicates or len(open_) < len(rows))
            if not task.replicates and len(np.unique(trial)) < task.n:
                continue
        inverse, now = task.inverse(f[trial])
        for _ in range(REFRESH):
            if not np.isfinite(now):
                break
            before = now
            _climb_once(f, trial, task, inverse)
            inverse, now = task.inverse(f[trial])
            if now <= before + kernels.TIE:
                break
        if now > score + kernels.TIE:
            best, score = trial, now
    return best, score


def _climb_once(f: Floats, design: Integers, task: Task, inverse: Floats) -> None:
    used = np.bincount(design, minlength=len(f))
    variance = quadratic_forms(f, inverse)
    m, limit = len(task.fixed), PATIENCE * task.n
    if task.criterion == "D":
        kernels.climb_d(f, design, used, m, inverse, variance, task.replicates, limit)
        return
    middle = np.zeros_like(inverse)
    p = task.terms
    middle[:p, :p] = product(product(inverse[:p, :p], task.moments), inverse[:p, :p])
    trace = float(np.sum(inverse[:p, :p] * task.moments))
    c = quadratic_forms(f, middle)
    kernels.climb_trace(f, design, used, m, inverse, middle, variance, c, trace, task.replicates, limit)


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
    starts: int,
    shakes: int | None,
) -> tuple[Integers, Floats | None]:
    """Check the arguments of `exchange`; the included rows and the runs already made."""
    if criterion not in CRITERIA:
        raise ValueError(f"criterion needs one of {', '.join(CRITERIA)}, got {criterion!r}")
    if n < 1:
        raise ValueError(f"n needs a whole number of runs >= 1, got {n}")
    if starts < 1 or (shakes is not None and shakes < 0):
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
