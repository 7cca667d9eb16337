"""Regression models of a design and the efficiencies that judge a design for them.

Notation (Atkinson, Donev & Tobias 2007): n runs in d factors; X the (n, p) model matrix of the runs coded to
[-1, 1], x = 2 u - 1 for a point u of the unit cube; M = X'X; v(x) = f(x)' M^-1 f(x) the variance of a
predicted mean in units of the error variance; B the mean of f f' over the cube.

    D = |M|^(1/p) / n        A = p / (n trace M^-1)        I = p / (n trace M^-1 B)        G = p / (n max v)

D, A and G are at most 1 on the cube; I counts in runs spread evenly over the cube, so it may pass 1.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular
from scipy.stats import qmc

from doe.criteria._kernels_model_rows import expand

__all__ = [
    "MODELS",
    "Model",
    "a_efficiency",
    "d_efficiency",
    "g_efficiency",
    "i_efficiency",
    "model_matrix",
    "model_terms",
    "moment_matrix",
    "variance_inflation",
]

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Model: TypeAlias = str | ArrayLike | Callable[[Floats], ArrayLike]
"""A name of `MODELS`, a (p, d) table of exponents, or a function from coded points (n, d) to X (n, p)."""

MODELS = ("linear", "interactions", "quadratic")

# trace and determinant of a matrix with a larger condition number than this are rounding errors
CONDITION = 1e13
# squared share of a column in the null space above which it takes part in a linear dependence
DEPENDENT = 1e-9
# points of the cube on which the mean of a model given as a function is taken, and starts of the G search
SPREAD = 4096
PEAKS = 8


def model_terms(model: str | ArrayLike, d: int) -> Integers:
    """Exponents of the model's terms, (p, d): one row per term, one column per factor.

    linear: 1 and x_i; interactions: also x_i x_j; quadratic: also x_i^2. A table of exponents is checked and
    handed back.

    >>> model_terms("interactions", 2).tolist()
    [[0, 0], [1, 0], [0, 1], [1, 1]]

    Raises: ValueError for an unknown name or a table that is not (p, d) whole numbers >= 0.
    """
    if d < 1:
        raise ValueError(f"d needs a whole number of factors >= 1, got {d}")
    if isinstance(model, str):
        if model not in MODELS:
            raise ValueError(f"model needs one of {', '.join(MODELS)} or a table of exponents, got {model!r}")
        single = np.eye(d, dtype=np.int64)
        first, second = np.triu_indices(d, 1)
        blocks = [np.zeros((1, d), dtype=np.int64), single]
        if model != "linear":
            blocks.append(single[first] + single[second])
        if model == "quadratic":
            blocks.append(2 * single)
        return np.vstack(blocks)
    table = np.asarray(model)
    if table.ndim != 2 or table.shape[1] != d or table.shape[0] == 0:
        raise ValueError(f"model as a table of exponents needs shape (terms, {d}), got {table.shape}")
    whole = table.astype(np.int64)
    if not np.array_equal(whole, table) or whole.min() < 0:
        raise ValueError("model as a table of exponents needs whole numbers >= 0")
    if len(np.unique(whole, axis=0)) < len(whole):
        raise ValueError("model as a table of exponents needs each term once, a row is repeated")
    return whole


def lists_of(model: str | ArrayLike, d: int) -> tuple[Integers, Integers]:
    """`factor_lists` of a model; those of the named models are kept, a small design would notice."""
    return _named_lists(model, d) if isinstance(model, str) else factor_lists(model_terms(model, d))


@lru_cache(maxsize=64)
def _named_lists(model: str, d: int) -> tuple[Integers, Integers]:
    return factor_lists(model_terms(model, d))


def factor_lists(terms: Integers) -> tuple[Integers, Integers]:
    """Terms as lists of columns to multiply: `columns[starts[t]:starts[t + 1]]` for term t."""
    columns = [np.repeat(np.arange(terms.shape[1]), row) for row in terms]
    starts = np.concatenate([[0], np.cumsum([len(c) for c in columns])])
    return starts.astype(np.int64), np.concatenate([*columns, [0]]).astype(np.int64)


def checked(points: ArrayLike, name: str = "points") -> Floats:
    """The (n, d) array of a design, C-contiguous.

    Raises: ValueError when it is not two-dimensional, empty, or holds NaN or infinity.
    """
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"{name} needs shape (runs, factors) with at least one of each, got {array.shape}")
    bad = ~np.isfinite(array).all(axis=1)
    if bad.any():
        raise ValueError(
            f"{name} needs finite numbers, row {int(bad.argmax())} holds NaN or infinity"
            f" ({int(bad.sum())} such rows); remove them"
        )
    return array


def model_matrix(points: ArrayLike, *, model: Model = "linear") -> Floats:
    """X of the model: (n, p) for points (n, d) of the unit cube, coded to x = 2 u - 1.

    >>> model_matrix([[0.0, 1.0], [0.75, 0.5]], model="quadratic")
    array([[ 1.  , -1.  ,  1.  , -1.  ,  1.  ,  1.  ],
           [ 1.  ,  0.5 ,  0.  ,  0.  ,  0.25,  0.  ]])

    Raises: ValueError for points that are not finite (n, d) and for an unknown model.
    """
    array = checked(points)
    if callable(model):
        return _columns(model, array)
    starts, columns = lists_of(model, array.shape[1])
    x = np.empty((len(array), starts.size - 1))
    expand(2.0 * array - 1.0, starts, columns, x)
    return x


def _columns(model: Callable[[Floats], ArrayLike], points: Floats) -> Floats:
    x = np.ascontiguousarray(model(2.0 * points - 1.0), dtype=np.float64)
    if x.ndim != 2 or len(x) != len(points) or not np.isfinite(x).all():
        raise ValueError(
            f"model as a function needs finite columns ({len(points)}, terms), got shape {x.shape}"
        )
    return x


def moment_matrix(model: Model, d: int) -> Floats:
    """B, the mean of f f' over the unit cube, (p, p).

    Exact for named models and tables of exponents (the mean of x^k is 1/(k + 1) for even k, else 0); for a
    function, the mean over 4096 Sobol' points.

    >>> moment_matrix("linear", 1).round(4)
    array([[1.    , 0.    ],
           [0.    , 0.3333]])
    """
    if callable(model):
        x = _columns(model, _spread(d))
        return x.T @ x / len(x)
    terms = model_terms(model, d)
    moments = np.ones((len(terms), len(terms)))
    for column in terms.T:
        power = column[:, None] + column
        moments *= np.where(power % 2 == 0, 1.0 / (power + 1), 0.0)
    return moments


def d_efficiency(points: ArrayLike, *, model: Model = "linear") -> float:
    """D = |X'X|^(1/p) / n on [-1, 1]: 1 for an orthogonal two-level design, 0 when it is singular.

    >>> corners = [[0, 0], [0, 1], [1, 0], [1, 1]]
    >>> round(d_efficiency(corners, model="interactions"), 12)
    1.0
    """
    x = model_matrix(points, model=model)
    n, p = x.shape
    sign, log_determinant = np.linalg.slogdet(x.T @ x)
    return float(np.exp(log_determinant / p) / n) if sign > 0 and n >= p else 0.0


def a_efficiency(points: ArrayLike, *, model: Model = "linear") -> float:
    """A = p / (n trace (X'X)^-1) on [-1, 1]; 0 when a term cannot be estimated.

    >>> round(a_efficiency([[0.0], [0.5], [1.0]]), 4)
    0.8
    """
    x = model_matrix(points, model=model)
    half = _inverse_factor(x)
    return 0.0 if half is None else float(x.shape[1] / (len(x) * np.sum(half**2)))


def i_efficiency(points: ArrayLike, *, model: Model = "linear") -> float:
    """I = p / (n trace (X'X)^-1 B): p over n times the prediction variance averaged over the cube.

    >>> round(i_efficiency([[0.0], [1.0]]), 4)
    1.5
    """
    x = model_matrix(points, model=model)
    half = _inverse_factor(x)
    if half is None:
        return 0.0
    moments = moment_matrix(model, np.shape(points)[1])
    return float(x.shape[1] / (len(x) * np.trace(half @ moments @ half.T)))


def g_efficiency(points: ArrayLike, *, model: Model = "linear") -> float:
    """G = p / (n max v) with the maximum of the prediction variance over the cube.

    The maximum is searched from 4096 Sobol' points and the runs, coordinate by coordinate; what is found is
    at most the true one, so G is an upper bound.

    >>> round(g_efficiency([[0, 0], [0, 1], [1, 0], [1, 1]]), 12)
    1.0
    """
    array = checked(points)
    x = model_matrix(array, model=model)
    half = _inverse_factor(x)
    if half is None:
        return 0.0

    def variance(u: Floats) -> Floats:
        return np.asarray(np.sum((model_matrix(u, model=model) @ half.T) ** 2, axis=1))

    start = np.vstack([array, _spread(array.shape[1])])
    peaks = start[np.argsort(-variance(start), kind="stable")[:PEAKS]]
    grid = np.linspace(0.0, 1.0, 21)
    for _ in range(3):
        for column in range(array.shape[1]):
            trial = np.repeat(peaks[:, None, :], len(grid), axis=1)
            trial[:, :, column] = grid
            trial = np.concatenate([trial, peaks[:, None, :]], axis=1)
            height = variance(trial.reshape(-1, array.shape[1])).reshape(trial.shape[:2])
            peaks = trial[np.arange(len(peaks)), height.argmax(axis=1)]
    return float(x.shape[1] / (len(x) * variance(peaks).max()))


def variance_inflation(points: ArrayLike, *, model: Model = "linear") -> Floats:
    """Variance inflation factor of every term after the constant, (p - 1,): 1 for an orthogonal design.

    The diagonal of the inverse correlation matrix of the model's columns; infinite for a column that the
    others determine and for one that is constant on the design.

    >>> variance_inflation([[0, 0], [0, 1], [1, 0], [1, 1]]).tolist()
    [1.0, 1.0]
    """
    x = model_matrix(points, model=model)
    flat = np.flatnonzero(np.ptp(x, axis=0) == 0.0)
    x = np.delete(x, flat[:1], axis=1)
    flat = flat[1:] - 1
    centred = x - x.mean(axis=0)
    centred[:, flat] = 0.0
    scale = np.sqrt((centred**2).sum(axis=0))
    z = centred / np.where(scale > 0.0, scale, 1.0)
    eigenvalues, vectors = np.linalg.eigh(z.T @ z)
    lost = eigenvalues * CONDITION <= eigenvalues[-1]
    factors = np.asarray(np.sum(vectors[:, ~lost] ** 2 / eigenvalues[~lost], axis=1))
    factors[np.sum(vectors[:, lost] ** 2, axis=1) > DEPENDENT] = np.inf
    return factors


def _inverse_factor(x: Floats) -> Floats | None:
    """L^-1 with X'X = L L', from the triangle of a QR decomposition; None when the columns are dependent."""
    if len(x) < x.shape[1]:
        return None
    triangle = np.linalg.qr(x, mode="r")
    diagonal = np.abs(np.diag(triangle))
    if diagonal.min() * CONDITION <= diagonal.max():
        return None
    return np.asarray(solve_triangular(triangle, np.eye(len(triangle)), trans="T"))


def _spread(d: int) -> Floats:
    return np.asarray(qmc.Sobol(d, scramble=False).random(SPREAD), dtype=np.float64)
