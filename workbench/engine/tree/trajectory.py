"""The run of a tree on its time grid: states, places and motions of the bodies, momenta and energies."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..elements._kernels_spatial_bushing import bushing_forces
from ..errors import NotSupported
from ..integration.kinds import (
    Adjoints,
    Change,
    Linearised,
    MemberPower,
    StateSensitivities,
    Widths,
    read_only,
)
from ..integration.outcome import Diagnosis, Status
from ..integration.points import PointMotion, PointSeries
from ..integration.run_state import Course, GoesOn, RunState
from ..integration.schemes import Scheme
from ..integration.seeds import NodeSeeds
from ._kernels.contraction import link_histories, member_states, momenta
from ._kernels.surfaces import surface_histories
from ._kernels.tables import TreeRun, TreeTables, TreeWork, tree_work
from .compiled import Place, TreeCompiled, tree_compiled
from .loops.histories import CutForce, cut_force
from .slopes import NodeMotion, cross, crossed
from .steps.halved import TakenSteps
from .system import TreeSystem
from .view import SpatialView

__all__ = ["Frames", "SurfaceForces", "TreeTrajectory"]

Array = np.ndarray[Any, Any]


class Frames(NamedTuple):
    """A body's frame over some nodes, in global axes: axes as columns, origin, and their motion."""

    axes: Array  # (k, 3, 3)
    origin: Array  # (k, 3)
    spin: Array  # (k, 3)
    velocity: Array  # (k, 3) of the origin
    spin_rate: Array  # (k, 3)
    acceleration: Array  # (k, 3) of the origin


