"""What a member law is, eq. (2.1), and laws that users write in Python.

A law gives the force f (N, tension positive) of a member at density 1 from its elongation delta (m, length
minus natural length), the rate of delta (m/s) and the time (s). The member's force is alpha^power f. Kinks
are rounded in C2 over the stated width, so gradients exist everywhere; outside the width the printed law
holds exactly. The engine's own laws stand in a file each, named in `table.LAWS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, Protocol

import numpy as np

from .table import USER

__all__ = ["Law", "UserLaw"]

Array = np.ndarray[Any, Any]
COMPLEX_STEP = 1e-30


class Law(Protocol):
    """A record of parameters; `code` tells the kernels which law it is."""

    code: ClassVar[int]
    smooth: ClassVar[bool]

    @property
    def parameters(self) -> Any:
        """Column of the parameter table, for a `UserLaw` keyword arguments."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class UserLaw:
    """A law of your own: `force(delta, rate, t, **parameters)` on arrays, one entry per member that uses it.

    Slopes are taken by complex step, so write the function with numpy operations that take complex arrays: no
    abs, no comparison of delta or rate themselves (`np.where(delta.real > 0, ...)` is fine). Or give
    `slopes`, which returns (df/ddelta, df/drate). `StoredEnergy` does not count its members.

    >>> cubic = UserLaw(force=lambda delta, rate, t, k3: k3 * delta**3, parameters={"k3": 1e4})
    """

    force: Callable[..., Array]
    parameters: Mapping[str, float] = field(default_factory=dict)
    slopes: Callable[..., tuple[Array, Array]] | None = None

    code: ClassVar[int] = USER
    smooth: ClassVar[bool] = True  # for all we know

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def linearised(self, delta: Array, rate: Array, t: float) -> tuple[Array, Array, Array]:
        """Force, df/ddelta and df/drate, shaped as delta (k,), m, and rate (k,), m/s."""
        force = np.broadcast_to(np.real(self.force(delta, rate, t, **self.parameters)), delta.shape)
        if self.slopes is not None:
            by_delta, by_rate = self.slopes(delta, rate, t, **self.parameters)
        else:
            step = COMPLEX_STEP * 1j
            by_delta = np.imag(self.force(delta + step, rate + 0j, t, **self.parameters)) / COMPLEX_STEP
            by_rate = np.imag(self.force(delta + 0j, rate + step, t, **self.parameters)) / COMPLEX_STEP
        return force, np.broadcast_to(by_delta, delta.shape), np.broadcast_to(by_rate, delta.shape)
