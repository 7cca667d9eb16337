"""The equations of motion as the time loops see them.

`Equations` is all that the loops of `loops` and their adjoints ask for: residual, tangents and design
derivatives at a state. A kind of system plugs in by answering these questions.
"""

from typing import Any, Protocol

import numpy as np

__all__ = ["Equations"]

Array = np.ndarray[Any, Any]


class Equations(Protocol):
    """r = M w + force, Phi = 0 at node `node` of the time grid; arrays are valid until the next call."""

    size: int  # n coordinates
    rows: int  # m constraints
    members: int  # N designs
    mass: Array  # (n, n)
    force: Array  # (n,) internal minus external forces plus Phi_q^T lambda
    stiffness: Array  # (n, n) d force/dq
    damping: Array  # (n, n) d force/dv
    constraint: Array  # (m,)
    jacobian: Array  # (m, n)

    def look(self, node: int, q: Array, v: Array, lam: Array) -> None:
        """Evaluate everything at a state."""
        ...

    def contract(self, node: int, q: Array, v: Array, mu: Array, gradient: Array) -> None:
        """gradient += (dF/dscale)^T mu."""
        ...
