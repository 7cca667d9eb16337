"""Runs as a fit sees them: inputs in a box of width 1, responses of unit spread."""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import NotPositiveDefinite, TooFewRuns
from .diagnosis import varying
from .posterior import Scaling, TrendBasis
from .trend import (
    TrendFunction,
    independent,
    term_name,
    terms,
)

__all__ = ["Runs", "not_positive_definite", "prepare"]

Array = NDArray[np.float64]

DEGENERATE = 1e-11  # residual of the trend relative to the spread of y


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Prepared runs.

    Attributes:
        ids: (n,) run ids.   observed: (n,) responses as given.
        u: (n, d) scaled inputs.   f: (n, p) trend at the runs.   z: (n, 1) scaled responses.
        scaling, trend: from the coordinates of X to u and F.   labels: label columns.
        back: (p, p) M with F in the coordinates of X = F M.
        term_names, dropped: trend terms kept and left out.
        shift, scale: response = shift + scale * z.
        degenerate: the trend reproduces the response.
    """

    ids: tuple[Hashable, ...]
    observed: Array
    u: Array
    f: Array
    z: Array
    scaling: Scaling
    trend: TrendBasis
    labels: tuple[int, ...]
    back: Array
    term_names: tuple[str, ...]
    dropped: tuple[str, ...]
    shift: float
    scale: float
    degenerate: bool


def prepare(
    x: Array,
    y: Array,
    *,
    trend: str | TrendFunction,
    labels: tuple[int, ...],
    ids: tuple[Hashable, ...],
) -> Runs:
    """Scale runs x (n, d), y (n,), and build the trend. Raises TooFewRuns."""
    n = len(x)
    if n < 2:
        raise TooFewRuns(f"kriging needs at least 2 runs, got n_samples = {n}: add runs")
    scaling = _box(x, labels)
    u = scaling(x)
    still = ~varying(x)
    u[:, still] = u[0, still]  # digits of rounding size are no values
    basis, f, back, names, dropped = _trend(trend, u, x, labels)
    if n <= f.shape[1]:
        what = repr(trend) if isinstance(trend, str) else "function"
        raise TooFewRuns(
            f"trend {what} has {f.shape[1]} terms and needs at least {f.shape[1] + 1} runs, got {n}: "
            "choose a smaller trend (constant, linear) or add runs"
        )
    shift, scale = _spread(y, shifted=not callable(trend))
    z = ((y - shift) / scale)[:, None]
    residual = z - f @ np.linalg.lstsq(f, z, rcond=None)[0]
    return Runs(
        ids=ids,
        observed=y,
        u=u,
        f=f,
        z=z,
        scaling=scaling,
        trend=basis,
        labels=labels,
        back=back,
        term_names=names,
        dropped=dropped,
        shift=shift,
        scale=scale,
        degenerate=bool(np.abs(residual).max() <= DEGENERATE * max(1.0, float(np.abs(z).max()))),
    )


def _box(x: Array, labels: tuple[int, ...]) -> Scaling:
    low, width = x.min(axis=0), np.where(varying(x), np.ptp(x, axis=0), 1.0)
    low[list(labels)], width[list(labels)] = -0.5, 1.0
    return Scaling(low=low, width=width)


def _spread(y: Array, *, shifted: bool) -> tuple[float, float]:
    """Mean (a constant is in every named trend) and spread; a constant response keeps its own size."""
    shift = float(y.mean()) if shifted else 0.0
    scale = float(np.sqrt(np.mean((y - shift) ** 2)))
    size = float(np.abs(y).max())
    if scale <= 1e-14 * size:
        scale = size or 1.0
    return shift, scale


def _trend(
    trend: str | TrendFunction, u: Array, x: Array, labels: tuple[int, ...]
) -> tuple[TrendBasis, Array, Array, tuple[str, ...], tuple[str, ...]]:
    n = len(u)
    if callable(trend):
        raw = np.asarray(trend(x), dtype=np.float64)
        if raw.ndim != 2 or len(raw) != n:
            raise ValueError(f"trend function needs to return an array of shape ({n}, p), got {raw.shape}")
        if not np.isfinite(raw).all():
            raise ValueError("trend function needs to return finite numbers at the runs")
        kept = independent(raw)
        size = np.linalg.norm(raw[:, kept], axis=0) / np.sqrt(n)
        basis = TrendBasis(function=trend, columns=tuple(kept), size=size)
        dropped = tuple(f"f{k}" for k in range(raw.shape[1]) if k not in kept)
        return basis, basis(u, x), np.diag(size), tuple(f"f{k}" for k in kept), dropped
    wanted = terms(trend, u.shape[1], labels=labels)
    f = TrendBasis(terms=tuple(wanted))(u, x)
    if len(wanted) == 1 or len(wanted) >= n:  # too many terms: refused by the caller
        return TrendBasis(terms=tuple(wanted)), f, np.eye(1), tuple(map(term_name, wanted)), ()
    kept = independent(f)
    chosen = tuple(wanted[k] for k in kept)
    dropped = tuple(term_name(t) for k, t in enumerate(wanted) if k not in kept)
    back = _change_of_basis(f[:, kept], TrendBasis(terms=chosen)(x, x))
    return TrendBasis(terms=chosen), f[:, kept], back, tuple(map(term_name, chosen)), dropped


def _change_of_basis(scaled: Array, raw: Array) -> Array:
    """M with raw = scaled M, columns of raw brought to one size first."""
    size = np.linalg.norm(raw, axis=0)
    return np.asarray(np.linalg.lstsq(scaled, raw / size, rcond=None)[0] * size)


def not_positive_definite(runs: Runs, nugget: float) -> NotPositiveDefinite:
    """The error for runs that are too close, naming the closest pair."""
    best = (0, 1, np.inf)
    for i in range(len(runs.u) - 1):
        distance = np.sqrt(((runs.u[i + 1 :] - runs.u[i]) ** 2).sum(axis=1))
        j = int(distance.argmin())
        if distance[j] < best[2]:
            best = (i, i + 1 + j, float(distance[j]))
    a, b = runs.ids[best[0]], runs.ids[best[1]]
    return NotPositiveDefinite(
        f"correlation matrix is not positive definite: runs {a} and {b} are {best[2]:.1g} apart in the box "
        f"of the runs. Remove one, or set nugget={max(100 * nugget, 1e-8):.0e}"
    )
