"""Members of planar systems: force elements between one point of a body and one point of another, (2.1)."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.laws import Law

__all__ = ["Member", "dense_members"]

Array = np.ndarray[Any, Any]
Point = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """A force element between `point_a` of body `a` and `point_b` of body `b`; "ground" is the world.

    natural_length: m, None for the length at the start, measured with `offset`.
    offset: constant distance out of the plane, m: length = sqrt(dx^2 + dy^2 + offset^2).
    power: SIMP exponent, force = density^power times the law.

    >>> from workbench.engine import Spring
    >>> Member(a="seat", b="ground", point_a=(0.1, 0.0), point_b=(0.0, 0.5), law=Spring(k=100.0)).power
    1.0
    """

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    law: Law
    natural_length: float | None = None
    offset: float = 0.0
    power: float = 1.0
    name: str = ""


def dense_members(
    a: str, b: str, points_a: Array, points_b: Array, *, law: Law, power: float = 1.0
) -> tuple[Member, ...]:
    """Every point of body `a` joined to every point of body `b`: member i = len(points_b) * row_a + row_b.

    Args:    points_a: (p, 2)    points_b: (r, 2)    body-frame points, m.

    >>> from workbench.engine import Spring
    >>> len(dense_members("1", "2", np.zeros((20, 2)), np.ones((51, 2)), law=Spring(k=1.0)))
    1020
    """
    return tuple(
        Member(
            a=a,
            b=b,
            point_a=(float(s[0]), float(s[1])),
            point_b=(float(r[0]), float(r[1])),
            law=law,
            power=power,
        )
        for s in np.asarray(points_a)
        for r in np.asarray(points_b)
    )
