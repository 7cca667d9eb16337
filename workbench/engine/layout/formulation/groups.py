"""Members that belong together: twins, mirror images, and one design variable for each group.

alpha_i = x_g   for every member i of group g,    dG/dx_g = sum over the group of dG/dalpha_i
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .problem import Evaluation, InvalidLayout, LayoutProblem, LimitRow, MemberGeometry

__all__ = ["Tied", "mirrored", "tied", "twins", "united"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_DIGITS = 6  # of the reach of all points, to which two points are the same


def twins(geometry: MemberGeometry, *, axes: Sequence[int] = (0, 1)) -> list[list[int]]:
    """Groups of members that join the same bodies at the same points, seen along the axes given.

    >>> import numpy as np
    >>> a, b = np.zeros((3, 3)), np.array([[1.0, 0.0, 0.2], [1.0, 0.0, -0.2], [0.0, 1.0, 0.0]])
    >>> one = MemberGeometry(body_a=np.zeros(3, int), point_a=a, body_b=np.ones(3, int), point_b=b,
    ...                      kind=("belt",) * 3)
    >>> twins(one)
    [[0, 1]]
    """
    kept = [k for k in axes if k < np.asarray(geometry.point_a).shape[1]]
    keys: dict[tuple[object, ...], list[int]] = {}
    for i, row in enumerate(
        _rounded(geometry, np.asarray(geometry.point_a), np.asarray(geometry.point_b), kept)
    ):
        keys.setdefault((*_bodies(geometry, i), *row.tolist()), []).append(i)
    return [members for members in keys.values() if len(members) > 1]


def mirrored(
    geometry: MemberGeometry, *, axis: int, at: float = 0.0, bodies: Sequence[tuple[int, int]] = ()
) -> list[list[int]]:
    """Pairs of members that are mirror images in the plane x[axis] = at (m, global, at the start).

    bodies: pairs of bodies that are mirror images too, left and right arm for example; all others are their
    own. Members of the same kind only; a member in the plane of symmetry is its own image and in no pair.

    >>> a, b = np.zeros((2, 2)), np.array([[1.0, 0.5], [1.0, -0.5]])
    >>> one = MemberGeometry(body_a=np.zeros(2, int), point_a=a, body_b=np.ones(2, int), point_b=b,
    ...                      kind=("belt",) * 2)
    >>> mirrored(one, axis=1)
    [[0, 1]]
    """
    a, b = np.asarray(geometry.point_a, float), np.asarray(geometry.point_b, float)
    if not 0 <= axis < a.shape[1]:
        raise InvalidLayout(f"mirrored needs an axis from 0 to {a.shape[1] - 1}, got {axis}")
    other = {i: j for pair in bodies for i, j in (pair, pair[::-1])}
    image = [p.copy() for p in (a, b)]
    for p in image:
        p[:, axis] = 2.0 * at - p[:, axis]
    every = list(range(a.shape[1]))
    home = {
        (*_bodies(geometry, i), *row.tolist()): i
        for i, row in reversed(list(enumerate(_rounded(geometry, a, b, every))))
    }
    pairs = []
    for i, row in enumerate(_rounded(geometry, image[0], image[1], every)):
        one, two, kind = _bodies(geometry, i)
        found = home.get((other.get(one, one), other.get(two, two), kind, *row.tolist()))
        if found is not None and found > i:
            pairs.append([i, found])
    return pairs


def _bodies(geometry: MemberGeometry, i: int) -> tuple[int, int, str]:
    return int(geometry.body_a[i]), int(geometry.body_b[i]), geometry.kind[i]


def _rounded(geometry: MemberGeometry, a: Array, b: Array, axes: Sequence[int]) -> Array:
    known = np.hstack([np.asarray(geometry.point_a)[:, axes], np.asarray(geometry.point_b)[:, axes]])
    reach = max(float(np.ptp(known)), 1e-300)
    return np.asarray(np.round(np.hstack([a[:, axes], b[:, axes]]) / reach, _DIGITS) + 0.0)


def united(*groups: Sequence[Sequence[int]]) -> list[list[int]]:
    """Groups that share members become one: twins and their mirror images together, for example.

    >>> united([[0, 1], [4, 5]], [[1, 2]])
    [[0, 1, 2], [4, 5]]
    """
    found: list[set[int]] = []
    for group in (set(map(int, g)) for some in groups for g in some):
        apart = [known for known in found if not known & group]
        found = [*apart, group.union(*(known for known in found if known & group))]
    return sorted(sorted(group) for group in found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tied:
    """A problem with one variable for each group of members.

    problem: its design variables are the groups, then what stands in none    table (variables, all): 1 where
    a variable sets a design variable of the problem that was tied
    """

    problem: LayoutProblem
    table: Array

    def design(self, x: Array) -> Array:
        """The design of the problem that was tied, (all,)."""
        return np.asarray(x @ self.table)


def tied(problem: LayoutProblem, groups: Sequence[Sequence[int]]) -> Tied:
    """One density for all members of each group; budgets, limits and gradients follow.

    The bounds of a group are the tightest of its members', its start is their mean.
    Raises InvalidLayout for members that do not exist, stand in two groups or have no density in common.

    >>> from .problem import static_problem
    >>> one = static_problem(lambda a: (float(a @ a), 2 * a), start=np.array([0.2, 0.4, 0.6]))
    >>> both = tied(one, [[0, 1]])
    >>> both.problem.start.round(3).tolist(), both.design(np.array([0.3, 0.5])).tolist()
    ([0.3, 0.6], [0.3, 0.3, 0.5])
    """
    taken: set[int] = set()
    for group in groups:
        for i in group:
            if not 0 <= int(i) < problem.densities or int(i) in taken:
                raise InvalidLayout(
                    f"groups need members from 0 to {problem.densities - 1}, each in one group; got {i} in "
                    f"{list(group)}. `united` joins groups that share members"
                )
            taken.add(int(i))
    # in the order of the first member of each, so that law variables stay the last
    sets = sorted(
        [
            *(sorted(map(int, g)) for g in groups if len(g)),
            *([i] for i in range(problem.members) if i not in taken),
        ]
    )
    table = np.zeros((len(sets), problem.members))
    for g, members in enumerate(sets):
        table[g, members] = 1.0
    lower = np.array([problem.lower[members].max() for members in sets])
    upper = np.array([problem.upper[members].min() for members in sets])
    apart = np.flatnonzero(lower > upper)
    if apart.size:
        raise InvalidLayout(
            f"members {sets[int(apart[0])]} have no density in common: their bounds do not meet"
        )
    start = np.array([problem.start[members].mean() for members in sets])
    inner, runs = problem.evaluate, problem.simulated

    def evaluate(x: Array) -> Evaluation:
        return _Tied(inner=inner(x @ table), table=table)

    return Tied(
        problem=replace(
            problem, evaluate=evaluate, start=np.clip(start, lower, upper), lower=lower, upper=upper,
            costs=problem.costs @ table.T, geometry=None,
            simulated=None if runs is None else lambda x: runs(x @ table),
        ),
        table=table,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tied:
    """An evaluation by the variables of groups."""

    inner: Evaluation
    table: Array

    @property
    def values(self) -> Array:
        """(scenarios, nodes)."""
        return self.inner.values

    @property
    def constraints(self) -> Array:
        """(c,)."""
        return self.inner.constraints

    @property
    def constraint_gradients(self) -> Array:
        """(c, variables)."""
        return np.asarray(np.asarray(self.inner.constraint_gradients) @ self.table.T)

    @property
    def limit_rows(self) -> tuple[LimitRow, ...]:
        """(c,)."""
        return self.inner.limit_rows

    def gradients(self, rows: Rows) -> Array:
        """(rows, variables)."""
        return np.asarray(self.inner.gradients(rows) @ self.table.T)

    def factors(self, rows: Rows) -> Array | None:
        """(rows, k, variables)."""
        found = self.inner.factors(rows)
        return None if found is None else np.asarray(found @ self.table.T)

    def model(self, step: Array) -> Array | None:
        """All rows after a step."""
        return self.inner.model(step @ self.table)
