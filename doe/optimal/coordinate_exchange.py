"""Optimal designs without a list of candidates: coordinate exchange (Meyer & Nachtsheim 1995).

Each coordinate of each run takes its best level in turn; continuous coordinates are then moved together by
L-BFGS-B on the same criterion with its gradient,

    d log|X'X| / d x_ic = 2 (M^-1 f_i)' (df_i / dx_c),
    d trace(M^-1 B) / d x_ic = -2 (C f_i)' (df_i / dx_c),    C = M^-1 B M^-1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

from doe.criteria._kernels_model_rows import expand
from doe.criteria.regression import (
    Floats,
    Integers,
    Model,
    checked,
    factor_lists,
    model_matrix,
    model_terms,
    moment_matrix,
)
from doe.optimal import _kernels_coordinates as kernels
from doe.optimal.row_search import CRITERIA, Task
from doe.portable.linear import gram, product

__all__ = ["Levels", "coordinate_exchange"]

Levels = int | Sequence[int | ArrayLike | None] | None

# levels that a continuous coordinate tries before the polish moves it off them
CONTINUOUS = 11
# attempts at a start that can estimate the model
ATTEMPTS = 50
# climbs, each from an exact factorisation, and passes in a climb
CLIMBS = 5
PASSES = 100
# starts unless asked for: WORK over runs times terms, within these bounds; so many of the best are polished
WORK = 20_000
FEWEST, MOST = 2, 100
POLISHED = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Coded values of the columns: `levels[c, :counts[c]]`; `continuous` tells which are a continuum."""

    levels: Floats
    counts: Integers
    continuous: np.ndarray