class SurfaceForces(NamedTuple):
    """Forces (steps + 1, k, 3) in global axes on the bodies named first, and where they act, m."""

    force: Array
    point: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class TreeTrajectory(GoesOn):
    """States of a tree at the nodes of the time grid.

    times: (steps + 1,).  position: (steps + 1, nq), unit quaternions (w, x, y, z) for spherical and floating
    joints.  velocity, acceleration: (steps + 1, n), spins in the bodies' frames.  states, state_rates:
    (steps + 1, x) of first order, in the order of `state_names`.  `columns` and `coordinate` say where a
    body's joint stands.  multiplier: (steps + 1, m), one per independent condition of the cut joints.
    """

    system: TreeSystem
    density: Array
    scheme: Scheme
    times: Array
    tables: TreeTables
    nodes: TreeRun
    diagnosis: Diagnosis
    adjoints: Adjoints
    points: tuple[TreeTables, TreeRun] | None = None  # stages of an explicit scheme, nodes among them
    taken: TakenSteps | None = None  # where some steps were halved: all that were made
    course: Course | None = None
    last: Callable[[Any], RunState] | None = None  # what the run left at its last node
    status: Status = Status.COMPLETE
    memo: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def parts(self) -> TreeCompiled:
        """The compiled system."""
        return tree_compiled(self.system)

    @property
    def size(self) -> int:
        """Velocities of the joints."""
        return len(self.tables.column)

    @property
    def widths(self) -> Widths:
        """Lengths of slopes and seeds; by position those of small motions, one per velocity."""
        n = self.size
        return Widths(n, n, n, len(self.tables.cut), len(self.parts.states))

    @property
    def position(self) -> Array:
        """(steps + 1, nq)."""
        return read_only(self.nodes.position)

    @property
    def velocity(self) -> Array:
        """(steps + 1, n)."""
        return read_only(self.nodes.velocity[:, : self.size])

    @property
    def acceleration(self) -> Array:
        """(steps + 1, n)."""
        return read_only(self.nodes.rate[:, : self.size])

    @property
    def multiplier(self) -> Array:
        """(steps + 1, m) of the independent conditions of the cut joints, N or N m."""
        return read_only(self.nodes.rate[:, self.size + len(self.parts.states) :])

    @property
    def states(self) -> Array:
        """(steps + 1, x) states of first order."""
        return read_only(self.nodes.velocity[:, self.size : self.size + len(self.parts.states)])

    @property
    def state_rates(self) -> Array:
        """(steps + 1, x) their rates."""
        return read_only(self.nodes.rate[:, self.size : self.size + len(self.parts.states)])

    @property
    def state_names(self) -> tuple[str, ...]:
        """What the states are."""
        return self.parts.states

    def start_at(self, node: int) -> tuple[Array, Array]:
        """Places and velocities at a node, states behind them, as `start` of another run."""
        return self.nodes.position[node].copy(), self.nodes.velocity[node].copy()

    @cached_property
    def work(self) -> TreeWork:
        """Work arrays of the kernels on this run's tables."""
        return tree_work(self.tables, len(self.parts.states))

    def columns(self, body: str) -> slice:
        """Where a body's joint stands in velocity and acceleration; raises ValueError for a stranger."""
        return self.parts.columns[self._known(body)]

    def coordinate(self, name: str) -> slice | None:
        """Where a body's joint stands in position; None where it has no freedom."""
        part = self.parts.coordinates[self._known(name)]
        return None if part.start == part.stop else part

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
        run = self.nodes
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

    def frames(self, body: str, nodes: Sequence[int] | Array | None = None) -> Frames:
        """A body's frame and its motion at some nodes (None: all)."""
        place, some = self.place(body), slice(None) if nodes is None else np.asarray(nodes, int)
        turn, origin, twist, push = (x[some, place.link] for x in self.links())
        return moved_frames(place, turn.reshape(-1, 3, 3), origin, twist, push)

    def of(self, name: str, point: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
        """(steps + 1, 3) place of a body's point in global axes."""
        place = self.place(name)
        turn, origin = self.links()[0][:, place.link].reshape(-1, 3, 3), self.links()[1][:, place.link]
        return np.asarray(origin + turn @ place.at + turn @ place.turn @ np.asarray(point, float))

    def bushing_force(self, name: str) -> Array:
        """(steps + 1, 3) the force of a bushing on its body `a`, in the axes of `b`, N; raises ValueError."""
        bushings = self.system.bushings
        number = next((i for i, bushing in enumerate(bushings) if bushing.name == name), None)
        if number is None:
            raise ValueError(f"system has no bushing '{name}'; it has {', '.join(b.name for b in bushings)}")
        own = bushings[number]
        f, g = self.frames(own.a), self.frames(own.b)
        arm = f.axes @ np.asarray(own.point_a, float)
        apart = f.origin + arm - g.origin
        speed = f.velocity + cross(f.spin, arm) - g.velocity - cross(g.spin, apart)
        r, v = (np.einsum("tji,tj->ti", g.axes, x) for x in (apart, speed))
        state = self.tables.bushing_pair[number, 1]
        damage = self.states[:, state].copy() if state >= 0 else np.zeros(len(r))
        column = np.array(own.column())[:, None]  # its points in the bodies' frames
        out = np.empty((len(r), 3))
        bushing_forces(
            column, 0, r - np.asarray(own.point_b, float), v, damage, False, np.zeros((3, 3)), out
        )  # fmt: skip
        return out

    def cut_force(self, name: str) -> CutForce:
        """What the cut joint of a name (or "a-b") does to its body `a`; raises ValueError for a stranger."""
        return cut_force(self, name)

    def point_series(self, body: str, point: Sequence[float]) -> PointSeries:
        """A point of a body (its frame, m) at every node."""
        f = self.frames(body)
        arm = f.axes @ np.asarray(point, float)
        around = cross(f.spin, arm)
        return PointSeries(
            place=f.origin + arm, velocity=f.velocity + around,
            acceleration=f.acceleration + cross(f.spin_rate, arm) + cross(f.spin, around),
        )  # fmt: skip

    def point_motion(self, node: int, body: str, point: Sequence[float]) -> PointMotion:
        """A point of a body at a node, with slopes by small motions and velocity."""
        return self.motion(node).point(self.place(body), np.asarray(point, float))

    def contact_forces(self) -> SurfaceForces:
        """Forces of the system's contacts on their bodies `a`, in the order of the contacts."""
        count = len(self.system.contacts)
        return SurfaceForces(*(x[:, :count] for x in self._surfaces()))

    def tyre_forces(self) -> SurfaceForces:
        """Forces of the road on the tyres, in the order of the tyres; rolling resistance is a moment
        besides."""
        count = len(self.system.contacts)
        return SurfaceForces(*(x[:, count : count + len(self.system.tyres)] for x in self._surfaces()))

    def strut_force(self, name: str) -> Array:
        """(steps + 1,) tension of a strut by its name, or "a-b" without one, N; raises ValueError."""
        called = [strut.called for strut in self.system.struts]
        if name not in called:
            raise ValueError(f"system has no strut '{name}'; it has {', '.join(called) or 'none'}")
        at = len(self.tables.surface) - len(called) + called.index(name)  # struts stand last
        own, pair = self.system.struts[called.index(name)], self.tables.pair[self.tables.surface[at, 0]]
        apart = self.of(own.a, own.point_a) - self.of(own.b, own.point_b)
        sign = -1.0 if pair[0] == self.place(own.a).link else 1.0  # forces are those on the pair's first link
        return sign * np.einsum("ij,ij->i", self._surfaces()[0][:, at], apart) / np.linalg.norm(apart, axis=1)

    def _surfaces(self) -> tuple[Array, Array]:
        if "surfaces" not in self.memo:
            run, shape = self.nodes, (len(self.times), len(self.tables.surface), 3)
            out = np.zeros(shape), np.zeros(shape)
            surface_histories(self.tables, self.work, run.position, run.velocity, run.rate, self.size, *out)
            self.memo["surfaces"] = out
        return self.memo["surfaces"]  # type: ignore[no-any-return]

    def momentum(self) -> Array:
        """(steps + 1, 6) angular momentum about the global origin and linear momentum."""
        return np.asarray(self._momenta()[:, :6])

    def kinetic_energy(self) -> Array:
        """(steps + 1,) J."""
        return np.asarray(self._momenta()[:, 6])

    def _momenta(self) -> Array:
        if "momenta" not in self.memo:
            out = np.zeros((len(self.times), 7))
            momenta(self.tables, self.work, 0, self.nodes.position, self.nodes.velocity, self.nodes.rate, out)
            self.memo["momenta"] = out
        return np.asarray(self.memo["momenta"])

    def gravity_energy(self) -> Array:
        """(steps + 1,) potential of gravity, J, zero at the global origin."""
        turn, origin, _, _ = self.links()
        mass, first = self.tables.inertia[:, 0], self.tables.inertia[:, 1:4]
        moment = np.einsum("tlij,lj->ti", turn[:, :-1].reshape(-1, len(mass), 3, 3), first)
        moment += np.einsum("tli,l->ti", origin[:, :-1], mass)
        return np.asarray(-moment @ self.tables.gravity)

    def stored_energy(self) -> Array:
        """(steps + 1,) energy stored in the members, J."""
        if "stored" not in self.memo:
            energy = np.zeros((len(self.times), len(self.density)))
            self._member_states(np.arange(len(self.times)), energy)
            self.memo["stored"] = energy @ self.tables.scale
        return np.asarray(self.memo["stored"])

    def _member_states(self, nodes: Array, energy: Array) -> None:
        run, zero = self.nodes, np.zeros(len(self.density))
        member_states(
            self.tables, self.work, nodes, run.position, run.velocity, run.rate, zero, energy
        )  # fmt: skip

    def motion(self, node: int) -> NodeMotion:
        """How the links move with the coordinates at a node."""
        tables, work = self.tables, self.work
        self.links([node])  # leaves the node's columns, twists and accelerations in the work arrays
        links, own = len(tables.link), tables.column[:, 0]
        moves = np.zeros((links + 1, self.size), bool)
        for link, (_, parent, first, count, _, _) in enumerate(tables.link):
            moves[link] = moves[parent] if parent < links else False
            moves[link, first : first + count] = True
        return NodeMotion(
            origin=work.origin.copy(), turn=work.turn.reshape(-1, 3, 3).copy(), place=work.place.copy(),
            columns=work.s.copy(), twist=work.twist.copy(), push=work.push.copy(), gravity=tables.gravity,
            parent=tables.link[own, 1], own=own, moves=moves,
        )  # fmt: skip

    def member_power(self, nodes: Sequence[int]) -> list[MemberPower]:
        """Rate and slopes of the energy stored in the members, at some nodes."""
        return [self._power(int(node)) for node in nodes]

    def _power(self, node: int) -> MemberPower:
        motion, tables, work = self.motion(node), self.tables, self.work
        energy = np.zeros((1, len(self.density)))
        self._member_states(np.array([node]), energy)
        a, b, u = (work.line[:, 3 * i : 3 * i + 3] for i in range(3))
        rows = np.repeat(tables.segment[:, 0], tables.segment[:, 3] - tables.segment[:, 2])
        first, second = tables.pair[rows, 0], tables.pair[rows, 1]
        sign = motion.moves[first].astype(float) - motion.moves[second]
        wrench = np.concatenate([cross(a, u), u], axis=1)  # of a unit pull
        along = sign * (wrench @ motion.columns.T)  # (N, n) length by q
        speed = crossed(motion.columns, motion.twist[first][:, None]) + crossed(
            motion.twist[motion.parent], motion.columns
        )
        va, vb = motion.twist[first], motion.twist[second]
        g = va[:, 3:] + cross(va[:, :3], a) - vb[:, 3:] - cross(vb[:, :3], b)
        length = work.delta + tables.geometry[6]
        h = (g - work.rate[:, None] * u) / length[:, None] + cross(u, va[:, :3])
        lever = np.concatenate([cross(a, h), h], axis=1)
        rate_q = sign * (lever @ motion.columns.T + np.einsum("ie,ije->ij", wrench, speed))
        pull = tables.scale * work.f
        return MemberPower(
            rate=float(pull @ work.rate), force=pull @ along,
            drift=(tables.scale * work.fd * work.rate) @ along + pull @ rate_q,
            explicit=np.array([energy[0], work.f * work.rate]),
        )  # fmt: skip

    def by_density(self, by_scale: Array) -> Array:
        """From slopes by scale in segment order to slopes by density in member order."""
        power, alpha = self.parts.power, self.density
        slope = np.where(power == 1.0, 1.0, power * np.where(power == 1.0, 1.0, alpha) ** (power - 1.0))
        return np.asarray(by_scale[..., np.argsort(self.parts.order)] * slope)

    def adjoint(self, seeds: NodeSeeds) -> Array:
        """(R, N) gradients by density of the implicit parts, in the order of the rows: exact for the run."""
        return self.adjoints.by_density(self, seeds)

    def parameter_adjoint(self, seeds: NodeSeeds) -> Any:
        """One row of seeds contracted with every parameter: a `TreeGradient`."""
        return self.adjoints.by_parameter(self, seeds)

    def change_adjoint(
        self, values: Sequence[Callable[[Any], float]], seeds: NodeSeeds, changes: Sequence[Change]
    ) -> Array:
        """(R, changes) slopes of each value(trajectory), whose seeds are given, by changes of the system."""
        return self.adjoints.by_change(self, values, seeds, changes)

    def view(self, *, bodies: tuple[str, ...], reference: str, shares: tuple[float, ...]) -> SpatialView:
        """The mean of some bodies' centres of mass, weighted by shares, in the frame of a reference."""
        centres = {body.name: body.centre for body in self.system.bodies}
        for name in (*bodies, reference):
            self.place(name)
        total = sum(shares)
        return SpatialView(
            trajectory=self, reference=reference,
            points=tuple((n, centres[n], s / total) for n, s in zip(bodies, shares, strict=True)),
        )  # fmt: skip

    def linearised(self, *, method: str, times: Array | None = None) -> Linearised:
        """Raises NotSupported: the forward methods are written for planar systems."""
        raise NotSupported(f"{method} is written for planar systems; use method='discrete_adjoint'")

    @property
    def goes_forward(self) -> bool:
        """No: only the adjoint is known here."""
        return False

    def state_sensitivities(self, *, with_rates: bool) -> StateSensitivities:
        """Raises NotSupported: only the adjoint is known here."""
        raise NotSupported("forward sensitivities are written for planar systems; use the adjoint")


def moved_frames(place: Place, turn: Array, origin: Array, twist: Array, push: Array) -> Frames:
    """A frame at `place` on a link, from its rotation (k, 3, 3), origin, twist and acceleration (k, 6)."""
    spin, rate = twist[:, :3], push[:, :3]
    arm = turn @ place.at
    across = cross(spin, arm)
    return Frames(
        axes=turn @ place.turn, origin=origin + arm, spin=spin, velocity=twist[:, 3:] + across,
        spin_rate=rate, acceleration=push[:, 3:] + cross(rate, arm) + cross(spin, across),
    )  # fmt: skip
