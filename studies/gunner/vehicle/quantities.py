"""Histories of the vehicle as quantities with exact slopes, for the engine's objectives."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from workbench.engine import Slopes

from .states import vehicle_states

__all__ = ["VehicleHistory"]

Array = np.ndarray[Any, Any]
BODY = "vehicle"


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleHistory:
    """A history of `vehicle_states`, in its unit; size: its absolute value, with the slopes of its sign.

    Angles turn about x, y, z of the vehicle, yaw first; a level heading u = (cos yaw, sin yaw, 0) turns with
    the yaw, so du = (-sin yaw, cos yaw, 0) dyaw.

    >>> VehicleHistory(name="roll", size=True).has_rates
    False
    """

    name: Literal["roll", "pitch", "yaw", "yaw_rate", "speed", "drift", "forward", "lateral"]
    size: bool = False
    has_rates: bool = False

    def _series(self, trajectory: Any) -> Array:
        return np.asarray(getattr(vehicle_states(trajectory), self.name))

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,) at every node."""
        found = self._series(trajectory)
        return np.abs(found) if self.size else found

    def slopes(self, trajectory: Any, node: int) -> Slopes:
        """Partial derivatives at a node."""
        by = self._signed_slopes(trajectory, node)
        if not self.size or self._series(trajectory)[node] >= 0.0:
            return by
        return Slopes(**{name: -part for name, part in by._asdict().items() if part is not None})

    def _signed_slopes(self, trajectory: Any, node: int) -> Slopes:
        axes, _, turns, spin_q = trajectory.motion(node).frame(trajectory.place(BODY))

        def moved(row: int, column: int) -> Array:
            """(n,) slopes of an entry of the axes."""
            return np.cross(turns, axes[:, column])[:, row]

        def angle(up: tuple[int, int], over: tuple[int, int]) -> Array:
            """(n,) slopes of atan2 of two entries of the axes."""
            y, x = axes[up], axes[over]
            return (x * moved(*up) - y * moved(*over)) / (x * x + y * y)

        match self.name:
            case "roll":
                return Slopes(position=angle((2, 1), (2, 2)))
            case "pitch":
                return Slopes(position=-moved(2, 0) / np.sqrt(1.0 - axes[2, 0] ** 2))
            case "yaw_rate":
                return Slopes(position=spin_q[:, 2], velocity=turns[:, 2])
        yaw_q = angle((1, 0), (0, 0))
        if self.name == "yaw":
            return Slopes(position=yaw_q)
        ahead = np.array([axes[0, 0], axes[1, 0], 0.0]) / np.hypot(axes[0, 0], axes[1, 0])
        aside = np.array([-ahead[1], ahead[0], 0.0])
        # the direction looked along, and what it becomes where the yaw grows
        along, turned = (ahead, aside) if self.name in ("speed", "forward") else (aside, -ahead)
        centre = next(body.centre for body in trajectory.system.bodies if body.name == BODY)
        p = trajectory.point_motion(node, BODY, centre)
        if self.name in ("speed", "drift"):
            return Slopes(
                position=p.velocity_q @ along + (p.velocity @ turned) * yaw_q, velocity=p.place_q @ along
            )
        return Slopes(
            position=p.acceleration_q @ along + (p.acceleration @ turned) * yaw_q,
            velocity=p.acceleration_v @ along, acceleration=p.place_q @ along,
        )  # fmt: skip

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """Raises ValueError: peaks are refined through nodal values."""
        raise ValueError(f"the vehicle's {self.name} is known at nodes only, without rates")

    def rate_slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises ValueError, as `rates`."""
        raise ValueError(f"the vehicle's {self.name} is known at nodes only, without rates")
