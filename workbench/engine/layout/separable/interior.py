"""The separable subproblem by a primal-dual interior point: for models that are flat in places.

Where a variable enters objective and constraints linearly the dual has kinks and the minimiser of the
Lagrangian jumps; the interior point does not mind. Conditions of

    min f~_0(x) + sum_j cap_j z_j   subject to   f~_j(x) - z_j + s_j = 0,   s, z >= 0,   lower <= x <= upper

are relaxed by mu, the mean of the products of multipliers and distances, z the elastic variables. A step
without mu tells how far it may fall, a second one with the second-order terms of the first goes there
(Mehrotra 1992). It is shortened until no product is far behind the mean and what is left of the conditions
falls with it (Wright 1997, ch. 6); multipliers of the box and slacks take up what they can of that, since a
small residual would else tie long steps down. Variables that the barrier holds least stay in the linear
system, which without them loses its digits near a vertex. A step costs O(n m^2), in seven compiled passes
over the variables.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import _kernels_interior as kernels
from .model import SeparableModel

__all__ = ["interior_point"]

Array = NDArray[np.float64]

_STEPS, _HALVINGS = 120, 6
_MET = 1e-12  # what is left of the conditions at the end
_LEAST_FALL = 0.1  # of mu in a step
_NEAR = 1e-2  # of the mean: the least of the products
_BEHIND = 100.0  # what is left of the conditions, in units of n mu, up to which mu falls freely
_TO_THE_WALL = 0.995  # of the way to the nearest bound
_MARGIN = 0.02  # of the box: the start keeps away from its bounds
_SHORT = 0.1  # a step so short is tried again, nearer to the central path
_CENTRED = 0.5, 1.0  # of mu: where to


@dataclass(frozen=True, slots=True)
class _Rows:
    """Of the constraints: multipliers y, slacks s, elastic variables z, what is left of the caps e (m,)."""

    y: Array
    s: Array
    z: Array
    e: Array

    def moved(self, length: float, move: "_Rows") -> "_Rows":
        return _Rows(
            self.y + length * move.y, self.s + length * move.s, self.z + length * move.z,
            self.e + length * move.e,
        )  # fmt: skip

    def longest(self, move: "_Rows") -> float:
        found = np.inf
        for v, dv in ((self.y, move.y), (self.s, move.s), (self.z, move.z), (self.e, move.e)):
            inward = dv < 0
            found = min(found, float((-v[inward] / dv[inward]).min(initial=np.inf)))
        return found

    def products(self) -> Array:
        return np.r_[self.y * self.s, self.z * self.e]

    def taking_up(self, values: Array, target: float) -> "_Rows":
        """Slacks and elastic variables take up what the rows leave, their products near the target."""
        low, high = target / kernels.TAKEN_UP, target * kernels.TAKEN_UP
        y, e = self.y, self.e
        s = np.clip(self.z - values, np.minimum(self.s, low / y), np.maximum(self.s, high / y))
        z = np.clip(values + s, np.minimum(self.z, low / e), np.maximum(self.z, high / e))
        return _Rows(y, s, z, e)


@dataclass(frozen=True, slots=True)
class _Scaled:
    """The free variables in the unit box, objective and constraints over their reach, caps likewise."""

    values: Array
    gradients: Array
    distances: Array
    exponents: Array
    curvatures: Array
    point: Array
    caps: Array


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the steps are: x and up = 1 - x, multipliers of the box, rows, and what is seen there.

    slopes (m + 1, n), bend and rest (n,): of the rows; of the Lagrangian second and first derivative.
    mu: mean of the products, least: least of them    left: largest condition that is not met
    """

    x: Array
    up: Array
    below: Array
    above: Array
    rows: _Rows
    values: Array
    slopes: Array
    bend: Array
    rest: Array
    mu: float
    least: float
    left: float


