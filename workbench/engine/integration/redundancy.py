"""Constraint rows that others imply: found at the start by Gram-Schmidt, row by row."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["FEASIBLE", "RANK", "Redundancy", "redundancy"]

Array = np.ndarray[Any, Any]

FEASIBLE = 1e-9  # m or rad; positions typed in with ten digits pass
CLEAR = 1e-3  # of a row of length one, left by those before it: far from the limit of what counts as zero
RANK = 1e-9  # singular values below this share of the largest count as zero


@dataclass(frozen=True, slots=True, kw_only=True)
class Redundancy:
    """Constraint rows that say nothing new at the start, and the rank of Phi_q."""

    rank: int
    rows: tuple[str, ...]


def redundancy(row_names: Sequence[str], phi_q: Array) -> Redundancy:
    """Rank of the Jacobian phi_q (m, n) of the constraints, and the rows that depend on earlier ones."""
    m = len(phi_q)
    if m == 0:
        return Redundancy(rank=0, rows=())
    scaled = phi_q / np.maximum(np.linalg.norm(phi_q, axis=1, keepdims=True), 1e-300)
    # |R| holds what Gram-Schmidt leaves of each row: where none is small, nobody depends on earlier ones
    if m <= phi_q.shape[1] and (np.abs(np.diag(np.linalg.qr(scaled.T, mode="r"))) >= CLEAR).all():
        return Redundancy(rank=m, rows=())
    names: list[str] = []
    basis = np.zeros((0, phi_q.shape[1]))
    for r in range(m):
        row = scaled[r]
        for _ in range(2):
            row = row - basis.T @ (basis @ row)
        size = np.linalg.norm(row)
        if size < np.sqrt(RANK):
            names.append(row_names[r])
        else:
            basis = np.vstack([basis, row / size])
    return Redundancy(rank=len(basis), rows=tuple(names))
