"""A member law, the engine's or a user's own, over a history of elongations."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ._kernels_law_series import law_series as _kernel
from .laws import Law, UserLaw
from .table import PARAMETERS

__all__ = ["LawSeries", "law_series"]

Array = np.ndarray[Any, Any]


class LawSeries(NamedTuple):
    """Force, N, its slopes by elongation and rate, and the energy stored, J, at density 1: (nodes, M) each.

    The energy of a user's law is not known: it is zero.
    """

    force: Array
    by_elongation: Array
    by_rate: Array
    energy: Array


def law_series(laws: Sequence[Law], elongation: Array, rate: Array, times: Array) -> LawSeries:
    """The laws of M members of one kind (one `code`) over their elongations (nodes, M), m, and rates.

    >>> from workbench.engine import Spring
    >>> law_series([Spring(k=10.0)], np.array([[0.5]]), np.zeros((1, 1)), np.zeros(1)).force
    array([[5.]])
    """
    f, fd, fv, energy = (np.zeros(elongation.shape) for _ in range(4))
    if isinstance(laws[0], UserLaw):
        _users(laws, elongation, rate, times, f, fd, fv)
        return LawSeries(f, fd, fv, energy)
    table = np.zeros((PARAMETERS, len(laws)))
    for i, law in enumerate(laws):
        table[: len(law.parameters), i] = law.parameters
    delta, speed = (np.ascontiguousarray(x, float) for x in (elongation, rate))
    _kernel(laws[0].code, table, delta, speed, np.array(times, float), f, fd, fv, energy)
    return LawSeries(f, fd, fv, energy)


def _users(
    laws: Sequence[Any], delta: Array, rate: Array, times: Array, f: Array, fd: Array, fv: Array
) -> None:
    """Laws in Python, a member at a time."""
    for i, law in enumerate(laws):
        for node, t in enumerate(times.tolist()):
            x, v = delta[node, i : i + 1], rate[node, i : i + 1]
            (f[node, i],), (fd[node, i],), (fv[node, i],) = law.linearised(x, v, t)