def _look(
    model: _Scaled, x: Array, up: Array, below: Array, above: Array, rows: _Rows, target: float
) -> _Place:
    slopes, bend, rest = np.empty_like(model.gradients), np.empty_like(x), np.empty_like(x)
    values, largest, total, least = kernels.conditions(
        x, up, rows.y, below, above, target, model.values, model.gradients, model.distances, model.exponents,
        model.curvatures, model.point, slopes, bend, rest,
    )  # fmt: skip
    rows = rows.taking_up(values[1:], target)
    products = rows.products()
    return _Place(
        x, up, below, above, rows, values, slopes, bend, rest,
        mu=(total + float(products.sum())) / (2 * len(x) + len(products)),
        least=min(least, float(products.min())),
        left=max(largest, float(np.abs(values[1:] - rows.z + rows.s).max())),
    )  # fmt: skip


class _Newton:
    """The linearised conditions at a place, ready for several right-hand sides."""

    def __init__(self, model: _Scaled, here: _Place) -> None:
        self._here, self._caps = here, model.caps
        m, n = len(here.rows.y), len(here.x)
        self._theta, weight, self._kept = np.empty(n), np.empty(n), np.zeros(n, dtype=bool)
        kernels.barrier_bend(
            here.x, here.up, here.below, here.above, here.slopes, here.bend, self._theta, weight
        )
        count = min(m, n)
        self._which = np.argpartition(weight, -count)[-count:]
        self._kept[self._which] = True
        rows, J = here.rows, here.slopes[1:, self._which]
        matrix = kernels.assemble(here.slopes, self._theta, self._kept)
        matrix += np.diag(rows.z / rows.e + rows.s / rows.y)
        system = np.block([[matrix, J], [J.T, -np.diag(self._theta[self._which])]])
        if not np.isfinite(system).all():
            raise np.linalg.LinAlgError
        self._scale = 1 / np.sqrt(np.maximum(np.abs(system).max(axis=1), 1e-300))
        self._system = system * self._scale * self._scale[:, None]
        self._first = np.empty(n)
        self.dx, self.dbelow, self.dabove = np.empty(n), np.empty(n), np.empty(n)

    def step(self, target: float, low: Array, high: Array, second: _Rows | None) -> tuple[_Rows, float]:
        """The move of the rows and the longest step, at most 1; those of the variables are kept here.

        low, high (n,) and second: moves whose second-order terms the products are to make up for.
        """
        here, rows, first = self._here, self._here.rows, self._first
        right = kernels.right_side(
            here.x, here.up, here.below, here.above, target, here.slopes, here.rest, self._theta, self._kept,
            low, high, first,
        )  # fmt: skip
        by, be = np.full_like(rows.y, target), np.full_like(rows.y, target)
        if second is not None:
            by -= second.y * second.s
            be -= second.z * second.e
        short, at = self._caps - rows.y - rows.e, rows.z / rows.e
        right += here.values[1:] - rows.z + rows.s
        right += at * short - (be / rows.e - rows.z) + by / rows.y - rows.s
        m = len(rows.y)
        solved = np.linalg.solve(self._system, np.r_[right, first[self._which]] * self._scale) * self._scale
        dy, self.dx[self._which] = solved[:m], -solved[m:]
        de = short - dy
        move = _Rows(dy, by / rows.y - rows.s - rows.s / rows.y * dy, be / rows.e - rows.z - at * de, de)
        longest = kernels.directions(
            here.x, here.up, here.below, here.above, target, here.slopes, self._theta, self._kept, first, dy,
            low, high, self.dx, self.dbelow, self.dabove,
        )  # fmt: skip
        return move, min(1.0, longest, rows.longest(move))