def coordinate_exchange(
    n: int,
    d: int,
    *,
    model: Model = "quadratic",
    criterion: str = "D",
    levels: Levels = None,
    existing: ArrayLike | None = None,
    starts: int | None = None,
    polish: bool = True,
    rng: np.random.Generator,
) -> Floats:
    """The points (n, d) in [0, 1] of an optimal design for a regression model.

    Args:
        model: linear | interactions | quadratic, or a table of exponents. A named model leaves out the
            square of a factor with two levels, which equals the constant.
        criterion: D | A | I, as for `exchange`.
        levels: None for continuous factors; a number of even levels for all; or one entry per factor:
            None, a number, or the values in [0, 1].
        existing: (m, d) runs already made: they count and are not handed back.
        starts: random designs to begin from; by default 2 to 100, the fewer the larger the design.
        polish: whether continuous coordinates leave the 11 levels of the search.

    >>> points = coordinate_exchange(6, 2, rng=np.random.default_rng(0))
    >>> from doe.criteria.regression import d_efficiency
    >>> round(d_efficiency(points, model="quadratic"), 4)
    0.4231

    Raises: ValueError when n is less than the model's terms, or the levels cannot estimate it.
    """
    if n < 1 or d < 1:
        raise ValueError(f"n and d need whole numbers >= 1, got n={n} and d={d}")
    if criterion not in CRITERIA:
        raise ValueError(f"criterion needs one of {', '.join(CRITERIA)}, got {criterion!r}")
    if starts is not None and starts < 1:
        raise ValueError(f"starts needs a whole number >= 1, got {starts}")
    if callable(model):
        raise ValueError("model needs a name or a table of exponents here, got a function")
    grid = _grid(levels, d)
    terms = model_terms(model, d)
    if isinstance(model, str):
        terms = terms[~np.any((terms == 2) & (grid.counts == 2) & ~grid.continuous, axis=1)]
    made = np.zeros((0, d)) if existing is None else checked(existing, "existing")
    if made.shape[1] != d:
        raise ValueError(f"existing needs {d} columns, got {made.shape[1]}")
    p = len(terms)
    if n + len(made) < p:
        raise ValueError(
            f"n={n} runs cannot estimate the {p} terms of the model in {d} factors;"
            f" ask for n >= {p - len(made)} or a smaller model"
        )
    old = model_matrix(made, model=terms) if len(made) else np.zeros((0, p))
    task = Task(
        n=n,
        terms=p,
        criterion=criterion,
        information=gram(old),
        moments=moment_matrix(terms, d) if criterion == "I" else np.eye(p),
    )
    free = polish and bool(grid.continuous.any())
    turns = min(MOST, max(FEWEST, WORK // (n * p))) if starts is None else starts
    found = [_climb(_start(terms, grid, task, child), terms, grid, task) for child in rng.spawn(turns)]
    # stable: the first of equals stays first
    found.sort(key=lambda coded: -round(_score(coded, terms, task), 9))
    if free:
        found = [_polish(coded, terms, grid, task) for coded in found[:POLISHED]]
    best = max(found, key=lambda coded: _score(coded, terms, task))
    return np.ascontiguousarray(np.clip((best + 1.0) / 2.0, 0.0, 1.0))


def _grid(levels: Levels, d: int) -> Grid:
    given: Sequence[int | ArrayLike | None]
    if levels is None or isinstance(levels, int | np.integer):
        given = [levels] * d
    else:
        given = levels
    if len(given) != d:
        raise ValueError(f"levels needs one entry for each of the {d} factors, got {len(given)}")
    values = []
    for c, entry in enumerate(given):
        if entry is None or isinstance(entry, int | np.integer):
            count = CONTINUOUS if entry is None else int(entry)
            if count < 2:
                raise ValueError(f"levels of factor {c} needs at least 2, got {count}")
            unit = np.linspace(0.0, 1.0, count)
        else:
            unit = np.unique(np.asarray(entry, dtype=float))
            if len(unit) < 2 or not (np.isfinite(unit).all() and unit[0] >= 0.0 and unit[-1] <= 1.0):
                raise ValueError(f"levels of factor {c} needs two or more values in [0, 1], got {entry}")
        values.append(2.0 * unit - 1.0)
    counts = np.array([len(v) for v in values], dtype=np.int64)
    table = np.zeros((d, counts.max()))
    for c, v in enumerate(values):
        table[c, : len(v)] = v
    return Grid(levels=table, counts=counts, continuous=np.array([entry is None for entry in given]))


def _start(terms: Integers, grid: Grid, task: Task, rng: np.random.Generator) -> Floats:
    """A random design on the levels whose information matrix is regular."""
    for _ in range(ATTEMPTS):
        draws = rng.integers(0, grid.counts, size=(task.n, len(grid.counts)))
        coded = np.take_along_axis(grid.levels.T, draws, axis=0)
        if np.isfinite(_score(coded, terms, task)):
            return coded
    raise ValueError(
        f"no design of n={task.n} runs on these levels was found that estimates the {task.terms} terms of the"
        " model: a factor needs one level more than its highest power; give more levels or a smaller"
        " model"
    )


def _rows(coded: Floats, terms: Integers) -> Floats:
    return model_matrix((coded + 1.0) / 2.0, model=terms)


def _score(coded: Floats, terms: Integers, task: Task) -> float:
    return task.inverse(_rows(coded, terms))[1]


def _climb(coded: Floats, terms: Integers, grid: Grid, task: Task) -> Floats:
    starts, columns = factor_lists(terms)
    lists = [np.flatnonzero(column) for column in terms.T]
    held_starts = np.concatenate([[0], np.cumsum([len(t) for t in lists])]).astype(np.int64)
    held = np.concatenate(lists).astype(np.int64)
    by_trace = task.criterion != "D"
    for _ in range(CLIMBS):
        x = _rows(coded, terms)
        inverse, _ = task.inverse(x)
        middle = product(product(inverse, task.moments), inverse)
        trace = float(np.sum(inverse * task.moments))
        lists_ = (starts, columns, held_starts, held, grid.levels, grid.counts)
        if kernels.climb_coordinates(coded, x, inverse, middle, trace, *lists_, by_trace, PASSES) == 0:
            break
    return coded


def _polish(coded: Floats, terms: Integers, grid: Grid, task: Task) -> Floats:
    """L-BFGS-B on the continuous coordinates; kept when it is better."""
    columns = np.flatnonzero(grid.continuous)

    def at(flat: Floats) -> Floats:
        moved = coded.copy()
        moved[:, columns] = flat.reshape(task.n, -1)
        return moved

    def cost(flat: Floats) -> tuple[float, Floats]:
        moved = at(flat)
        x = _rows(moved, terms)
        inverse, score = task.inverse(x)
        if not np.isfinite(score):
            return 1e10, np.zeros_like(flat)
        if task.criterion == "D":
            weight: Floats = -2.0 * x @ inverse
        else:
            weight = -2.0 * x @ (inverse @ task.moments @ inverse) * np.exp(score)  # of log trace
        slope = np.column_stack(
            [np.sum(weight * _derivative(moved, terms, c), axis=1) for c in columns.tolist()]
        )
        return -score, slope.ravel()

    begin = coded[:, columns].ravel()
    found = minimize(
        cost,
        begin,
        jac=True,
        method="L-BFGS-B",
        bounds=[(-1.0, 1.0)] * len(begin),
        options={"maxiter": 200, "ftol": 1e-14, "gtol": 1e-9},
    )
    moved = at(np.asarray(found.x))
    return moved if _score(moved, terms, task) > _score(coded, terms, task) else coded


def _derivative(coded: Floats, terms: Integers, c: int) -> Floats:
    """d f / d x_c of every run, (n, p)."""
    lowered = terms.copy()
    lowered[:, c] = np.maximum(terms[:, c] - 1, 0)
    starts, columns = factor_lists(lowered)
    out = np.empty((len(coded), len(terms)))
    expand(coded, starts, columns, out)
    return out * terms[:, c]
