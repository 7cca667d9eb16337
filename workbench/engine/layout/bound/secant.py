"""Second derivatives learnt from gradients: a separable prior corrected by symmetric rank-one updates.

The prior of a row that behaves like sum c_i/(x_i - l_i) is D = 2 |g|/(x - l), for a compliance an upper bound
of the Hessian (minimum of complementary energy at fixed forces). Scaled by it a compliance has the Hessian

    D^(-1/2) H D^(-1/2) = a projection,   eigenvalues 0 and 1

which changes far less along a path than H itself. Pairs of moves and changes of the gradient are therefore
scaled by the prior at their own place and used at the present one. SR1 (Conn, Gould and Toint 1991) needs no
curvature condition and, below an upper bound, stays below it; eigenvalues are kept above a floor.
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

__all__ = ["Curvature", "SecantMemory"]

Array = NDArray[np.float64]

_PAIRS, _MOVES = 150, 150  # pairs of moves and rows that are used, and moves remembered
_FEWEST = 25  # moves used of each row at least
_LIGHT = 1e-4  # of the largest weight: rows below it have no curvature
_NOTHING = 1e-8  # shift of an eigenvalue that is rounding
_FLOOR = 0.01  # smallest eigenvalue in the scale of the prior
_ANGLE = 1e-2  # updates whose correction is nearly orthogonal to the move say nothing
_FAINT = 0.01  # of the largest derivative: where slopes vanish the prior would know no curvature


@dataclass(frozen=True, slots=True, kw_only=True)
class Curvature:
    """diag(diagonal) + columns diag(signs) columns', positive definite: (n,), (n, k), (k,)."""

    diagonal: Array
    columns: Array
    signs: Array

    def times(self, step: Array) -> Array:
        """The product with a vector (n,).

        >>> import numpy as np
        >>> two = Curvature(diagonal=np.ones(2), columns=np.array([[0.5], [0.5]]), signs=np.array([-1.0]))
        >>> two.times(np.array([1.0, 1.0]))
        array([0.5, 0.5])
        """
        return np.asarray(
            self.diagonal * step + self.columns @ (self.signs * (self.columns.T @ step)), dtype=float
        )


def _prior(distance: Array, gradient: Array) -> Array:
    size = np.abs(gradient)
    return np.asarray(2 * np.maximum(size, max(_FAINT * float(size.max()), 1e-300)) / distance)


@dataclass(slots=True, kw_only=True)
class SecantMemory:
    """Moves between evaluated points: distances from the lower bounds (n,) and gradients (rows, n) at both
    ends."""

    moves: list[tuple[Array, Array, Array, Array]] = field(default_factory=list)

    def add(self, here: Array, gradients: Array, there: Array, gradients_there: Array) -> None:
        """Remember a move from here to there, both as distances from the lower bounds."""
        self.moves.append((here, gradients, there, gradients_there))
        del self.moves[:-_MOVES]

    def curvature(self, distance: Array, gradients: Array, weights: Array) -> Curvature:
        """Of the weighted sum of the rows at a distance (n,) from the lower bounds.

        Each row that weighs is learnt by itself: a move says something of every one of them, and in the scale
        of its own prior each is nearly a projection, while their sum is not.
        """
        heavy = np.flatnonzero(weights > _LIGHT * weights.max())
        kept = max(_PAIRS // len(heavy), _FEWEST)
        parts = [
            _learnt([_scaled(move, row) for move in self.moves[-kept:]], _prior(distance, gradients[row]))
            for row in heavy
        ]
        return Curvature(
            diagonal=np.sum([w * c.diagonal for w, c in zip(weights[heavy], parts, strict=True)], axis=0),
            columns=np.hstack([
                np.sqrt(w) * c.columns for w, c in zip(weights[heavy], parts, strict=True)
            ]),
            signs=np.concatenate([c.signs for c in parts]),
        )  # fmt: skip


def _learnt(pairs: list[tuple[Array, Array]], prior: Array) -> Curvature:
    """Of one row: the prior (n,) corrected by the pairs in its scale."""
    pairs = [(s, y) for s, y in pairs if np.isfinite(s).all() and np.isfinite(y).all()]
    if not pairs:
        return Curvature(diagonal=prior, columns=np.zeros((len(prior), 0)), signs=np.zeros(0))
    S, Y = (np.array(part).T for part in zip(*pairs, strict=True))
    # a row that bends more than the prior allows raises it as a whole
    stiff = max(1.0, float((S * Y).sum(0).max()))
    basis, small = scipy.linalg.qr(np.hstack([S, Y]), mode="economic", check_finite=False)
    k = S.shape[1]
    values, vectors = np.linalg.eigh(_rank_one_updates(small[:, :k], small[:, k:] / stiff))
    shift = np.maximum(values, _FLOOR) - 1.0
    heavy = np.abs(shift) > _NOTHING
    columns = basis @ (vectors[:, heavy] * np.sqrt(stiff * np.abs(shift[heavy])))
    return Curvature(
        diagonal=stiff * prior, columns=np.sqrt(prior)[:, None] * columns, signs=np.sign(shift[heavy])
    )


def _scaled(move: tuple[Array, Array, Array, Array], row: np.intp) -> tuple[Array, Array]:
    """Move and change of a row's gradient in the scale of the prior half way, the move of length 1."""
    here, gradients, there, gradients_there = move
    before, after = gradients[row], gradients_there[row]
    both = np.sqrt(np.abs(before * after))
    root = np.sqrt(_prior(np.sqrt(here * there), both))
    s, y = root * (there - here), (after - before) / root
    length = np.linalg.norm(s)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(s / length), np.asarray(y / length)


def _rank_one_updates(S: Array, Y: Array) -> Array:
    """SR1 from the identity, oldest pair first, in the coordinates of the pairs' own space."""
    H = np.eye(len(S))
    for s, y in zip(S.T, Y.T, strict=True):
        off = y - H @ s
        along = float(off @ s)
        if abs(along) > _ANGLE * float(np.linalg.norm(off) * np.linalg.norm(s)):
            H += np.outer(off, off) / along
    return H
