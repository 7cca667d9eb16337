"""Second derivatives learnt from gradients: a separable prior corrected by symmetric rank-one updates.

The prior of a row that behaves like sum c_i/(x_i - l_i) is D = 2 |g|/(x - l), for a compliance an upper bound
of the Hessian (minimum of complementary energy at fixed forces). Scaled by it a compliance has the Hessian

    D^(-1/2) H D^(-1/2) = a projection,   eigenvalues 0 and 1

which changes far less along a path than H itself. Pairs of moves and changes of the gradient are therefore
scaled by the prior at their own place and used at the present one. SR1 (Conn, Gould and Toint 1991) needs no
curvature condition; eigenvalues are kept above a floor.

A projection leaves what it has made of a move, so a change of the gradient is a direction of eigenvalue 1:
two directions are learnt of each move. Its rank is far below the number of members. In directions that no
move has taught the prior is therefore taken with the share that recent moves met where they were new. Rows
whose changes do not look like projections keep the prior, and one direction of each move.
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from .barrier import ModelledRows

__all__ = ["Curvature", "SecantMemory", "SecantModel"]

Array = NDArray[np.float64]

_PAIRS, _MOVES = 150, 150  # pairs of moves and rows that are used, and moves remembered
_FEWEST = 25  # moves used of each row at least
_NUMBERS = 2.5e6  # in a table of moves: fewer of them are used where there are many members
_LIGHT = 1e-4  # of the largest weight: rows below it have no curvature
_NOTHING = 1e-8  # shift of an eigenvalue that is rounding
_FLOOR = 0.01  # smallest eigenvalue in the scale of the prior
_UNTAUGHT = 0.7  # share of the prior before any move: it bounds the curvature of a falling row from above
_RECENT, _MORE, _LEAST = 5, 1.2, 0.05  # moves that the share of new directions follows, its factor and floor
_NEW = 1e-4  # part of a move, squared, that counts as new
_PROJECTED = 0.3  # how far the curvature along a change may be from the whole prior
_SHORT = 1e-6  # change, for a move of length 1, that says nothing
_ANGLE = 1e-2  # updates whose correction is nearly orthogonal to the move say nothing
_STIFFEN, _RELAX = 4.0, 0.5  # of the curvature after a refused and after an accepted step
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
    ends; and, by row, the share of the prior with which directions bent that no move had taught."""

    moves: list[tuple[Array, Array, Array, Array]] = field(default_factory=list)
    shares: dict[int, float] = field(default_factory=dict)

    def add(self, here: Array, gradients: Array, there: Array, gradients_there: Array) -> None:
        """Remember a move from here to there, both as distances from the lower bounds."""
        self.moves.append((here, gradients, there, gradients_there))
        del self.moves[:-_MOVES]

    def curvature(
        self, distance: Array, gradients: Array, weights: Array, *, stiffness: float = 1.0
    ) -> Curvature:
        """Of the weighted sum of the rows at a distance (n,) from the lower bounds.

        Each row that weighs is learnt by itself: a move says something of every one of them, and in the scale
        of its own prior each is nearly a projection, while their sum is not.

        stiffness: factor of what is not known, and of all that would bend less than this then.
        """
        heavy = np.flatnonzero(weights > _LIGHT * weights.max())
        pairs = min(_PAIRS, max(_FEWEST, int(_NUMBERS / len(distance))))
        kept = max(pairs // len(heavy), min(_FEWEST, pairs // 3))
        parts = []
        for row in heavy:
            known = [_scaled(move, row) for move in self.moves[-kept:]]
            prior = _prior(distance, gradients[row])
            part, share = _learnt(known, prior, self.shares.get(int(row), 1.0), stiffness)
            self.shares[int(row)] = share
            parts.append(part)
        return Curvature(
            diagonal=np.sum([w * c.diagonal for w, c in zip(weights[heavy], parts, strict=True)], axis=0),
            columns=np.hstack([
                np.sqrt(w) * c.columns for w, c in zip(weights[heavy], parts, strict=True)
            ]),
            signs=np.concatenate([c.signs for c in parts]),
        )  # fmt: skip


@dataclass(slots=True, kw_only=True)
class SecantModel:
    """Linear rows at the design where it was placed, with the learnt curvature of their weighted sum.

    free (members,): those that may change    lower (members,)    memory: of moves, kept by the path
    """

    free: NDArray[np.bool_]
    lower: Array
    memory: SecantMemory
    stiff: float = 1.0
    x: Array = field(default_factory=lambda: np.zeros(0))
    values: Array = field(default_factory=lambda: np.zeros(0))
    slopes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    curvature: Curvature | None = None

    def place(self, x: Array, values: Array, gradients: Array, weights: Array) -> None:
        """At a design (members,): values (r,) and gradients (r, members) there, weights (r,) of the sum."""
        self.x, self.values, self.slopes = x, values, gradients[:, self.free]
        distance = (x - self.lower)[self.free]
        self.curvature = self.memory.curvature(distance, self.slopes, weights, stiffness=self.stiff)

    def at(self, step: Array, weights: Array) -> ModelledRows:
        """After a step (n,) of the free members; the weights are those of the place."""
        assert self.curvature is not None
        return ModelledRows(
            values=self.values + self.slopes @ step, slopes=self.slopes, diagonal=self.curvature.diagonal,
            columns=self.curvature.columns, signs=self.curvature.signs, slope=self.curvature.times(step),
        )  # fmt: skip

    def learn(self, trial: Array, values: Array, gradients: Array, *, taken: bool) -> bool:
        """Moves are in the memory. Any rows will do."""
        return True

    def stiffen(self) -> bool:
        """More curvature."""
        self.stiff *= _STIFFEN
        return True

    def relax(self) -> None:
        """Half of the way back."""
        self.stiff = max(1.0, _RELAX * self.stiff)


def _learnt(
    pairs: list[tuple[Array, Array]], prior: Array, share: float, stiffness: float
) -> tuple[Curvature, float]:
    """Of one row: the prior (n,) corrected by the pairs in its scale, and the share of the prior with which
    directions bend that no move has taught."""
    pairs = [(s, y) for s, y in pairs if np.isfinite(s).all() and np.isfinite(y).all()]
    if not pairs:
        raised = max(_UNTAUGHT, _UNTAUGHT * stiffness)
        return Curvature(diagonal=raised * prior, columns=np.zeros((len(prior), 0)), signs=np.zeros(0)), share
    both = np.column_stack([part for pair in pairs for part in pair])
    # a row that bends more than the prior allows raises it as a whole
    stiff = max(1.0, float((both[:, 0::2] * both[:, 1::2]).sum(0).max()))
    basis, small = (
        np.asarray(part, dtype=float) for part in scipy.linalg.qr(both, mode="economic", check_finite=False)
    )
    small[:, 1::2] /= stiff
    if np.mean([_is_projected(s, y) for s, y in pairs[-_RECENT:]]) >= 0.5:
        met = _rank_one_updates(small, share)[1][-_RECENT:]
        share = float(np.clip(_MORE * max(met, default=1.0), _LEAST, 1.0))
        unknown, most, scale = min(share * stiffness, 1.0), 1.0, stiff * max(1.0, share * stiffness)
        hessian, _ = _rank_one_updates(small, unknown)
    else:
        share, unknown, most, scale = 1.0, 1.0, np.inf, stiff * _UNTAUGHT * max(1.0, stiffness)
        hessian, _ = _rank_one_updates(small, unknown, twice=False)
    values, vectors = np.linalg.eigh(hessian)
    shift = np.clip(values, _FLOOR, most) - unknown
    heavy = np.abs(shift) > _NOTHING
    columns = basis @ (vectors[:, heavy] * np.sqrt(scale * np.abs(shift[heavy])))
    part = Curvature(
        diagonal=scale * unknown * prior, columns=np.sqrt(prior)[:, None] * columns,
        signs=np.sign(shift[heavy]),
    )  # fmt: skip
    return part, share


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


def _is_projected(move: Array, change: Array) -> bool:
    """Whether a change of the gradient looks like a projection of the move."""
    along = float(move @ change)
    return abs(float(change @ change) - along) <= _PROJECTED * abs(along)


def _rank_one_updates(small: Array, share: float, *, twice: bool = True) -> tuple[Array, list[float]]:
    """SR1 from a share of the identity, oldest pair first, in the coordinates of the pairs' own space.

    small (d, 2 pairs): moves and changes in turn, triangular, so that what is new in a move stands in its own
    coordinates and those behind. What a projection makes of a move it leaves as it is: each change is a
    second pair of its own (`twice`). Also returns, by pair, the share of the prior with which the new bent.
    """
    H: Array = share * np.eye(len(small))
    met: list[float] = []
    for i in range(0, small.shape[1], 2):
        s, y = small[:, i], small[:, i + 1]
        new = np.zeros(len(small))
        new[i:] = s[i:]
        size = float(new @ new)
        if size > _NEW * float(s @ s):
            met.append(float(new @ (y - H @ (s - new))) / size)
        for move, change in ((s, y), (y, y)) if twice and _is_projected(s, y) else ((s, y),):
            length = float(np.linalg.norm(move))
            if length <= _SHORT:
                continue
            off = (change - H @ move) / length
            fit = float(off @ move) / length
            if abs(fit) > _ANGLE * float(np.linalg.norm(off)):
                H += np.outer(off, off) / fit
    return H, met
