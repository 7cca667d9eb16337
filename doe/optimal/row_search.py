"""The search of an exchange algorithm over model rows: a first design, climbs, and shakes between them.

D on few candidates keeps the tableau of all pairs of design row and candidate; otherwise one design row is
exchanged at a time.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from doe.criteria.regression import Floats, Integers
from doe.optimal import _kernels_exchange as kernels
from doe.optimal import _kernels_tableau as tableau
from doe.portable.draws import splitmix_at
from doe.portable.linear import gram, inverse_root, product, quadratic_forms

__all__ = ["CRITERIA", "RIDGE", "SINGULAR", "Task", "padded", "row_search"]

CRITERIA = ("D", "A", "I")

# share of the first runs drawn at random; the rest follows by largest variance
RANDOM_SHARE = 0.3
# ridge, relative to the mean squared model row, while fewer runs than terms are chosen
RIDGE = 1e-7
# a design whose information matrix has a smaller reciprocal condition than this cannot estimate the model
SINGULAR = 1e-13
# design rows x candidates up to which the tableau of pairs is kept (float32, 1 MB)
TABLEAU = 250_000
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


def _scratch(candidates: int, columns: int) -> tableau.Scratch:
    gains = np.empty(candidates, np.float32)
    return tableau.Scratch(
        wj=np.empty(candidates, np.float32),
        wi=np.empty(candidates, np.float32),
        gains=gains,
        bits=gains.view(np.int32),
        g=np.empty(columns),
        h=np.empty(columns),
    )


def _climb_pairs(
    f: Floats, light: NDArray[np.float32], design: Integers, task: Task, shakes: int, rng: np.random.Generator
) -> tuple[Integers, float]:
    """Climb and shake on the tableau of all pairs, refreshed every few shakes."""
    state = splitmix_at(int(rng.integers(0, 2**64, dtype=np.uint64)))
    limit = PATIENCE * task.n
    depth = max(2, round(DEPTH * task.n))
    scratch = _scratch(*f.shape)
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
        given = tableau.Tableau(
            f=f,
            ft=light,
            design=design,
            fixed=len(task.fixed),
            blocked=blocked,
            w=w,
            v=variance,
            inverse=inverse,
            replicates=task.replicates,
        )
        tableau.climb(given, scratch, limit)
        turn = min(left, REFRESH)
        if turn > 0:
            tableau.shake(given, scratch, state, depth, turn, FLOOR, limit)
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
