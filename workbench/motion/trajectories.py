"""Runs of the engine at the edge: as an xarray Dataset, and as frames for the report's viewer.

    dataset(trajectory)          names, units and dimensions on the plain arrays of the engine
    frames(trajectory)           a `MotionRun` of boxes and members, for `Motion` and the stills

Bodies of the engine have no shape. A frame draws each as the smallest box, centred on its mass, that holds
the points where members, joints and bushings are tied to it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from workbench.engine import Trajectory, TreeTrajectory, member_histories
from workbench.engine.elements.timed import bare
from workbench.engine.integration.grids import step_lengths
from workbench.errors import StudyError
from workbench.motion.frames import Body, Member, MotionRun, planar_poses
from workbench.motion.trees import Drawn, tree_dataset, tree_frames

__all__ = ["Drawn", "dataset", "frames", "tied_points"]

Array = NDArray[np.float64]

_DEPTH = 0.06  # m, thickness of the drawn boxes
_LEAST = 0.04  # m, smallest edge of a drawn box
_KINDS = {
    "Airbag": "airbag",
    "VentedAirbag": "airbag",
    "Impulse": "retractor",
}  # all other laws are drawn as belts


def _names(trajectory: Trajectory | TreeTrajectory) -> list[str]:
    if isinstance(trajectory, TreeTrajectory):
        return [body.name for body in trajectory.system.bodies]
    system = trajectory.system
    return [body.name for body in (*system.free, *system.prescribed)]


def dataset(trajectory: Trajectory | TreeTrajectory) -> xr.Dataset:
    """Motion by time, body and axis; joint forces and residuals; energies.

    Dimensions: time (s), body (free bodies), axis (x, y, angle), row (of the joints). Units of the axis
    "angle" are rad where those of x and y are m. Runs of trees: `trees.tree_dataset`.

    >>> from workbench.engine import Body, Member, Spring, System, simulate
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))
    >>> ds = dataset(simulate(System(bodies=(mass,), members=(spring,)), [1.0], t_end=1.0, steps=200))
    >>> float(ds.position.sel(body="mass", axis="x", time=1.0).round(4))
    -0.0033
    """
    if isinstance(trajectory, TreeTrajectory):
        return tree_dataset(trajectory)
    r = trajectory
    free = [body.name for body in r.system.free]
    moving = ("time", "body", "axis")

    def by_body(table: Array) -> Array:
        return table.reshape(len(r.times), len(free), 3)

    return xr.Dataset(
        {
            "position": (moving, by_body(r.position), {"units": "m, rad"}),
            "velocity": (moving, by_body(r.velocity), {"units": "m/s, rad/s"}),
            "acceleration": (moving, by_body(r.acceleration), {"units": "m/s^2, rad/s^2"}),
            "multiplier": (("time", "row"), r.multiplier, {"units": "N, N m"}),
            "joint_residual": (("time", "row"), r.joint_residuals(), {"units": "m, rad"}),
            "kinetic_energy": ("time", r.kinetic_energy(), {"units": "J"}),
            "stored_energy": ("time", r.stored_energy(), {"units": "J"}),
            "mechanical_energy": ("time", r.mechanical_energy(), {"units": "J"}),
        },
        coords={"time": ("time", r.times, {"units": "s"}), "body": free, "axis": ["x", "y", "angle"]},
        attrs={
            "scheme": repr(r.scheme),
            "step": float(step_lengths(r.times).max()),
            "status": r.status.value,
        },
    )


def tied_points(trajectory: Trajectory) -> dict[str, Array]:
    """Body name -> (points, 2) where something is tied to it, in its own frame."""
    found: dict[str, list[Any]] = {name: [(0.0, 0.0)] for name in _names(trajectory)}
    system = trajectory.system
    for part in (*system.members, *system.joints, *system.bushings):
        for side in ("a", "b"):
            point = getattr(part, f"point_{side}", None)
            if point is not None and getattr(part, side) in found:
                found[getattr(part, side)].append(point)
    return {name: np.array(points, dtype=float) for name, points in found.items()}


def frames(
    trajectory: Trajectory | TreeTrajectory,
    *,
    label: str = "run",
    count: int = 60,
    roles: dict[str, str] | None = None,
    thinnest: float = 1e-3,
    drawn: Sequence[Drawn] = (),
) -> tuple[Array, MotionRun]:
    """Times (T,) and a `MotionRun` of about `count` frames, evenly taken from the run's nodes.

    roles: body name -> role of the viewer ("occupant", "seat", ...).    thinnest: members of a smaller
    density are not drawn.    drawn: the shapes to draw in place of boxes; of spatial trees alone.

    Raises StudyError for fewer than two frames, a role or a shape for a body that is not there, or shapes for
    a planar run.

    >>> from workbench.engine import Body, System, simulate
    >>> run = simulate(System(bodies=(Body(name="ball"),)), [], t_end=1.0, steps=100)
    >>> times, motion = frames(run, count=11)
    >>> motion.poses.shape, float(times[-1])
    ((11, 1, 7), 1.0)
    """
    names = _names(trajectory)
    if count < 2:
        raise StudyError(f"frames needs count >= 2, got {count}")
    strangers = sorted(set(roles or {}) - set(names))
    if strangers:
        raise StudyError(f"roles name {strangers[0]!r}; bodies of the run are {', '.join(names)}")
    nodes = np.unique(np.linspace(0, len(trajectory.times) - 1, count).round().astype(int))
    if isinstance(trajectory, TreeTrajectory):
        run = tree_frames(trajectory, nodes, label=label, roles=roles or {}, thinnest=thinnest, drawn=drawn)
        return trajectory.times[nodes], run
    if drawn:
        raise StudyError("frames takes drawn for spatial trees alone; give a planar run its boxes by roles")
    places = np.stack([trajectory.of(name)[nodes] for name in names], axis=1)
    bodies = []
    for name, points in tied_points(trajectory).items():
        x, y = np.maximum(2 * np.abs(points).max(axis=0), _LEAST)
        bodies.append(Body(
            name=name, shape="box", size=(float(x), _DEPTH, float(y)), role=(roles or {}).get(name, "other"),
            see_through=True,
        ))  # fmt: skip
    index = {name: i for i, name in enumerate(names)}
    kept = [i for i in range(len(trajectory.system.members)) if trajectory.density[i] >= thinnest]
    members = tuple(
        Member(
            name=f"M{i}", kind=_KINDS.get(type(bare(m.law)).__name__, "belt"),
            density=float(min(1.0, trajectory.density[i])),
            body_a=index.get(m.a, -1), point_a=(m.point_a[0], 0.0, m.point_a[1]),
            body_b=index.get(m.b, -1), point_b=(m.point_b[0], 0.0, m.point_b[1]),
        )
        for i, m in ((i, trajectory.system.members[i]) for i in kept)
    )  # fmt: skip
    forces = member_histories(trajectory, kept).force[nodes] if kept else None
    poses = planar_poses(*(places[..., axis] for axis in range(3)))
    run = MotionRun(label=label, bodies=tuple(bodies), poses=poses, members=members, forces=forces)
    return trajectory.times[nodes], run
