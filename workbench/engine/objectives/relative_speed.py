"""How fast a point of a body moves as seen from another body."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..tree.view import SpatialView
from .quantities import Slopes

__all__ = ["RelativeSpeed"]

Array = np.ndarray[Any, Any]
ROUND = 1e-9  # m/s under the root: at rest it has slopes too


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeSpeed:
    """|d/dt of A^T (p - o)|, m/s: the speed of a point p of a body of a `TreeSystem` in the frame A, o of a
    reference.

    >>> RelativeSpeed(body="head", point=(0.0, 0.0, 0.12), reference="cab").has_rates
    False
    """

    body: str
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reference: str = "ground"
    has_rates: bool = False

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,) the speed at every node."""
        if not hasattr(trajectory, "frames"):
            raise NotSupported("RelativeSpeed looks at bodies of a TreeSystem; take a Scalar for others")
        f, g = trajectory.frames(self.body), trajectory.frames(self.reference)
        arm = f.axes @ np.asarray(self.point, float)
        apart = f.origin + arm - g.origin
        speed = f.velocity + np.cross(f.spin, arm) - g.velocity - np.cross(g.spin, apart)
        return np.asarray(np.sqrt((speed**2).sum(axis=1) + ROUND**2))

    def slopes(self, trajectory: Any, node: int) -> Slopes:
        """Partial derivatives at a node."""
        view = SpatialView(
            trajectory=trajectory, points=((self.body, self.point, 1.0),), reference=self.reference
        )
        seen = view.seen(node)
        rate = np.array(seen.rate)
        by_q, by_v = view.chain(seen, (0.0, 0.0, 0.0), rate / np.sqrt(rate @ rate + ROUND**2))
        return Slopes(position=by_q, velocity=by_v)

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """Raises NotSupported: it needs accelerations."""
        raise NotSupported("RelativeSpeed has no rates; its peaks are refined through nodal values")

    def rate_slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises NotSupported, as `rates`."""
        raise NotSupported("RelativeSpeed has no rates; its peaks are refined through nodal values")
