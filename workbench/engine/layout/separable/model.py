"""The normalised separable model behind the GSAO family, (7.5) to (7.8), convex by construction.

    f~_j(x) = f_j + sum_i { g_ji s_ji [ r_ji^p_ji - 1 ] / p_ji + q_ji (x_i - x_i^k)^2 / 2 }
    r_ji = 1 + (x_i - x_i^k)/s_ji

with s_ji = x_i^k - c_ji the signed distance to the centre (asymptote), p_ji the exponent (xi for the
objective, zeta for the constraints; p -> 0 is the logarithm) and q_ji >= 0 an added curvature. It equals
(7.5) to (7.7) written at alpha^k, but never forms |x - c|^(1 - xi): nothing overflows and value and gradient
match at x^k by construction. (7.6) and (7.7) are printed at alpha_i; so read, the model is a constant.

A term is convex where  g (p - 1)/s >= 0. `SeparableModel.convex` puts terms that are not on the linear side.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from . import _kernels_subproblem as kernels

__all__ = ["SeparableModel"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SeparableModel:
    """Objective (row 0) and constraints (rows 1 to m) around a point.

    point (n,)    values (m + 1,)    gradients, distances, exponents, curvatures (m + 1, n)
    lower, upper (n,): the move box, inside r > 0.
    """

    point: Array
    values: Array
    gradients: Array
    distances: Array
    exponents: Array
    curvatures: Array
    lower: Array
    upper: Array

    @staticmethod
    def build(
        point: Array,
        values: Array,
        gradients: Array,
        *,
        lower: Array,
        upper: Array,
        distances: Array | float = np.inf,
        exponents: Array | float = 1.0,
        curvatures: Array | float = 0.0,
    ) -> "SeparableModel":
        """A model that is convex: exponents on the wrong side of the sign table become 1 (linear).

        The move box is drawn in to where every r stays above 0.01 of its value at the point.

        >>> import numpy as np
        >>> one = SeparableModel.build(np.ones(1), np.zeros(1), -np.ones((1, 1)), lower=np.array([0.1]),
        ...                            upper=np.array([9.0]), distances=1.0, exponents=-1.0)
        >>> one.at(np.array([2.0]))[0]          # reciprocal: 1/x - 1
        array([-0.5])
        """
        shape = gradients.shape
        s = np.broadcast_to(np.asarray(distances, dtype=float), shape)
        p = np.broadcast_to(np.asarray(exponents, dtype=float), shape)
        q = np.maximum(np.broadcast_to(np.asarray(curvatures, dtype=float), shape), 0.0)
        linear = (gradients * (p - 1) / s < 0) | (gradients == 0) | ~np.isfinite(s) | (s == 0)
        p = np.where(linear, 1.0, p)
        bent = p != 1.0
        s = np.where(bent, s, 1.0)
        below = np.where(bent & (s > 0), point - 0.99 * s, -np.inf).max(axis=0)
        above = np.where(bent & (s < 0), point - 0.99 * s, np.inf).min(axis=0)
        arrays = [np.ascontiguousarray(a, dtype=float) for a in (point, values, gradients, s, p, q)]
        return SeparableModel(
            point=arrays[0], values=arrays[1], gradients=arrays[2], distances=arrays[3], exponents=arrays[4],
            curvatures=arrays[5], lower=np.maximum(lower, below), upper=np.minimum(upper, above),
        )  # fmt: skip

    @property
    def constraints(self) -> int:
        """Number of constraints m."""
        return len(self.values) - 1

    @property
    def is_linear(self) -> bool:
        """True when every term is linear: the subproblem is a linear programme."""
        return bool((self.exponents == 1.0).all() and (self.curvatures == 0.0).all())

    def at(self, x: Array) -> tuple[Array, Array]:
        """Values (m + 1,) and gradients (m + 1, n) at x."""
        values, gradients = kernels.model_rows(
            x, self.values, self.gradients, self.distances, self.exponents, self.curvatures, self.point
        )
        return values, gradients

    def second_derivatives(self, x: Array) -> Array:
        """(m + 1, n), all >= 0."""
        d = x - self.point
        r = np.where(self.exponents == 1.0, 1.0, 1 + d / self.distances)  # a linear term's may vanish
        bend = self.gradients * (self.exponents - 1) * r ** (self.exponents - 2) / self.distances
        return np.where(self.exponents == 1.0, 0.0, bend) + self.curvatures

    def bend(self, weights: Array, x: Array) -> Array:
        """(n,): the second derivative at x of the weighted sum of objective and constraints."""
        _, found = kernels.lagrangian_slopes(
            x, weights, self.gradients, self.distances, self.exponents, self.curvatures, self.point
        )
        return np.asarray(found)

    def minimiser(self, weights: Array) -> tuple[Array, Array]:
        """x (n,) minimising sum_j weights_j f~_j in the box, and the curvature there (0 on a bound)."""
        x, curvature = np.empty_like(self.point), np.empty_like(self.point)
        kernels.minimise_lagrangian(
            weights, self.gradients, self.distances, self.exponents, self.curvatures, self.point,
            self.lower, self.upper, x, curvature,
        )  # fmt: skip
        return x, curvature

    def without(self, constraints: NDArray[np.intp]) -> "SeparableModel":
        """The model without some constraints, counted from 0."""
        tables = (self.values, self.gradients, self.distances, self.exponents, self.curvatures)
        values, g, s, p, q = (np.ascontiguousarray(np.delete(t, constraints + 1, axis=0)) for t in tables)
        return replace(self, values=values, gradients=g, distances=s, exponents=p, curvatures=q)

    def part(self, constraint: int, variables: NDArray[np.bool_]) -> "SeparableModel":
        """The objective and one constraint (counted from 0), seen by some of the variables alone."""
        rows = np.array([0, constraint + 1])
        g, s, p, q = (
            np.ascontiguousarray(t[rows][:, variables])
            for t in (self.gradients, self.distances, self.exponents, self.curvatures)
        )
        point, lower, upper = (t[variables] for t in (self.point, self.lower, self.upper))
        return replace(
            self, point=point, values=self.values[rows], gradients=g, distances=s, exponents=p, curvatures=q,
            lower=lower, upper=upper,
        )  # fmt: skip

    def in_unit_box(self) -> "SeparableModel":
        """The same model in (x - lower)/(upper - lower): variables of any size weigh alike in it."""
        width = np.where(self.upper > self.lower, self.upper - self.lower, 1.0)
        return replace(
            self, point=(self.point - self.lower) / width, gradients=self.gradients * width,
            distances=self.distances / width, curvatures=self.curvatures * width**2,
            lower=np.zeros_like(width), upper=(self.upper - self.lower) / width,
        )  # fmt: skip

    def within_reach(self) -> "SeparableModel":
        """The same model in the part of its box where its constraints can be met, or be missed by as little
        as at the point: no term of a constraint may be above what all others can take back. Terms of steep
        curvature else set the unit of a box that they never use."""
        reach = np.maximum(np.abs(self.gradients[1:]) @ (self.upper - self.lower), 1e-300)
        missed = float((np.maximum(self.values[1:], 0.0) / reach).sum())
        limits = 2.0 * ((1.0 + missed) * reach + np.maximum(-self.values[1:], 0.0))
        lower, upper = self.lower.copy(), self.upper.copy()
        kernels.shorten(
            limits, self.gradients, self.distances, self.exponents, self.curvatures, self.point, lower, upper
        )
        if np.array_equal(lower, self.lower) and np.array_equal(upper, self.upper):
            return self
        return replace(self, lower=lower, upper=upper)

    def stiffened(self, rows: Array) -> "SeparableModel":
        """The model with curvature added: rows (m + 1, n) or broadcastable, >= 0."""
        return replace(self, curvatures=np.ascontiguousarray(self.curvatures + rows))
