"""What an acceleration does to an occupant, as objectives with exact slopes of the computed value.

Versace 1971 and 49 CFR 571.208: head injury criterion; the level that an acceleration exceeds for 3 ms.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.grids import one_step_length
from .quantities import Quantity, Slopes
from .reductions import NodeWeight, Window, nodes_within

__all__ = ["ClipLevel", "HeadInjury", "PointAcceleration"]

Array = np.ndarray[Any, Any]
STANDARD_GRAVITY = 9.80665  # m/s^2
ROUND = 1e-9  # m/s^2 under the root of the resultant: at rest it has slopes too


@dataclass(frozen=True, slots=True, kw_only=True)
class PointAcceleration:
    """Resultant acceleration of a point of a body, m/s^2: |a|, without gravity.

    point: in the body's frame.  gravity: an accelerometer also feels it; with the system's, a - g is taken.
    Channels in the body's axes (`components`), and with them filters, are known of a `TreeSystem`.
    """

    body: str
    point: tuple[float, ...] = (0.0, 0.0, 0.0)
    gravity: tuple[float, ...] = (0.0, 0.0, 0.0)
    has_rates: bool = False

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,) |a| at every node."""
        a = trajectory.point_series(self.body, self.point).acceleration
        a = a - np.array(self.gravity)[: a.shape[1]]
        return np.asarray(np.sqrt((a * a).sum(axis=1) + ROUND**2))

    def components(self, trajectory: Any) -> Array:
        """(steps + 1, 3) the acceleration in the body's axes, as three channels of an accelerometer."""
        if not hasattr(trajectory, "frames"):
            raise NotSupported("PointAcceleration looks at bodies of a TreeSystem for its components")
        f = trajectory.frames(self.body)
        arm = f.axes @ np.asarray(self.point, float)
        a = f.acceleration + np.cross(f.spin_rate, arm) + np.cross(f.spin, np.cross(f.spin, arm))
        return np.asarray(np.einsum("tji,tj->ti", f.axes, a - np.array(self.gravity)))

    def component_slopes(self, trajectory: Any, node: int, direction: Array) -> Slopes:
        """Partial derivatives of the component along a direction (3,) in the body's axes, at a node."""
        motion, place = trajectory.motion(node), trajectory.place(self.body)
        p = motion.point(place, np.asarray(self.point, float))
        axes, _, turns, _ = motion.frame(place)
        u = axes @ np.asarray(direction, float)
        # u turns with the body: du = e x u
        turning = np.cross(turns, u) @ (p.acceleration - np.array(self.gravity))
        return Slopes(
            position=p.acceleration_q @ u + turning, velocity=p.acceleration_v @ u, acceleration=p.place_q @ u
        )

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """Raises NotSupported: the rate of an acceleration is not a function of the state."""
        raise NotSupported("PointAcceleration has no rates; its peaks are refined through nodal values")

    def slopes(self, trajectory: Any, node: int) -> Slopes:
        """Partial derivatives of |a| at a node."""
        p = trajectory.point_motion(node, self.body, self.point)
        a = p.acceleration - np.array(self.gravity)[: len(p.acceleration)]
        u = a / np.sqrt(a @ a + ROUND**2)
        return Slopes(
            position=p.acceleration_q @ u, velocity=p.acceleration_v @ u, acceleration=p.place_q @ u
        )

    def rate_slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises NotSupported, as `rates`."""
        raise NotSupported("PointAcceleration has no rates; its peaks are refined through nodal values")


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadInjury:
    """HIC = max over t1 < t2, t2 - t1 <= duration, of (t2 - t1) [mean of a/g]^2.5, both times at nodes.

    quantity: an acceleration >= 0, m/s^2.  duration: 0.015 s (limit 700) or 0.036 s (limit 1000). Means are
    trapezoids; at the window found, the slopes are those of the value (envelope theorem).
    """

    quantity: Quantity
    duration: float = 0.015
    window: Window | None = None

    def _best(self, trajectory: Any) -> tuple[float, int, int, float]:
        """The value, first and last node of the interval, and the mean of a/g in it."""
        first, last = nodes_within(trajectory, self.window)
        h = one_step_length(trajectory.times, "an injury measure")
        most = int(self.duration / h + 1e-9)
        if most < 1 or last <= first:
            raise ValueError(f"head injury needs steps within {self.duration} s, got {h:.3g} s")
        a = np.asarray(self.quantity.values(trajectory))[first : last + 1] / STANDARD_GRAVITY
        total = np.concatenate([[0.0], np.cumsum(0.5 * h * (a[1:] + a[:-1]))])
        best = (-1.0, 0, 1, 0.0)
        for lag in range(1, min(most, len(a) - 1) + 1):
            mean = (total[lag:] - total[:-lag]) / (lag * h)
            at = int(mean.argmax())
            value = lag * h * max(float(mean[at]), 0.0) ** 2.5
            if value > best[0]:
                best = (value, first + at, first + at + lag, float(mean[at]))
        return best

    def value(self, trajectory: Any) -> float:
        """The criterion."""
        return self._best(trajectory)[0]

    def weights(self, trajectory: Any) -> tuple[NodeWeight, ...]:
        """Slopes by the acceleration at the nodes of the interval."""
        _, begin, end, mean = self._best(trajectory)
        h = one_step_length(trajectory.times, "an injury measure")
        by = 2.5 * max(mean, 0.0) ** 1.5 * h / STANDARD_GRAVITY
        return tuple(
            NodeWeight(node, by * (0.5 if node in (begin, end) else 1.0)) for node in range(begin, end + 1)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ClipLevel:
    """The highest level that a quantity exceeds for `duration` in all (3 ms), in the quantity's unit.

    Every node stands for one step; between sorted nodal values the level is linear.
    """

    quantity: Quantity
    duration: float = 0.003
    window: Window | None = None

    def weights(self, trajectory: Any) -> tuple[NodeWeight, ...]:
        """The two nodes between which the level lies."""
        first, last = nodes_within(trajectory, self.window)
        h = one_step_length(trajectory.times, "an injury measure")
        place = self.duration / h - 0.5  # the k-th largest value is exceeded for (k + 1/2) steps
        k = int(np.floor(place))
        if k < 0 or k + 1 > last - first:
            raise ValueError(
                f"clip level needs steps shorter than {self.duration} s within the window, got {h:.3g} s"
            )
        values = np.asarray(self.quantity.values(trajectory))[first : last + 1]
        order = np.argsort(-values, kind="stable")
        share = place - k
        return (
            NodeWeight(first + int(order[k]), 1.0 - share), NodeWeight(first + int(order[k + 1]), share),
        )  # fmt: skip

    def value(self, trajectory: Any) -> float:
        """The level."""
        values = self.quantity.values(trajectory)
        return float(sum(part.weight * values[part.node] for part in self.weights(trajectory)))