def _advance(model: _Scaled, here: _Place) -> _Place | None:
    """The next place, None where no step keeps near the central path: rounding."""
    newton = _Newton(model, here)
    n, mu = len(here.x), here.mu
    none, low, high = np.zeros(n), np.empty(n), np.empty(n)
    affine, length = newton.step(0.0, none, none, None)
    total = kernels.products(
        here.x, here.up, here.below, here.above, length, newton.dx, newton.dbelow, newton.dabove, low, high
    )
    products = here.rows.moved(length, affine).products()
    after = (total + float(products.sum())) / (2 * n + len(products))
    behind = min(1.0, here.left / (_BEHIND * n * mu)) * (1 - length)
    share = max(min(1.0, (after / mu) ** 3), _LEAST_FALL, behind)
    allowed = max(here.left / mu, _BEHIND * n)
    longest, taken = 0.0, None
    for to, terms in ((share, (low, high, affine)), *((c, (none, none, None)) for c in _CENTRED)):
        target = to * mu
        move, length = newton.step(target, *terms)
        length *= _TO_THE_WALL
        for _ in range(_HALVINGS):
            if length <= longest:
                break
            place = _look(
                model, here.x + length * newton.dx, here.up - length * newton.dx,
                here.below + length * newton.dbelow, here.above + length * newton.dabove,
                here.rows.moved(length, move), target,
            )  # fmt: skip
            if place.least >= _NEAR * place.mu and place.left <= max(allowed * place.mu, _MET):
                longest, taken = length, place
                break
            length *= 0.5
        if longest > _SHORT:
            break
    return taken


@np.errstate(all="ignore")  # next to a mechanism gradients overflow; what is not finite ends the steps
def interior_point(
    model: SeparableModel, caps: Array, *, last: float = 1e-14, missed: bool = False
) -> tuple[Array, Array]:
    """x (n,) and multipliers (m,) of the subproblem with elastic price caps (m,).

    last: mu, in units of the objective's reach, at which the steps end.    missed: what the constraints are
    missed by at their caps is the unit instead, for subproblems that no x of the box is feasible in.
    """
    free = model.upper > model.lower
    low, width = model.lower[free], (model.upper - model.lower)[free]
    found = np.where(free, model.point, model.lower)
    reach = np.maximum(np.abs(model.gradients) @ (model.upper - model.lower), 1e-300)
    dear = float((caps * reach[1:]).max())
    unit = np.r_[max(float(reach[0]), dear if missed else 1e-12 * dear), reach[1:]]
    scaled = _Scaled(
        model.at(found)[0] / unit,  # at the point the free variables add nothing
        np.ascontiguousarray(model.gradients[:, free] * width / unit[:, None]),
        np.ascontiguousarray(model.distances[:, free] / width),
        np.ascontiguousarray(model.exponents[:, free]),
        np.ascontiguousarray(model.curvatures[:, free] * width**2 / unit[:, None]),
        (model.point[free] - low) / width,
        caps * unit[1:] / unit[0],
    )
    x = np.clip(scaled.point, _MARGIN, 1 - _MARGIN)
    mu = 1.0 / max(len(x), 1)  # a variable is worth so much of the whole
    y = np.minimum(1.0 / model.constraints, 0.5 * scaled.caps)
    rows = _Rows(y, mu / y, mu / (scaled.caps - y), scaled.caps - y)
    here = _look(scaled, x, 1.0 - x, mu / x, mu / (1.0 - x), rows, mu)
    for _ in range(_STEPS):
        if here.mu <= last and here.left <= _MET:
            break
        try:
            place = _advance(scaled, here)
        except np.linalg.LinAlgError:
            break
        if place is None:
            break
        here = place
    # the smaller of the two factors of a pair is the one that is zero
    at = low + here.x * width
    found[free] = np.where(here.x < here.below, low, np.where(here.up < here.above, model.upper[free], at))
    rows = here.rows
    prices = np.where(rows.y < rows.s, 0.0, rows.y * unit[0] / unit[1:])
    return np.clip(found, model.lower, model.upper), np.where(rows.e < rows.z, caps, np.minimum(prices, caps))
