"""What members and anchors cost: money, weight or labour that no density tells.

    spent = sum of the costs of members that are on + sum of the costs of anchors that any of them uses

An anchor is a point of a body at which members end: a bracket that carries five belts is paid once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..formulation.problem import InvalidLayout, LayoutProblem

__all__ = ["Bills", "Spending", "anchors", "bills"]

Array = NDArray[np.float64]
On = NDArray[np.bool_]

_DIGITS = 6  # of the reach of all points, to which two points are the same anchor
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Spending:
    """Costs of what is there, and what may be spent.

    member: of each member that is on, whatever its size; one number or one for each member
    anchor: of each point that a member on ends at    bodies: numbers of the bodies whose points are paid for
    (as in the problem's geometry), None for all    at_most: what may be spent; inf for no limit

    >>> Spending(anchor=1.0, at_most=6.0)  # at most six anchors
    Spending(member=0.0, anchor=1.0, bodies=None, at_most=6.0)
    """

    member: ArrayLike = 0.0
    anchor: float = 0.0
    bodies: Sequence[int] | None = None
    at_most: float = np.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Bills:
    """The costs of choices.

    states (states,): cost of the members of each state    anchor: cost of each    table (states, anchors):
    which anchors the members of a state use    at_most: what may be spent
    """

    states: Array
    anchor: float
    table: NDArray[np.bool_]
    at_most: float

    def spent(self, on: On) -> float:
        """What a choice costs."""
        return float(self.states @ on + self.anchor * self.used(on))

    def used(self, on: On) -> int:
        """How many anchors a choice uses."""
        return int(self.table[np.asarray(on, dtype=bool)].any(axis=0).sum())

    def met(self, on: On) -> bool:
        """Whether a choice may be afforded."""
        return self.spent(on) <= self.at_most + _ROUNDING * max(abs(self.at_most), 1e-300)


def anchors(problem: LayoutProblem, bodies: Sequence[int] | None = None) -> NDArray[np.bool_]:
    """(members, anchors): which points of the bodies each member ends at.

    Raises InvalidLayout for a problem without a geometry.
    """
    geometry = problem.geometry
    if geometry is None:
        raise InvalidLayout("anchors need a problem with a geometry: where its members end")
    points = np.vstack([np.asarray(geometry.point_a, float), np.asarray(geometry.point_b, float)])
    owner = np.r_[np.asarray(geometry.body_a), np.asarray(geometry.body_b)].astype(int)
    reach = max(float(np.ptp(points)), 1e-300)
    keys = np.column_stack([owner, np.round(points / reach, _DIGITS) + 0.0])
    _, number = np.unique(keys, axis=0, return_inverse=True)
    number = number.ravel()
    paid = np.ones(len(owner), dtype=bool) if bodies is None else np.isin(owner, list(bodies))
    count = len(geometry.kind)
    table = np.zeros((problem.members, int(number.max()) + 1), dtype=bool)
    for end in (slice(0, count), slice(count, 2 * count)):
        members = np.flatnonzero(paid[end])
        table[members, number[end][members]] = True
    return np.asarray(table[:, table.any(axis=0)])


def bills(spending: Spending, problem: LayoutProblem, states: NDArray[np.bool_]) -> Bills:
    """The costs of states (states, members).

    Raises InvalidLayout for costs below zero, or without a geometry where anchors cost.
    """
    member = np.broadcast_to(np.asarray(spending.member, dtype=float), (problem.members,))
    if (member < 0.0).any() or spending.anchor < 0.0 or not spending.at_most >= 0.0:
        raise InvalidLayout("costs of members and anchors, and what may be spent, need to be >= 0")
    table = np.zeros((len(states), 0), dtype=bool)
    if spending.anchor > 0.0:
        table = states.astype(int) @ anchors(problem, spending.bodies).astype(int) > 0
    return Bills(
        states=np.asarray(states @ member), anchor=spending.anchor, table=table, at_most=spending.at_most
    )
