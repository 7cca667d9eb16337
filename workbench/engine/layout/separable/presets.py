"""The GSAO family: how each method chooses centres, exponents and curvatures of the separable model.

| method | choice |
|---|---|
| OC | centre c, exponent 1 - 1/eta where df < 0, of each row under a bound too; constraints linear |
| CONLIN | centre 0, exponent -1 where f,i < 0, else 1 (Fleury and Braibant 1986) |
| MMA | exponent -1, asymptote L below where f,i < 0, else U above, moved by the history (Svanberg 1987) |
| GCMMA | MMA plus curvature raised until the model is conservative (the idea of Svanberg 2002) |
| SLP | linear |
| DSQP | diagonal curvature H (Fleury 1989): exponent 2, centre x - f,i/H, written as added curvature |
| two-point | exponent 1 + ln(f,i^(k-1)/f,i^k)/ln r(x^(k-1)), kept on the convex side (Fadel 1990) |

A plain multiplicative update cannot leave alpha_i = 0 (7.11 with c = 0): the centre therefore never
coincides with the point, it lies at least `_CLEARANCE` of the width below it.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .model import SeparableModel

__all__ = [
    "ConvexLinearisation", "DiagonalQuadratic", "LinearProgramme", "MovingAsymptotes", "OptimalityCriteria",
    "Point", "Preset", "TwoPoint",
]  # fmt: skip

Array = NDArray[np.float64]

_CLEARANCE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """An iterate: x (n,), values (m + 1,), gradients (m + 1, n), curvatures (m + 1, n) or None.

    rows: so many of the constraints, the first, are rows of the objective under a bound, the last variable.
    """

    x: Array
    values: Array
    gradients: Array
    curvatures: Array | None = None
    rows: int = 0


class Preset(Protocol):
    """Builds the model at the last of the points; lower and upper are the bounds of the problem."""

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """The separable model with its move box."""
        ...


def _move_box(x: Array, lower: Array, upper: Array, move: float, ratio: float) -> tuple[Array, Array]:
    """Absolute move limit (share of the width) and, if ratio > 1, a relative one."""
    lo, hi = np.maximum(lower, x - move * (upper - lower)), np.minimum(upper, x + move * (upper - lower))
    if np.isfinite(ratio):
        reach = np.maximum(np.abs(x), _CLEARANCE * (upper - lower)) * (1 - 1 / ratio)
        lo, hi = np.maximum(lo, x - reach), np.minimum(hi, x + reach * ratio)
    return lo, hi


def _distance(x: Array, centre: float, lower: Array, upper: Array) -> Array:
    distance = np.maximum(x - centre, _CLEARANCE * (upper - lower))
    return np.where(distance > 0, distance, 1.0)  # a member that is fixed at the centre has none


@dataclass(frozen=True, slots=True, kw_only=True)
class OptimalityCriteria:
    """OC with damping eta: the update (7.11) with zeta = 1.    move: share of the width."""

    eta: float = 0.5
    centre: float = 0.0
    move: float = 0.2
    ratio: float = np.inf

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """Reciprocal-like rows of the objective where they fall, else linear; linear constraints."""
        here = points[-1]
        lo, hi = _move_box(here.x, lower, upper, self.move, self.ratio)
        p = np.ones_like(here.gradients)
        top = slice(0, 1 + here.rows)
        p[top] = np.where(here.gradients[top] < 0, 1 - 1 / self.eta, 1.0)
        return SeparableModel.build(
            here.x, here.values, here.gradients, lower=lo, upper=hi,
            distances=_distance(here.x, self.centre, lower, upper), exponents=p,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvexLinearisation:
    """CONLIN: reciprocal where a function falls, linear where it rises."""

    centre: float = 0.0
    move: float = 1.0

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """Exponent by the sign of each derivative."""
        here = points[-1]
        lo, hi = _move_box(here.x, lower, upper, self.move, np.inf)
        return SeparableModel.build(
            here.x, here.values, here.gradients, lower=lo, upper=hi,
            distances=_distance(here.x, self.centre, lower, upper),
            exponents=np.where(here.gradients < 0, -1.0, 1.0),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingAsymptotes:
    """MMA: asymptotes at x -+ reach, widened where the iterates go on, drawn in where they turn.

    first, shrink, widen: of the reach (share of the width)    room: share of the reach kept free in a step
    """

    first: float = 0.5
    shrink: float = 0.7
    widen: float = 1.2
    room: float = 0.1
    move: float = 1.0

    def reach(self, points: list[Point], lower: Array, upper: Array) -> Array:
        """Distance of the asymptotes from the last point, from the history of the points."""
        width = upper - lower
        reach = self.first * width
        for k in range(2, len(points)):
            turn = (points[k].x - points[k - 1].x) * (points[k - 1].x - points[k - 2].x)
            factor = np.where(turn < 0, self.shrink, np.where(turn > 0, self.widen, 1.0))
            reach = np.clip(factor * reach, 0.01 * width, 10 * width)
        return np.maximum(reach, 1e-300)

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """Reciprocal in the distance to the asymptote on the side away from which the function falls."""
        here = points[-1]
        reach = self.reach(points, lower, upper)
        lo, hi = _move_box(here.x, lower, upper, self.move, np.inf)
        step = (1 - self.room) * reach
        return SeparableModel.build(
            here.x, here.values, here.gradients, lower=np.maximum(lo, here.x - step),
            upper=np.minimum(hi, here.x + step), distances=np.where(here.gradients < 0, reach, -reach),
            exponents=-1.0,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearProgramme:
    """SLP: linear functions in a move box."""

    move: float = 0.1

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """All terms linear."""
        here = points[-1]
        lo, hi = _move_box(here.x, lower, upper, self.move, np.inf)
        return SeparableModel.build(here.x, here.values, here.gradients, lower=lo, upper=hi)


@dataclass(frozen=True, slots=True, kw_only=True)
class DiagonalQuadratic:
    """DSQP: the diagonal of the second derivative, given or from the last two gradients (secant)."""

    move: float = 0.5
    floor: float = 1e-6

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """Quadratic terms; the secant is kept above `floor` of |gradient|/width."""
        here = points[-1]
        lo, hi = _move_box(here.x, lower, upper, self.move, np.inf)
        width = np.maximum(upper - lower, 1e-300)
        if here.curvatures is not None:
            H = here.curvatures
        elif len(points) > 1:
            moved = here.x - points[-2].x
            secant = (here.gradients - points[-2].gradients) / np.where(moved == 0, np.inf, moved)
            H = np.where(moved == 0, 2 * np.abs(here.gradients) / width, secant)
        else:
            H = 2 * np.abs(here.gradients) / width
        H = np.maximum(H, self.floor * np.abs(here.gradients) / width)
        return SeparableModel.build(here.x, here.values, here.gradients, lower=lo, upper=hi, curvatures=H)


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoPoint:
    """GSAO with exponents from two points; one-point reciprocal at the start.

    steepest: largest |exponent|    linear: rows with a constant gradient are recognised and stay linear
    """

    centre: float = 0.0
    move: float = 1.0
    ratio: float = np.inf
    steepest: float = 8.0

    def model(self, points: list[Point], lower: Array, upper: Array) -> SeparableModel:
        """Fit the exponent of every term to the gradient at the point before."""
        here = points[-1]
        lo, hi = _move_box(here.x, lower, upper, self.move, self.ratio)
        s = _distance(here.x, self.centre, lower, upper)
        falls = here.gradients < 0
        p = np.where(falls, -1.0, 1.0)
        if len(points) > 1:
            before = points[-2]
            r = 1 + (before.x - here.x) / s
            with np.errstate(divide="ignore", invalid="ignore"):
                fitted = 1 + np.log(before.gradients / here.gradients) / np.log(np.maximum(r, 1e-300))
            usable = np.isfinite(fitted) & (before.gradients * here.gradients > 0) & (np.abs(r - 1) > 1e-9)
            convex = np.where(
                falls, np.clip(fitted, -self.steepest, 1.0), np.clip(fitted, 1.0, self.steepest)
            )
            p = np.where(usable, convex, p)
            constant = (before.gradients == here.gradients) & (np.abs(r - 1) > 1e-9)
            p = np.where(constant, 1.0, p)
        return SeparableModel.build(
            here.x, here.values, here.gradients, lower=lo, upper=hi, distances=s, exponents=p
        )
