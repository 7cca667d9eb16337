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

_PAIRS = 60  # moves remembered
_FLOOR = 0.01  # smallest eigenvalue in the scale of the prior
_ANGLE = 1e-2  # updates whose correction is nearly orthogonal to the move say nothing
_FAINT = 0.1  # of the largest derivative: where slopes vanish the prior would know no curvature


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
        del self.moves[:-_PAIRS]

    def curvature(self, distance: Array, gradients: Array, weights: Array) -> Curvature:
        """Of the weighted sum of the rows at a distance (n,) from the lower bounds."""
        root = np.sqrt(_prior(distance, weights @ gradients))
        pairs = [self._scaled(move, weights) for move in self.moves]
        pairs = [(s, y) for s, y in pairs if np.isfinite(s).all() and np.isfinite(y).all()]
        if not pairs:
            n = len(distance)
            return Curvature(diagonal=root**2, columns=np.zeros((n, 0)), signs=np.zeros(0))
        S, Y = (np.array(part).T for part in zip(*pairs, strict=True))
        # rows that bend more than the prior allows raise it as a whole
        stiff = max(1.0, float((S * Y).sum(0).max()))
        basis, small = scipy.linalg.qr(np.hstack([S, Y]), mode="economic", check_finite=False)
        k = S.shape[1]
        values, vectors = np.linalg.eigh(_rank_one_updates(small[:, :k], small[:, k:] / stiff))
        shift = np.maximum(values, _FLOOR) - 1.0
        heavy = np.abs(shift) > 1e-8
        columns = basis @ (vectors[:, heavy] * np.sqrt(stiff * np.abs(shift[heavy])))
        return Curvature(
            diagonal=stiff * root**2, columns=root[:, None] * columns, signs=np.sign(shift[heavy])
        )

    @staticmethod
    def _scaled(move: tuple[Array, Array, Array, Array], weights: Array) -> tuple[Array, Array]:
        """Move and change of gradient in the scale of the prior half way, the move of length 1."""
        here, gradients, there, gradients_there = move
        before, after = weights @ gradients, weights @ gradients_there
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
