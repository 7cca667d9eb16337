"""The run of a tree on its time grid: states, places and motions of the bodies, momenta and energies."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..integration.schemes import Scheme
from ._kernels.contraction import link_histories, momenta
from ._kernels.tables import TreeRun, TreeTables, TreeWork, tree_work
from .compiled import Place, TreeCompiled, tree_compiled
from .system import TreeSystem

__all__ = ["Frames", "TreeTrajectory"]

Array = np.ndarray[Any, Any]


class Frames(NamedTuple):
    """A body's frame over some nodes, in global axes: axes as columns, origin, and their motion."""

    axes: Array  # (k, 3, 3)
    origin: Array  # (k, 3)
    spin: Array  # (k, 3)
    velocity: Array  # (k, 3) of the origin
    spin_rate: Array  # (k, 3)
    acceleration: Array  # (k, 3) of the origin


@dataclass(frozen=True, kw_only=True, eq=False)
class TreeTrajectory:
    """States of a tree at the nodes of the time grid.

    times: (steps + 1,).  position: (steps + 1, nq), unit quaternions for spherical and floating joints.
    velocity, acceleration: (steps + 1, n), spins in the bodies' frames.  state, state_rate: (steps + 1, x)
    first-order states in the order of `state_names`.  Where a body's joint stands: `columns`, `coordinates`.
    """

    system: TreeSystem
    density: Array
    scheme: Scheme
    times: Array
    tables: TreeTables
    run: TreeRun
    newton: int
    factorisations: int
    memo: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def parts(self) -> TreeCompiled:
        """The compiled system."""
        return tree_compiled(self.system)

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return float(self.times[1] - self.times[0])

    @property
    def size(self) -> int:
        """Velocities of the joints."""
        return len(self.tables.column)

    @property
    def position(self) -> Array:
        """(steps + 1, nq)."""
        return self.run.position

    @property
    def velocity(self) -> Array:
        """(steps + 1, n)."""
        return self.run.velocity[:, : self.size]

    @property
    def acceleration(self) -> Array:
        """(steps + 1, n)."""
        return self.run.rate[:, : self.size]

    @property
    def state(self) -> Array:
        """(steps + 1, x) first-order states."""
        return self.run.velocity[:, self.size :]

    @property
    def state_rate(self) -> Array:
        """(steps + 1, x) their rates."""
        return self.run.rate[:, self.size :]

    @property
    def state_names(self) -> tuple[str, ...]:
        """What the states are."""
        return self.parts.states

    @cached_property
    def work(self) -> TreeWork:
        """Work arrays of the kernels on this run's tables."""
        return tree_work(self.tables, len(self.parts.states))

    def columns(self, body: str) -> slice:
        """Where a body's joint stands in velocity and acceleration; raises ValueError for a stranger."""
        return self.parts.columns[self._known(body)]

    def coordinates(self, body: str) -> slice:
        """Where a body's joint stands in position."""
        return self.parts.coordinates[self._known(body)]

    def _known(self, body: str) -> str:
        if body not in self.parts.columns:
            raise ValueError(f"system has no body '{body}'; it has {', '.join(self.parts.columns)}")
        return body

    def place(self, body: str) -> Place:
        """A body's frame on its link; 'ground' is known."""
        if body not in self.parts.places:
            raise ValueError(f"system has no body '{body}'; it has {', '.join(self.parts.places)}")
        return self.parts.places[body]

    def links(self, nodes: Sequence[int] | Array | None = None) -> tuple[Array, Array, Array, Array]:
        """Rotations, origins, twists and accelerations of all links at some nodes (all: None, remembered)."""
        if nodes is None and "links" in self.memo:
            return self.memo["links"]  # type: ignore[no-any-return]
        some = np.arange(len(self.times)) if nodes is None else np.asarray(nodes, int)
        count, links = len(some), len(self.tables.link) + 1
        out = tuple(np.empty((count, links, k)) for k in (9, 3, 6, 6))
        run = self.run
        if nodes is None:
            link_histories(self.tables, self.work, 0, run.position, run.velocity, run.rate, *out)
            self.memo["links"] = out
        else:
            for i, node in enumerate(some):
                at = slice(node, node + 1)
                part = tuple(x[i : i + 1] for x in out)
                link_histories(
                    self.tables, self.work, int(node), run.position[at], run.velocity[at], run.rate[at], *part
                )
        return out[0], out[1], out[2], out[3]

    def frames(self, body: str) -> Frames:
        """A body's frame and its motion at all nodes."""
        place = self.place(body)
        turn, origin, twist, push = (x[:, place.link] for x in self.links())
        return moved_frames(place, turn.reshape(-1, 3, 3), origin, twist, push)

    def of(self, body: str, point: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
        """(steps + 1, 3) place of a body's point in global axes."""
        frames = self.frames(body)
        return np.asarray(frames.origin + frames.axes @ np.asarray(point, float))

    def momentum(self) -> Array:
        """(steps + 1, 6) angular momentum about the global origin and linear momentum."""
        return np.asarray(self._momenta()[:, :6])

    def kinetic_energy(self) -> Array:
        """(steps + 1,) J."""
        return np.asarray(self._momenta()[:, 6])

    def _momenta(self) -> Array:
        if "momenta" not in self.memo:
            out = np.zeros((len(self.times), 7))
            momenta(self.tables, self.work, 0, self.run.position, self.run.velocity, self.run.rate, out)
            self.memo["momenta"] = out
        return np.asarray(self.memo["momenta"])

    def gravity_energy(self) -> Array:
        """(steps + 1,) potential of gravity, J, zero at the global origin."""
        turn, origin, _, _ = self.links()
        mass, first = self.tables.inertia[:, 0], self.tables.inertia[:, 1:4]
        moment = np.einsum("tlij,lj->ti", turn[:, :-1].reshape(-1, len(mass), 3, 3), first)
        moment += np.einsum("tli,l->ti", origin[:, :-1], mass)
        return np.asarray(-moment @ self.tables.gravity)


def moved_frames(place: Place, turn: Array, origin: Array, twist: Array, push: Array) -> Frames:
    """A frame at `place` on a link, from the link's rotation (k, 3, 3), origin, twist and acceleration (k,
    6)."""
    spin, rate = twist[:, :3], push[:, :3]
    arm = turn @ place.at
    across = np.cross(spin, arm)
    return Frames(
        axes=turn @ place.turn, origin=origin + arm, spin=spin, velocity=twist[:, 3:] + across,
        spin_rate=rate, acceleration=push[:, 3:] + np.cross(rate, arm) + np.cross(spin, across),
    )  # fmt: skip
