"""Runs of spatial trees at the edge: as an xarray Dataset, and as frames for the report's viewer.

A body is drawn as the smallest box along its own axes that holds its joint, its centre of mass and the points
where other bodies, members, bushings and contacts are tied to it; or as the shapes (`Drawn`) that a caller
gives, several on one body or none on bodies that nobody wants to see.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.engine import TreeTrajectory, member_histories
from workbench.engine.elements.timed import bare
from workbench.engine.integration.grids import step_lengths
from workbench.errors import StudyError
from workbench.motion.frames import Body, Member, MotionRun, rotate

__all__ = ["Drawn", "tree_dataset", "tree_frames"]

Array = NDArray[np.float64]

_LEAST = 0.04  # m, smallest edge of a drawn box
_KINDS = {
    "Airbag": "airbag",
    "VentedAirbag": "airbag",
    "Retractor": "retractor",
    "Impulse": "retractor",
}  # all other laws are drawn as belts


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A shape on a body of the system.

    on: the body that it moves with, or "ground"    at: its middle in that body's frame, m
    turn: of its own axes from those of the body, a unit quaternion w, x, y, z
    """

    shape: Body
    on: str
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


def _names(trajectory: TreeTrajectory) -> list[str]:
    return [body.name for body in trajectory.system.bodies]


def _quaternions(axes: Array) -> Array:
    """(T, 4) w, x, y, z of rotations (T, 3, 3), each on the side of the one before it."""
    q = np.roll(Rotation.from_matrix(axes).as_quat(), 1, axis=1)
    turned = np.einsum("ti,ti->t", q[1:], q[:-1]) < 0.0
    signs = np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))
    return np.asarray(q * signs[:, None])


def tree_dataset(trajectory: TreeTrajectory) -> xr.Dataset:
    """Motion of a tree by time, body and axis; its joint coordinates, states and energies.

    Dimensions: time (s), body, axis (x, y, z, global), quaternion (w, x, y, z), coordinate ("arm 0": first of
    the joint of `arm`), speed (of the joints, likewise), state (of first order). Positions, velocities and
    accelerations are those of the bodies' frames, where their joints are.
    """
    r, names = trajectory, _names(trajectory)
    frames = [r.frames(name) for name in names]
    moving = ("time", "body", "axis")

    def by_body(field: str) -> Array:
        return np.stack([getattr(f, field) for f in frames], axis=1)

    coordinates, speeds = (
        [f"{name} {i}" for name in names for i in range(part[name].stop - part[name].start)]
        for part in (r.parts.coordinates, r.parts.columns)
    )
    at_q, at_v = (
        [i for name in names for i in range(part[name].start, part[name].stop)]
        for part in (r.parts.coordinates, r.parts.columns)
    )
    return xr.Dataset(
        {
            "position": (moving, by_body("origin"), {"units": "m"}),
            "orientation": (
                ("time", "body", "quaternion"),
                np.stack([_quaternions(f.axes) for f in frames], axis=1),
                {"units": "1"},
            ),
            "velocity": (moving, by_body("velocity"), {"units": "m/s"}),
            "spin": (moving, by_body("spin"), {"units": "rad/s"}),
            "acceleration": (moving, by_body("acceleration"), {"units": "m/s^2"}),
            "joint_position": (("time", "coordinate"), r.position[:, at_q], {"units": "m, rad"}),
            "joint_velocity": (("time", "speed"), r.velocity[:, at_v], {"units": "m/s, rad/s"}),
            "states": (("time", "state"), r.states),
            "kinetic_energy": ("time", r.kinetic_energy(), {"units": "J"}),
            "stored_energy": ("time", r.stored_energy(), {"units": "J"}),
            "gravity_energy": ("time", r.gravity_energy(), {"units": "J"}),
        },
        coords={
            "time": ("time", r.times, {"units": "s"}), "body": names, "axis": ["x", "y", "z"],
            "quaternion": ["w", "x", "y", "z"], "coordinate": coordinates, "speed": speeds,
            "state": list(r.state_names),
        },
        attrs={
            "scheme": repr(r.scheme), "step": float(step_lengths(r.times).max()), "status": r.status.value,
        },
    )  # fmt: skip


