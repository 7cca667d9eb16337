"""What a force element between two bodies is: a record of parameters, and the kernels beside it.

An element acts on X (3,), position and angle of body `a` seen from `b`, and its rate U (3,). Its file, named
in `table.ELEMENTS`, holds functions of p (parameters, elements), the element's column e of it and
big = (X, U). They add F (3,), minus the force on `a`, and its slopes K = dF/dX and C = dF/dU:

    forces(p, e, big, F, K, C)
    forces(p, e, big, z, rate, half, tangent, F, K, C, slopes, out)     with a state z: z' = g(X, z), z(0) = 0
    parameter_slopes(p, e, big, z, dp)       dp (., 3) = dF/dparameter, rows as in `names`
    energy(p, e, big, out)                   out[0] += energy in J, of elastic elements only

A state is taken to the end of a trapezoidal step by its own element, z1 = z + half (rate + g(X, z1)), and
out = z1, g. slopes: dg/dz, then dF/dz, dg/dX and dz1/dX (3 each); K includes dF/dz dz1/dX. `names` leaves out
what acts on g: gradients by parameter go through F alone.
"""

from typing import Any, ClassVar, Protocol

__all__ = ["Element"]


class Element(Protocol):
    """A record of parameters; `code` tells the kernels which element it is."""

    code: ClassVar[int]
    names: ClassVar[tuple[str, ...]]
    states: ClassVar[int]
    elastic: ClassVar[bool]

    @property
    def a(self) -> str:
        """The body that feels the force."""
        ...

    @property
    def b(self) -> str:
        """The body in whose frame it acts, which feels the opposite."""
        ...

    @property
    def smooth(self) -> bool:
        """Whether the force has all derivatives."""
        ...

    @property
    def has_state(self) -> bool:
        """Whether its state can change: only the compiled loop of generalised-alpha carries it then."""
        ...

    def column(self, start: Any) -> tuple[float, ...]:
        """Parameters in the order of the kernels; start: (3,) X at the start."""
        ...
