"""Motion to look at: bodies, members and time histories of some runs, for the viewer and the stills.

    Shape     capsule (radius, length between the centres of its caps, along local z), box (edges) or mesh
    Body      a shape with a name, a role that gives its colour, and whether it may be seen through
    Member    a restraint between two body-fixed points; kind belt | airbag | retractor, density 0..1
    History   one response over time, a series per run of a case, with an optional limit
    Motion    times (T,), per run the poses (T, B, 7) of all bodies: x, y, z and a quaternion w, x, y, z

Runs of one case (the same uncertain parameters under several layouts, say) are shown side by side; where
there are several cases, the page lets one be chosen. The scene's z points up, x forward, lengths in metres.
Planar results (x, y, angle), y up, become poses by `planar_poses`. A campaign's `motion.json` is
`Motion.to_dict()`, its arrays packed and its poses in six numbers as `workbench.motion.packing` says: enough
to look at; full data stay with the simulation.

    {"title", "times", "meshes": [{"vertices", "triangles"}],
     "bodies": [[{"name", "shape", "size", "role", "see_through", "mesh"}]],
     "members": [[{"name", "kind", "density", "body_a", "point_a", "body_b", "point_b"}]],
     "histories": [{"name", "unit", "limit", "case", "series": [{"label", "values"}]}],
     "runs": [{"label", "case", "poses", "forces", "bodies", "members"}],
     "storyboard": [times of the stills]}

`bodies` and `members` of a run are positions in the lists of the document, since a layout has the same in
every case; `body_a` and `body_b` are positions in a list of bodies, -1 is the ground; `mesh` is one in
`meshes`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.errors import StudyError
from workbench.motion.packing import (
    in_six,
    packed,
    packed_in_steps,
    unpacked,
    unpacked_from_steps,
    with_quaternions,
)

__all__ = [
    "KINDS",
    "ROLES",
    "Body",
    "History",
    "Member",
    "Motion",
    "MotionRun",
    "frame_at",
    "planar_poses",
    "rotate",
    "side_by_side",
]

KINDS = ("belt", "airbag", "retractor")
ROLES = ("vehicle", "occupant", "head", "seat", "wheel", "other")
SHAPES = {"capsule": 2, "box": 3, "mesh": 0}
BESIDE = 1.5  # times the largest value of all runs but one: how high a drawing is that cuts that one off,
FAR_BEHIND = 3.0  # where it goes beyond so many times that height
UNIT_NORM = 1e-3  # quaternions further from unit length are refused, nearer ones are normalised


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A moving shape. `size`: (radius, length) of a capsule, (x, y, z) edges of a box, m.

    vertices, triangles: of a mesh, m in the body's axes, anticlockwise from outside; see `motion.meshes`.
    """

    name: str
    shape: str
    size: tuple[float, ...] = ()
    role: str = "other"
    see_through: bool = False
    vertices: tuple[tuple[float, float, float], ...] = ()
    triangles: tuple[tuple[int, int, int], ...] = ()

    def __post_init__(self) -> None:
        if SHAPES.get(self.shape) != len(self.size) or min(self.size, default=0.0) < 0:
            raise StudyError(
                f"body {self.name!r} needs shape 'capsule' with (radius, length) or 'box' with three edges, "
                f"or 'mesh' without a size, got {self.shape!r} with {self.size}"
            )
        corners = {i for triangle in self.triangles for i in triangle}
        if (self.shape == "mesh") != bool(self.triangles) or not corners <= set(range(len(self.vertices))):
            raise StudyError(
                f"body {self.name!r}: a mesh, and nothing else, has triangles over its vertices; got shape "
                f"{self.shape!r}, {len(self.vertices)} vertices and {len(self.triangles)} triangles"
            )
        if self.role not in ROLES:
            raise StudyError(f"body {self.name!r}: role is one of {', '.join(ROLES)}, got {self.role!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """A restraint between two body-fixed points; -1 as body is the ground."""

    name: str
    kind: str
    density: float
    body_a: int
    point_a: tuple[float, float, float]
    body_b: int
    point_b: tuple[float, float, float]

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise StudyError(f"member {self.name!r}: kind is one of {', '.join(KINDS)}, got {self.kind!r}")
        if not 0.0 <= self.density <= 1.0:
            raise StudyError(f"member {self.name!r}: density lies in [0, 1], got {self.density}")


@dataclass(frozen=True, slots=True, kw_only=True)
class History:
    """A response over the times of the motion: label of a run of this case -> values (T,)."""

    name: str
    unit: str
    series: Mapping[str, NDArray[np.float64]]
    limit: float | None = None
    case: str = ""

    @property
    def drawn_to(self) -> float:
        """Where a drawing ends: the largest value of all and of the limit, or, where one run leaves these far
        behind, a height at which they can still be told apart."""
        *others, largest = sorted(float(np.max(values)) for values in self.series.values())
        least = -np.inf if self.limit is None else self.limit
        height = max(BESIDE * others[-1] if others else largest, least)
        return height if largest > FAR_BEHIND * height > 0.0 else max(largest, least)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionRun:
    """One run: bodies, their poses (T, B, 7), members.

    forces: of the members, (T, M) N, tension positive.
    case: what it has in common with the runs that it is shown beside.
    """

    label: str
    bodies: tuple[Body, ...]
    poses: NDArray[np.float64]
    members: tuple[Member, ...] = ()
    forces: NDArray[np.float64] | None = None
    case: str = ""

    def segments(self, frame: int) -> NDArray[np.float64]:
        """Ends of all members in a frame, (members, 2, 3)."""
        ends = np.empty((len(self.members), 2, 3))
        for k, m in enumerate(self.members):
            for side, (body, point) in enumerate(((m.body_a, m.point_a), (m.body_b, m.point_b))):
                p = np.array(point, dtype=float)
                ends[k, side] = (
                    p if body < 0 else self.poses[frame, body, :3] + rotate(self.poses[frame, body, 3:], p)
                )
        return ends


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Runs to compare, case by case, over common times (T,) in s."""

    title: str
    times: NDArray[np.float64]
    runs: tuple[MotionRun, ...]
    histories: tuple[History, ...] = ()
    storyboard: tuple[float, ...] = field(default_factory=tuple)

    def __post_init__(self) -> None:
        count = len(self.times)
        if not self.runs or count == 0:
            raise StudyError("a motion needs at least one run and one time")
        if np.any(np.diff(self.times) <= 0):
            raise StudyError("times of a motion need to increase")
        for run in self.runs:
            shape = (count, len(run.bodies), 7)
            if run.poses.shape != shape:
                raise StudyError(
                    f"poses of run {run.label!r} need shape {shape} (times, bodies, x y z w x y z), "
                    f"got {run.poses.shape}"
                )
            if not np.isfinite(run.poses).all():
                raise StudyError(
                    f"poses of run {run.label!r} hold NaN or infinity; cut the motion where it fails"
                )
            norm = np.linalg.norm(run.poses[..., 3:], axis=-1)
            if norm.size and np.abs(norm - 1).max() > UNIT_NORM:
                raise StudyError(f"quaternions of run {run.label!r} need unit length, got {norm.min():.4g}")
            if run.forces is not None:
                table = (count, len(run.members))
                if run.forces.shape != table or not np.isfinite(run.forces).all():
                    raise StudyError(
                        f"forces of run {run.label!r} need shape {table} (times, members) and finite "
                        f"values, got {run.forces.shape}"
                    )
            for m in run.members:
                if not (-1 <= m.body_a < len(run.bodies) and -1 <= m.body_b < len(run.bodies)):
                    raise StudyError(f"member {m.name!r} names a body that run {run.label!r} does not have")
        for history in self.histories:
            for label, values in history.series.items():
                if len(values) != count:
                    raise StudyError(
                        f"history {history.name!r}, {label!r} needs {count} values, got {len(values)}"
                    )

    @property
    def cases(self) -> tuple[str, ...]:
        """The names of the cases, in order."""
        return tuple(dict.fromkeys(run.case for run in self.runs))

    def to_dict(self) -> dict[str, Any]:
        """The document `motion.json`."""
        meshes: dict[Any, int] = {}  # equal ones are written once, as are lists of bodies and members
        bodies: dict[tuple[Body, ...], int] = {}
        members: dict[tuple[Member, ...], int] = {}
        runs = [
            {
                "label": run.label,
                "case": run.case,
                "poses": packed_in_steps(in_six(run.poses).reshape(len(run.poses), -1)),
                "forces": None if run.forces is None else packed_in_steps(run.forces),
                "bodies": bodies.setdefault(run.bodies, len(bodies)),
                "members": members.setdefault(run.members, len(members)),
            }
            for run in self.runs
        ]
        shapes = [[_body_document(b, meshes) for b in some] for some in bodies]
        return {
            "title": self.title,
            "times": packed(self.times),
            "storyboard": [float(t) for t in self.storyboard],
            "meshes": [
                {"vertices": [list(p) for p in vertices], "triangles": [list(t) for t in triangles]}
                for vertices, triangles in meshes
            ],
            "bodies": shapes,
            "members": [[_member_document(m) for m in some] for some in members],
            "histories": [
                {
                    "name": h.name,
                    "unit": h.unit,
                    "limit": h.limit,
                    "drawn_to": h.drawn_to,
                    "case": h.case,
                    "series": [{"label": label, "values": packed(v)} for label, v in h.series.items()],
                }
                for h in self.histories
            ],
            "runs": runs,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Motion":
        """The motion of a document."""
        times = unpacked(data["times"])
        meshes = [
            (tuple(map(tuple, m["vertices"])), tuple(map(tuple, m["triangles"])))
            for m in data.get("meshes", ())
        ]
        histories = tuple(
            History(
                name=h["name"],
                unit=h["unit"],
                limit=h.get("limit"),
                case=h.get("case", ""),
                series={s["label"]: unpacked(s["values"]) for s in h["series"]},
            )
            for h in data.get("histories", ())
        )
        return cls(
            title=data["title"],
            times=times,
            runs=tuple(_run_of(data, run, meshes, len(times)) for run in data["runs"]),
            histories=histories,
            storyboard=tuple(data.get("storyboard", ())),
        )


def _body_document(b: Body, meshes: dict[Any, int]) -> dict[str, Any]:
    mesh = meshes.setdefault((b.vertices, b.triangles), len(meshes)) if b.shape == "mesh" else None
    return {
        "name": b.name, "shape": b.shape, "size": list(b.size), "role": b.role,
        "see_through": b.see_through, "mesh": mesh,
    }  # fmt: skip


def _member_document(m: Member) -> dict[str, Any]:
    return {
        "name": m.name, "kind": m.kind, "density": _seen(m.density), "body_a": m.body_a,
        "point_a": list(map(_seen, m.point_a)), "body_b": m.body_b, "point_b": list(map(_seen, m.point_b)),
    }  # fmt: skip


def _seen(value: float) -> float:
    """A number as exact as float32 has it: enough to look at, and half as long in a document."""
    return float(f"{value:.7g}")


def _run_of(
    data: Mapping[str, Any], document: Mapping[str, Any], meshes: Sequence[Any], count: int
) -> MotionRun:
    """A run of a document, also of one that has whole quaternions or float32, and bodies in every run."""
    shapes, ties = (
        data[key][document[key]] if isinstance(document[key], int) else document[key]
        for key in ("bodies", "members")
    )
    bodies = []
    for b in shapes:
        given = {**b, "size": tuple(b["size"])}
        mesh = given.pop("mesh", None)
        vertices, triangles = ((), ()) if mesh is None else meshes[mesh]
        bodies.append(Body(**given, vertices=vertices, triangles=triangles))
    members = tuple(
        Member(**{**m, "point_a": tuple(m["point_a"]), "point_b": tuple(m["point_b"])}) for m in ties
    )
    kept, forces = document["poses"], document.get("forces")
    poses = (unpacked(kept) if isinstance(kept, str) else unpacked_from_steps(kept)).ravel()
    if poses.size == count * len(bodies) * 6:
        poses = with_quaternions(poses.reshape(-1, 6))
    return MotionRun(
        label=document["label"],
        case=document.get("case", ""),
        bodies=tuple(bodies),
        poses=poses.reshape(count, len(bodies), 7),
        members=members,
        forces=None if forces is None else unpacked_from_steps(forces).reshape(count, len(members)),
    )


def side_by_side(motions: Mapping[str, Motion]) -> Motion:
    """One motion of several cases, case by case in the order given, with the title and stills of the first.

    Raises StudyError for motions over other times.
    """
    first = next(iter(motions.values()))
    for name, motion in motions.items():
        if len(motion.times) != len(first.times) or np.abs(motion.times - first.times).max() > 0.0:
            raise StudyError(f"the motion of case {name!r} has other times than that of the first case")
    return replace(
        first,
        runs=tuple(replace(run, case=name) for name, motion in motions.items() for run in motion.runs),
        histories=tuple(replace(h, case=name) for name, motion in motions.items() for h in motion.histories),
    )


def planar_poses(x: ArrayLike, y: ArrayLike, angle: ArrayLike) -> NDArray[np.float64]:
    """Poses (T, B, 7) of planar positions x, y (T, B), y up, and angles (T, B), counter-clockwise in rad.

    The plane is the scene's x-z plane; seen from the side (x to the right) turns look as they are given.

    >>> planar_poses([[1.0]], [[2.0]], [[0.0]]).tolist()
    [[[1.0, 0.0, 2.0, 1.0, 0.0, -0.0, 0.0]]]
    """
    x, y, angle = (np.asarray(v, dtype=float) for v in (x, y, angle))
    poses = np.zeros((*x.shape, 7))
    poses[..., 0], poses[..., 2] = x, y
    # from x towards z is a turn about -y
    poses[..., 3], poses[..., 5] = np.cos(angle / 2), -np.sin(angle / 2)
    return poses


def rotate(quaternion: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """Points (..., 3) turned by unit quaternions (..., 4) w, x, y, z.

    >>> np.abs(rotate([np.sqrt(0.5), 0, 0, np.sqrt(0.5)], [1.0, 0, 0])).round(12).tolist()
    [0.0, 1.0, 0.0]
    """
    q, p = np.asarray(quaternion, dtype=float), np.asarray(points, dtype=float)
    v = q[..., 1:]
    t = 2.0 * np.cross(v, p)
    return np.asarray(p + q[..., :1] * t + np.cross(v, t))


def frame_at(times: Sequence[float] | NDArray[np.float64], t: float) -> int:
    """The frame nearest to a time."""
    return int(np.argmin(np.abs(np.asarray(times) - t)))