def _tied_points(trajectory: TreeTrajectory) -> dict[str, Array]:
    """Body name -> (points, 3) where something is tied to it, in its own frame."""
    system = trajectory.system
    found: dict[str, list[Any]] = {b.name: [(0.0, 0.0, 0.0), b.centre] for b in system.bodies}

    def tie(name: str, point: Any) -> None:
        if name in found:
            found[name].append(point)

    for body in system.bodies:
        tie(body.parent, body.at)
    for part in (*system.members, *system.bushings, *system.struts):
        tie(part.a, part.point_a)
        tie(part.b, part.point_b)
    for contact in system.contacts:
        tie(contact.a, contact.point)
    return {name: np.array(points, dtype=float) for name, points in found.items()}


def tree_frames(
    trajectory: TreeTrajectory,
    nodes: Array,
    *,
    label: str,
    roles: Mapping[str, str],
    thinnest: float,
    drawn: Sequence[Drawn] = (),
) -> MotionRun:
    """A `MotionRun` at some nodes; see `trajectories.frames`."""
    shapes = tuple(drawn) or _boxes(trajectory, roles)
    names = _names(trajectory)
    for one in shapes:
        if one.on not in (*names, "ground"):
            raise StudyError(
                f"the shape {one.shape.name!r} is drawn on {one.on!r}; bodies of the run are "
                f"{', '.join(names)}"
            )
    poses = np.empty((len(nodes), len(shapes), 7))
    first: dict[str, int] = {}  # body -> the first shape on it, to whose frame members are tied
    for i, one in enumerate(shapes):
        if one.on == "ground":
            poses[:, i] = (*one.at, *one.turn)
            continue
        poses[:, i, :3] = trajectory.of(one.on, np.array(one.at))[nodes]
        turned = trajectory.frames(one.on).axes[nodes] @ Rotation.from_quat(np.roll(one.turn, -1)).as_matrix()
        poses[:, i, 3:] = _quaternions(turned)
        first.setdefault(one.on, i)

    def tied(body: str, point: Any) -> tuple[int, tuple[float, float, float]]:
        """The shape that an end of a member moves with, and its place in the axes of that."""
        if body not in first:
            if body in names:
                raise StudyError(f"members are tied to {body!r}, on which no shape is drawn")
            return -1, (float(point[0]), float(point[1]), float(point[2]))
        one = shapes[first[body]]
        back = np.array(one.turn) * (1.0, -1.0, -1.0, -1.0)
        x, y, z = rotate(back, np.asarray(point, float) - np.array(one.at))
        return first[body], (float(x), float(y), float(z))

    kept = [i for i in range(len(trajectory.system.members)) if trajectory.density[i] >= thinnest]
    members = []
    for i in kept:
        m = trajectory.system.members[i]
        (body_a, point_a), (body_b, point_b) = tied(m.a, m.point_a), tied(m.b, m.point_b)
        members.append(Member(
            name=m.name or f"M{i}", kind=_KINDS.get(type(bare(m.law)).__name__, "belt"),
            density=float(min(1.0, trajectory.density[i])),
            body_a=body_a, point_a=point_a, body_b=body_b, point_b=point_b,
        ))  # fmt: skip
    forces = member_histories(trajectory, kept).force[nodes] if kept else None
    bodies = tuple(one.shape for one in shapes)
    return MotionRun(label=label, bodies=bodies, poses=poses, members=tuple(members), forces=forces)


def _boxes(trajectory: TreeTrajectory, roles: Mapping[str, str]) -> tuple[Drawn, ...]:
    """Each body as the box about the points that are tied to it."""
    found = []
    for name, points in _tied_points(trajectory).items():
        low, high = points.min(axis=0), points.max(axis=0)
        x, y, z = (float(edge) for edge in np.maximum(high - low, _LEAST))
        a, b, c = (float(m) for m in 0.5 * (low + high))
        shape = Body(name=name, shape="box", size=(x, y, z), role=roles.get(name, "other"), see_through=True)
        found.append(Drawn(shape=shape, on=name, at=(a, b, c)))
    return tuple(found)
