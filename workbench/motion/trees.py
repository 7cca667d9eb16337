"""Runs of spatial trees at the edge: as an xarray Dataset, and as frames for the report's viewer.

A body is drawn as the smallest box along its own axes that holds its joint, its centre of mass and the points
where other bodies, members, bushings and contacts are tied to it.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.engine import TreeTrajectory
from workbench.engine.elements.timed import bare
from workbench.motion.frames import Body, Member, MotionRun

__all__ = ["tree_dataset", "tree_frames"]

Array = NDArray[np.float64]

_LEAST = 0.04  # m, smallest edge of a drawn box
_KINDS = {"Airbag": "airbag", "Retractor": "retractor"}  # all other laws are drawn as belts


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
        attrs={"scheme": repr(r.scheme), "step": r.step, "status": r.status.value},
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
    for part in (*system.members, *system.bushings):
        tie(part.a, part.point_a)
        tie(part.b, part.point_b)
    for contact in system.contacts:
        tie(contact.a, contact.point)
    return {name: np.array(points, dtype=float) for name, points in found.items()}


def tree_frames(
    trajectory: TreeTrajectory, nodes: Array, *, label: str, roles: Mapping[str, str], thinnest: float
) -> MotionRun:
    """A `MotionRun` at some nodes; see `trajectories.frames`."""
    names, tied = _names(trajectory), _tied_points(trajectory)
    bodies, middles, poses = [], {}, []
    for name in names:
        low, high = tied[name].min(axis=0), tied[name].max(axis=0)
        middles[name] = 0.5 * (low + high)
        x, y, z = np.maximum(high - low, _LEAST)
        bodies.append(Body(
            name=name, shape="box", size=(float(x), float(y), float(z)), role=roles.get(name, "other"),
            see_through=True,
        ))  # fmt: skip
        axes = trajectory.frames(name).axes[nodes]
        place = trajectory.of(name, middles[name])[nodes]
        poses.append(np.concatenate([place, _quaternions(axes)], axis=1))
    index = {name: i for i, name in enumerate(names)}

    def seen(body: str, point: Any) -> tuple[float, float, float]:
        x, y, z = np.asarray(point, float) - middles.get(body, np.zeros(3))
        return float(x), float(y), float(z)

    members = tuple(
        Member(
            name=m.name or f"M{i}", kind=_KINDS.get(type(bare(m.law)).__name__, "belt"),
            density=float(min(1.0, trajectory.density[i])),
            body_a=index.get(m.a, -1), point_a=seen(m.a, m.point_a),
            body_b=index.get(m.b, -1), point_b=seen(m.b, m.point_b),
        )
        for i, m in enumerate(trajectory.system.members)
        if trajectory.density[i] >= thinnest
    )  # fmt: skip
    return MotionRun(label=label, bodies=tuple(bodies), poses=np.stack(poses, axis=1), members=members)
