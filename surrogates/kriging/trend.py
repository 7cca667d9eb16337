"""Trends of a Kriging model: polynomial terms of at most degree two, or a function of the user.

A term is a tuple of columns: `()` is the constant, `(k,)` is x_k, `(k, l)` is x_k x_l. Terms that the runs
cannot tell from earlier ones (a constant or repeated column, the square of a two-level input) are left out.
"""

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

__all__ = ["TRENDS", "TrendFunction", "basis", "independent", "term_name", "terms"]

TRENDS = ("constant", "linear", "interactions", "quadratic")
TrendFunction = Callable[[NDArray[np.float64]], NDArray[np.float64]]
Term = tuple[int, ...]


def terms(trend: str, d: int, *, labels: Sequence[int] = ()) -> list[Term]:
    """The terms of a named trend over d inputs; inputs that are labels have none.

    >>> terms("interactions", 2)
    [(), (0,), (1,), (0, 1)]
    """
    if trend not in TRENDS:
        raise ValueError(f"trend needs one of {', '.join(TRENDS)} or a function of X, got {trend!r}")
    columns = [k for k in range(d) if k not in set(labels)]
    found: list[Term] = [()]
    if trend != "constant":
        found += [(k,) for k in columns]
    if trend in ("interactions", "quadratic"):
        found += list(combinations(columns, 2))
    if trend == "quadratic":
        found += [(k, k) for k in columns]
    return found


def term_name(term: Term) -> str:
    """How a term is written in a diagnosis.

    >>> [term_name(t) for t in [(), (2,), (0, 1), (1, 1)]]
    ['1', 'x2', 'x0*x1', 'x1^2']
    """
    if not term:
        return "1"
    if len(term) == 2 and term[0] == term[1]:
        return f"x{term[0]}^2"
    return "*".join(f"x{k}" for k in term)


def basis(x: NDArray[np.float64], terms: Sequence[Term]) -> NDArray[np.float64]:
    """F, the terms at the rows of x (m, d): (m, p)."""
    f = np.ones((len(x), len(terms)))
    for column, term in enumerate(terms):
        for k in term:
            f[:, column] *= x[:, k]
    return f


def independent(f: NDArray[np.float64], *, tolerance: float = 1e-9) -> list[int]:
    """Columns of F that are not a combination of earlier ones (Gram-Schmidt, twice, in the order given)."""
    n, p = f.shape
    kept: list[int] = []
    q = np.empty((n, min(n, p)))
    for k in range(p):
        column = f[:, k]
        size = float(np.linalg.norm(column))
        for _ in range(2):
            column = column - q[:, : len(kept)] @ (q[:, : len(kept)].T @ column)
        rest = float(np.linalg.norm(column))
        if rest > tolerance * size and len(kept) < n:
            q[:, len(kept)] = column / rest
            kept.append(k)
    return kept
