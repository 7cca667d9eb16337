"""The flat arrays of a spatial system in natural coordinates, and the work space of its kernels."""

from typing import Any, NamedTuple

import numpy as np

from ..compiler.records import passed_as_record

__all__ = ["NaturalTables", "NaturalWork", "work_space"]

Array = np.ndarray[Any, Any]


@passed_as_record
class NaturalTables(NamedTuple):
    """A spatial system in natural coordinates: nodes of three coordinates, the free ones first.

    Constraints are Phi_r = sum value q_i q_j + sum value q_i + constant - drive; indices count all nodes.
    """

    mass: Array  # (n, n)
    gravity: Array  # (n,) generalised force
    held: Array  # (k,) coordinates of the fixed nodes
    product: Array  # (terms, 3) row, i, j
    product_value: Array  # (terms,)
    linear: Array  # (terms, 2) row, i
    linear_value: Array  # (terms,)
    constant: Array  # (m,)
    segment: Array  # (S, 3) law code, first, last member
    ends: Array  # (N, 2) first coordinate of either end
    length: Array  # (N,) natural length
    law: Array  # (PARAMETERS, N)
    scale: Array  # (N,) alpha^power
    times: Array  # (samples,)
    drive: Array  # (samples, m)


@passed_as_record
class NaturalWork(NamedTuple):
    """What one evaluation of a spatial system writes."""

    q: Array  # all coordinates
    v: Array
    a: Array
    force: Array  # (n,)
    k: Array  # (n, n)
    c: Array  # (n, n)
    phi: Array  # (m,)
    phi_q: Array  # (m, n)
    delta: Array  # (N,)
    rate: Array
    f: Array
    fd: Array
    fv: Array


def work_space(tables: NaturalTables, dtype: Any = np.float64) -> NaturalWork:
    """Arrays for the evaluations of one spatial system."""
    n, m, members = len(tables.mass), len(tables.constant), len(tables.length)
    full = n + len(tables.held)

    def zeros(*shape: int) -> Array:
        return np.zeros(shape, dtype)

    return NaturalWork(
        q=zeros(full), v=zeros(full), a=zeros(full), force=zeros(n), k=zeros(n, n), c=zeros(n, n),
        phi=zeros(m), phi_q=zeros(m, n), delta=zeros(members), rate=zeros(members), f=zeros(members),
        fd=zeros(members), fv=zeros(members),
    )  # fmt: skip
