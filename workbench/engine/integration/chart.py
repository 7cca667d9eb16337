"""Work arrays of the schemes in independent coordinates, and the rates of what is prescribed.

The joints' Jacobian is split by pivoting into dependent columns D and independent columns I, and its rows
into independent rows and redundant ones: Phi_D is square and well conditioned, q_D and v_D follow from q_I
and v_I."""

from typing import Any, NamedTuple

import numpy as np

from ..compiler.records import passed_as_record

__all__ = ["Chart", "Rates", "chart"]

Array = np.ndarray[Any, Any]

RANK = 1e-8  # see `Chart.threshold`


@passed_as_record
class Rates(NamedTuple):
    """Time derivatives of prescribed motions and drives at the samples of `Tables`."""

    motion: Array  # (samples, 3 prescribed) accelerations
    drive: Array  # (samples, 2, m) first and second derivatives


@passed_as_record
class Chart(NamedTuple):
    """n coordinates, m rows, r = rank, f = n - r; only the leading r or f parts of the squares are used."""

    mass: Array  # (n, n)
    weight: Array  # (n,) of the columns in the search for pivots
    rows: Array  # (m,) permutation: independent rows first
    cols: Array  # (n,) permutation: dependent columns first
    rank: Array  # (1,)
    threshold: Array  # (1,) pivots below this share of the first count as zero
    tight: Array  # (1,) the smallest pivot of Phi_D over its largest
    full: Array  # (all coordinates,) accelerations
    row: Array  # (3, 6)
    arm: Array  # (3, 4)
    other: Array  # (3, 4)
    gap: Array  # (3, 2)
    rate: Array  # (m, n) (Phi_q)'
    bend: Array  # (m, n) (Phi_q)''
    t1: Array  # (m,)
    t2: Array  # (m,)
    work: Array  # (m, n) eliminated Phi_q
    lu: Array  # (m, m) factors of Phi_D
    pivot: Array  # (m,)
    basis: Array  # (n, n) dq/dq_I = dv/dv_I
    by_q: Array  # (n, n) dv/dq_I
    w_by_q: Array  # (n, n) dw/dq_I
    w_by_v: Array  # (n, n) dw/dv_I
    inertia: Array  # (n, n) basis^T M basis
    reduced: Array  # (n, n) its factors
    reduced_pivot: Array  # (n,)
    side: Array  # (m + n,)
    known: Array  # (n,) accelerations with none of the independent ones
    part: Array  # (4, n)
    zero: Array  # (n,)
    none: Array  # (m,)
    states: Array  # (states,) of first order, at 0


def chart(mass: Array, weight: Array, rows: int, *, full: int, states: int = 0, dtype: Any = float) -> Chart:
    """Arrays for a system of `len(mass)` coordinates and `rows` constraints."""
    n, m = len(mass), rows

    def zeros(*shape: int) -> Array:
        return np.zeros(shape, dtype)

    return Chart(
        mass=np.ascontiguousarray(mass, dtype), weight=np.ascontiguousarray(weight, float),
        rows=np.arange(m), cols=np.arange(n), rank=np.zeros(1, np.int64),
        threshold=np.array([RANK]), tight=np.ones(1),
        full=zeros(full), row=zeros(3, 6), arm=zeros(3, 4), other=zeros(3, 4), gap=zeros(3, 2),
        rate=zeros(m, n), bend=zeros(m, n), t1=zeros(m), t2=zeros(m), work=zeros(m, n), lu=zeros(m, m),
        pivot=np.zeros(m, np.int64), basis=zeros(n, n), by_q=zeros(n, n), w_by_q=zeros(n, n),
        w_by_v=zeros(n, n), inertia=zeros(n, n), reduced=zeros(n, n), reduced_pivot=np.zeros(n, np.int64),
        side=zeros(m + n), known=zeros(n), part=zeros(4, n), zero=zeros(n), none=zeros(m),
        states=zeros(states),
    )  # fmt: skip
