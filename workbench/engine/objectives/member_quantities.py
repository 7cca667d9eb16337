"""What one member does, as quantities with exact slopes: how far it is stretched, how hard it pulls."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory
from .line import line_at
from .member_histories import MemberHistories, member_histories, member_line
from .quantities import Slopes

__all__ = ["MemberElongation", "MemberForce"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class MemberElongation:
    """Elongation of a member, m: length less natural length; the stroke of what is pressed with "shorter".

    member: its number.  sense: "longer" counts stretch as positive, "shorter" counts shortening.
    """

    member: int
    sense: Literal["longer", "shorter"] = "longer"
    has_rates: bool = True

    @property
    def _sign(self) -> float:
        return 1.0 if self.sense == "longer" else -1.0

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) elongation at every node."""
        return self._sign * _history(trajectory, self.member).elongation[:, 0]

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) its rate."""
        return self._sign * _history(trajectory, self.member).rate[nodes, 0]

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives at a node."""
        line = line_at(trajectory, node, *member_line(trajectory.system.members[self.member]))
        return Slopes(position=self._sign * line.length_q)

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of the rate at a node."""
        line = line_at(trajectory, node, *member_line(trajectory.system.members[self.member]))
        return Slopes(position=self._sign * line.rate_q, velocity=self._sign * line.length_q)


@dataclass(frozen=True, slots=True, kw_only=True)
class MemberForce:
    """Force of a member, N, at its density: alpha^power f(elongation, rate, t), eq. (2.1).

    member: its number.  sense: "tension" counts a pull as positive, "compression" a push. A force has no rate
    that is a function of the state; its peaks are refined through nodal values.
    """

    member: int
    sense: Literal["tension", "compression"] = "tension"
    has_rates: bool = False

    @property
    def _sign(self) -> float:
        return 1.0 if self.sense == "tension" else -1.0

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) force at every node."""
        return self._sign * _history(trajectory, self.member).force[:, 0]

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """Raises NotSupported: the rate of a force is not a function of the state."""
        raise NotSupported("MemberForce has no rates; its peaks are refined through nodal values")

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives at a node: by position and velocity through elongation and rate, by density."""
        member, density = trajectory.system.members[self.member], np.asarray(trajectory.density)
        line = line_at(trajectory, node, *member_line(member))
        found = _history(trajectory, self.member)
        pull, damp = self._sign * found.by_elongation[node, 0], self._sign * found.by_rate[node, 0]
        by_density = np.zeros(len(density))
        alpha, power = float(density[self.member]), float(member.power)
        slope = 1.0 if power == 1.0 else power * alpha ** (power - 1.0)
        by_density[self.member] = self._sign * slope * found.unit_force[node, 0]
        return Slopes(
            position=pull * line.length_q + damp * line.rate_q, velocity=damp * line.length_q,
            density=by_density,
        )  # fmt: skip

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Raises NotSupported, as `rates`."""
        raise NotSupported("MemberForce has no rates; its peaks are refined through nodal values")


def _history(trajectory: AnyTrajectory, member: int) -> MemberHistories:
    return member_histories(trajectory, [member])
