"""D-optimal designs in the dissertation's sense, its sentence read in three ways and named apart.

"Select calibration samples from a list of I candidates ... by maximizing det(X'X)" (section 3.2, after
Mitchell 1974; Ferre & Rius 1997).

    d_optimal_select     rows of a pool of Latin hypercube points: the text; not a Latin hypercube any more
    d_optimal_within     swaps inside the columns of one Latin hypercube: stays one
    d_optimal_best_of    the best of many random Latin hypercubes: stays one, weak
"""

import numpy as np
from numpy.typing import ArrayLike

from doe.criteria.regression import (
    Floats,
    Model,
    checked,
    factor_lists,
    model_matrix,
    model_terms,
)
from doe.optimal import _kernels_within as kernels
from doe.optimal._kernels_exchange import TIE
from doe.optimal.exchange import exchange
from doe.portable.draws import splitmix_at
from doe.portable.linear import gram, inverse_root

__all__ = ["d_optimal_best_of", "d_optimal_select", "d_optimal_within"]

# swaps between two exact factorisations of X'X
REFRESH = 2000
# attempts at a start with a regular X'X, which a random Latin hypercube nearly always has
ATTEMPTS = 20


def d_optimal_select(
    n: int,
    d: int,
    *,
    model: Model = "linear",
    pool: int = 1000,
    starts: int | None = None,
    shakes: int | None = None,
    rng: np.random.Generator,
) -> Floats:
    """The n points of a Latin hypercube of `pool` points that maximise det(X'X): (n, d) in [0, 1].

    The pool has its levels at k/(pool - 1), one per stratum and the outermost on the bounds, where D-optimal
    points want to be. What comes out crowds at the corners and is no Latin hypercube; for a design that stays
    one see `d_optimal_within`. `starts` and `shakes` are those of `exchange`.

    >>> points = d_optimal_select(12, 3, pool=120, rng=np.random.default_rng(1))
    >>> points.shape, bool(np.abs(points - 0.5).mean() > 0.3)
    ((12, 3), True)

    Raises: ValueError when n is less than the model's terms, pool less than n, or the model unknown.
    """
    _check_size(n, d)
    if pool < max(n, 2):
        raise ValueError(f"pool needs at least n={n} points to choose from, and 2, got pool={pool}")
    points = _strata(pool, d, rng) / (pool - 1)
    rows = exchange(points, n, model=model, starts=starts, shakes=shakes, rng=rng)
    return points[rows]


def d_optimal_within(
    n: int,
    d: int,
    *,
    model: Model = "linear",
    swaps: int = 100_000,
    start: ArrayLike | None = None,
    rng: np.random.Generator,
) -> Floats:
    """A centred Latin hypercube improved by swaps inside its columns that raise det(X'X): (n, d) in [0, 1].

    For the linear model the ceiling is D = ((1 - 1/n^2)/3)^(d/(d+1)), reached when all columns are
    orthogonal. `swaps` is the number of swaps tried. With `start`, (n, d) points in [0, 1], the columns of
    these points are rearranged instead, whatever levels they hold; each keeps its values.

    >>> points = d_optimal_within(8, 2, swaps=1000, rng=np.random.default_rng(1))
    >>> np.sort(points[:, 0]).tolist()
    [0.0625, 0.1875, 0.3125, 0.4375, 0.5625, 0.6875, 0.8125, 0.9375]

    Raises: ValueError when n is less than the model's terms, and for a model given as a function.
    """
    _check_size(n, d)
    if callable(model):
        raise ValueError("model needs a name or a table of exponents here, got a function")
    if swaps < 0:
        raise ValueError(f"swaps needs a whole number >= 0, got {swaps}")
    terms = model_terms(model, d)
    _check_terms(n, len(terms))
    starts, columns = factor_lists(terms)
    given = None if start is None else checked(start, "start")
    if given is not None and given.shape != (n, d):
        raise ValueError(f"start needs shape ({n}, {d}), got {given.shape}")
    for turn in range(ATTEMPTS):
        if given is None:
            columns_ = (_strata(n, d, rng) + 0.5) / n
        else:
            columns_ = given if turn == 0 else rng.permuted(given, axis=0)
        coded = np.ascontiguousarray(2.0 * columns_ - 1.0)
        if _log_determinant(coded, model) > -np.inf:
            break
    else:
        raise ValueError(
            f"no arrangement of the columns of n={n} runs in {d} factors was found that estimates the"
            f" {len(terms)} terms of the model; ask for more runs, more levels or a smaller model"
        )
    state = splitmix_at(int(rng.integers(0, 2**64, dtype=np.uint64)))
    for done in range(0, swaps, REFRESH):
        x = model_matrix((coded + 1.0) / 2.0, model=model)
        root = inverse_root(gram(x))
        if root is None:
            raise ValueError("the model became singular on these columns; give columns with more levels")
        inverse = gram(root)
        kernels.swap_columns(coded, x, inverse, starts, columns, state, min(REFRESH, swaps - done))
    values = (np.arange(n)[:, None] + 0.5) / n if given is None else np.sort(given, axis=0)
    rank = np.argsort(np.argsort(coded, axis=0, kind="stable"), axis=0, kind="stable")
    return np.ascontiguousarray(np.take_along_axis(np.broadcast_to(values, (n, d)), rank, axis=0))


def d_optimal_best_of(
    n: int, d: int, *, model: Model = "linear", tries: int = 1000, rng: np.random.Generator
) -> Floats:
    """The best of `tries` random centred Latin hypercubes by det(X'X): (n, d) in [0, 1].

    The weakest reading; it is here to be compared with.

    >>> d_optimal_best_of(9, 2, tries=20, rng=np.random.default_rng(1)).shape
    (9, 2)

    Raises: ValueError when n is less than the model's terms.
    """
    _check_size(n, d)
    if tries < 1:
        raise ValueError(f"tries needs a whole number >= 1, got {tries}")
    best, score = np.zeros((n, d)), -np.inf
    for turn in range(tries):
        points = (_strata(n, d, rng) + 0.5) / n
        if turn == 0:
            _check_terms(n, model_matrix(points, model=model).shape[1])
        now = _log_determinant(2.0 * points - 1.0, model)
        if now > score + TIE or turn == 0:
            best, score = points, now
    return best


def _strata(n: int, d: int, rng: np.random.Generator) -> Floats:
    """A random permutation of 0..n-1 in every column."""
    return np.ascontiguousarray(rng.permuted(np.tile(np.arange(n, dtype=float), (d, 1)), axis=1).T)


def _log_determinant(coded: Floats, model: Model) -> float:
    x = model_matrix((coded + 1.0) / 2.0, model=model)
    triangle = np.abs(np.diag(np.linalg.qr(x, mode="r")))
    return 2.0 * float(np.log(triangle).sum()) if triangle.min() > 1e-9 * triangle.max() else -np.inf


def _check_size(n: int, d: int) -> None:
    if n < 1 or d < 1:
        raise ValueError(f"n and d need whole numbers >= 1, got n={n} and d={d}")


def _check_terms(n: int, p: int) -> None:
    if n < p:
        raise ValueError(f"n={n} runs cannot estimate the {p} terms of the model; ask for n >= {p}")
