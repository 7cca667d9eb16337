"""Runs in canonical form: what a screening sees does not depend on the order or the units of the data.

Rows are ordered by the response, inputs by the strength of their linear correlation with it, every input is
scaled to [0, 1] by its observed range, the response to mean 0 and standard deviation 1 with a non-negative
third moment. Random starts are drawn in this form: permuting rows or columns leaves the screening bit for
bit the same, and an affine change of a column or of the response changes rounding only.

A *unit* is what can be selected: one input, or a set of inputs that share one theta on request.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...kriging.diagnosis import varying

__all__ = ["CanonicalRuns", "about_unit_wide", "canonical_runs", "replicate_variance"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CanonicalRuns:
    """Runs in canonical form, with the way back.

    Attributes:
        x: (n, q) scaled inputs that vary, in the order of `columns`.
        y: (n,) standardised response.
        columns: (q,) given column of each column of x.
        labels: columns of x that hold labels.
        units: canonical columns of each unit, most correlated unit first.
        span: (q,) observed range of each column of x, 1 for labels: theta_given = theta / span^eta.
        scale: standard deviation of the given response.
        rows: (n,) given row of each row of x.
        constant: given columns that do not vary.
        repeated: pairs of given columns that are equal up to an affine change.
    """

    x: Array
    y: Array
    columns: NDArray[np.intp]
    labels: tuple[int, ...]
    units: tuple[tuple[int, ...], ...]
    span: Array
    scale: float
    rows: NDArray[np.intp]
    constant: tuple[int, ...]
    repeated: tuple[tuple[int, int], ...]

    def given_all(self, units: Sequence[int]) -> tuple[int, ...]:
        """The given columns of some units."""
        return tuple(k for unit in units for k in self.given(unit))

    def given(self, unit: int) -> tuple[int, ...]:
        """The given columns of a unit."""
        return tuple(sorted(int(self.columns[k]) for k in self.units[unit]))


def _standardised(v: Array) -> tuple[Array, float]:
    """Mean 0, standard deviation 1; sums run over sorted values: the order of rows has no effect."""
    ordered = np.sort(v)
    # 1e300 squared must not overflow
    scaled = v / max(abs(ordered[0]), abs(ordered[-1]), np.finfo(float).tiny)
    ordered = np.sort(scaled)
    mean = ordered.mean()
    sd = float(np.sqrt(np.mean((ordered - mean) ** 2)))
    factor = max(abs(v.min()), abs(v.max()), np.finfo(float).tiny)
    return (scaled - mean) / (sd or 1.0), sd * float(factor)


def about_unit_wide(x: Array, *, labels: Sequence[int] = ()) -> bool:
    """Whether the ranges of all inputs that vary lie between a tenth and ten.

    The bounds of theta are made for widths near one, and there a theta that inputs share has a meaning.

    >>> import numpy as np
    >>> x = np.array([[0.0, 5.0], [0.8, 9.0]])
    >>> about_unit_wide(x), about_unit_wide(1e9 * x)
    (True, False)
    """
    numbers = varying(x)
    numbers[list(labels)] = False
    width = np.ptp(x, axis=0)[numbers]
    return bool(((width >= 0.1) & (width <= 10.0)).all())


def canonical_runs(
    x: Array,
    y: Array,
    *,
    labels: Sequence[int] = (),
    groups: Sequence[Sequence[int]] = (),
    scaled: bool = True,
) -> CanonicalRuns:
    """Bring runs x (n, d), y (n,) into canonical form; `scaled=False` keeps the given units of x.

    >>> import numpy as np
    >>> runs = canonical_runs(np.array([[5.0, 1.0], [6.0, 3.0], [9.0, 1.0]]), np.array([1.0, 2.0, 6.0]))
    >>> runs.columns, runs.x[:, 0]
    (array([0, 1]), array([0.  , 0.25, 1.  ]))
    """
    d = x.shape[1]
    low, high = x.min(axis=0), x.max(axis=0)
    varies = varying(x)
    kept = np.flatnonzero(varies)
    label = np.zeros(d, dtype=bool)
    label[list(labels)] = True
    span = np.where(label | (not scaled), 1.0, high - low)
    unit = np.where(label, x, (x - low) / np.where(varies, high - low, 1.0))
    v, scale = _standardised(y)
    third = float(np.sum(np.sort(v**3)))
    v = -v if third < 0 else v
    centre = np.sort(np.abs(np.where(label, 0.0, unit - 0.5)), axis=1).sum(axis=1)
    rows = np.lexsort((centre, v))
    v, unit = v[rows], unit[rows]
    strength = np.zeros(d)
    for k in kept:
        if label[k]:
            _, at = np.unique(unit[:, k], return_inverse=True)
            strength[k] = np.sqrt(np.sum(np.bincount(at, v) ** 2 / np.bincount(at)) / len(v))
            continue
        c = unit[:, k] - np.sort(unit[:, k]).mean()
        r = float(c @ v) / float(np.sqrt((c @ c) * len(v)))
        strength[k] = abs(r)
        if r < 0 and scaled:
            unit[:, k] = 1.0 - unit[:, k]
    order = kept[np.argsort(-strength[kept], kind="stable")]
    place = {int(k): i for i, k in enumerate(order)}
    grouped = {int(k) for group in groups for k in group}
    sets = [tuple(sorted(place[int(k)] for k in group if int(k) in place)) for group in groups]
    sets += [(place[int(k)],) for k in order if int(k) not in grouped]
    out = unit[:, order] if scaled else np.where(label, x, x - low)[rows][:, order]
    return CanonicalRuns(
        x=np.ascontiguousarray(out),
        y=np.ascontiguousarray(v),
        columns=order.astype(np.intp),
        labels=tuple(i for i, k in enumerate(order) if label[k]),
        units=tuple(sorted((s for s in sets if s), key=lambda s: s[0])),
        span=span[order],
        scale=scale,
        rows=rows.astype(np.intp),
        constant=tuple(int(k) for k in np.flatnonzero(~varies)),
        repeated=_repeated(unit[:, order], order),
    )


def _repeated(x: Array, columns: NDArray[np.intp]) -> tuple[tuple[int, int], ...]:
    """Pairs of columns that say the same: equal, or one the mirror image of the other."""
    pairs: list[tuple[int, int]] = []
    first = x[:1]
    oriented = np.where(first > 0.5, 1.0 - x, x)
    for i, j in zip(*np.triu_indices(x.shape[1], 1), strict=True):
        if abs(oriented[0, i] - oriented[0, j]) < 1e-9 and np.allclose(
            oriented[:, i], oriented[:, j], 0, 1e-9
        ):
            a, b = sorted((int(columns[i]), int(columns[j])))
            pairs.append((a, b))
    return tuple(sorted(pairs))


def replicate_variance(runs: CanonicalRuns) -> float:
    """Variance of standardised responses of runs with equal inputs, 0 without such runs."""
    _, at, count = np.unique(runs.x, axis=0, return_inverse=True, return_counts=True)
    at = at.ravel()
    if count.max() == 1:
        return 0.0
    mean = np.bincount(at, runs.y) / count
    return float(((runs.y - mean[at]) ** 2).sum() / (count - 1).sum())
