"""The occupant to look at: segments as capsules, the cab as boxes, members between them.

Frame of the model: x rearward, y up. The viewer has x forward, so the drawing turns the model about its
vertical axis: x' = -x, angles change their sign.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from studies.occupant import member_sites
from studies.occupant_body import HIP, SEGMENTS
from workbench.engine import Deviation, Trajectory, member_histories
from workbench.motion.frames import (
    Body,
    History,
    Member,
    Motion,
    MotionRun,
    planar_poses,
)

__all__ = ["SHAPES", "motion_of", "outlines"]

FRAMES = 81
THINNEST = 1e-3  # density of the thinnest member that is drawn
# segment: (lower or distal end, upper or proximal end, radius) in the reference posture, m
SHAPES = {
    "head": ((0.2760, 1.5100), (0.2760, 1.6600), 0.095),
    "upper torso": ((0.2760, 1.2700), (0.2760, 1.4200), 0.120),
    "central torso": ((0.2760, 1.0700), (0.2760, 1.2000), 0.120),
    "lower torso": ((0.2760, 0.9000), (0.2760, 0.9900), 0.125),
    "upper arms": ((0.0220, 1.2459), (0.2760, 1.3810), 0.045),
    "forearms": ((-0.2506, 1.2794), (0.0220, 1.2459), 0.038),
    "hands": ((-0.3379, 1.2901), (-0.2506, 1.2794), 0.035),
    "thighs": ((-0.0289, 0.5601), HIP, 0.075),
    "shanks": ((-0.0289, 0.1169), (-0.0289, 0.5601), 0.055),
    "feet": ((-0.1500, 0.0600), (0.0000, 0.0900), 0.040),
}
CAB = {  # name: (centre x, y, size x', across, up, see-through)
    "floor": (0.05, -0.04, 1.6, 0.9, 0.04, False),
    "rear wall": (0.66, 0.6, 0.03, 0.9, 1.25, True),
    "grip": (-0.3379, 1.2901, 0.04, 0.7, 0.04, False),
}
ACROSS = 0.041  # m: the occupant's mid-plane in the vehicle frame of Table C.1


def motion_of(
    runs: Mapping[str, Trajectory], *, kinds: tuple[str, ...], title: str, deviation: Deviation
) -> Motion:
    """The runs side by side, seen from the vehicle, with the time histories of deviation and head speed."""
    first = next(iter(runs.values()))
    nodes = np.unique(np.linspace(0, len(first.times) - 1, FRAMES).round().astype(int))
    reach = {label: np.sqrt(deviation.values(run)) for label, run in runs.items()}
    speed = {label: _head_speed(run) for label, run in runs.items()}
    peak = max((float(run.times[reach[label].argmax()]) for label, run in runs.items()), default=0.0)
    late = float(first.times[-1])
    return Motion(
        title=title,
        times=first.times[nodes],
        runs=tuple(_run(label, run, nodes, kinds) for label, run in runs.items()),
        histories=(
            History(
                name="deviation of the mass centre", unit="m", series={k: v[nodes] for k, v in reach.items()}
            ),
            History(name="speed of the head", unit="m/s", series={k: v[nodes] for k, v in speed.items()}),
        ),
        storyboard=tuple(sorted({0.5, 0.7, min(max(peak, 0.8), 1.2), late})),
    )  # fmt: skip


def outlines() -> list[list[list[float]]]:
    """Closed lines around the segments in the reference posture, vehicle frame, m."""
    return [_capsule(np.array(a), np.array(b), radius) for a, b, radius in SHAPES.values()]


def _capsule(a: np.ndarray, b: np.ndarray, radius: float, points: int = 9) -> list[list[float]]:
    along = np.arctan2(*(b - a)[::-1])
    half = np.linspace(-np.pi / 2, np.pi / 2, points)
    ends = [
        end + radius * np.stack([np.cos(turn + half), np.sin(turn + half)], axis=1)
        for end, turn in ((b, along), (a, along + np.pi))
    ]
    line = np.vstack([*ends, ends[0][:1]])
    return [[float(x), float(y)] for x, y in line]


def _head_speed(run: Trajectory) -> np.ndarray:
    v = run.velocity[:, run.system.coordinate("head")][:, :2] - run.tables.motion[:, 1, :2]
    return np.hypot(v[:, 0], v[:, 1])


def _run(label: str, run: Trajectory, nodes: np.ndarray, kinds: tuple[str, ...]) -> MotionRun:
    """One run; bodies are capsules whose axis is the segment's, the cab stands still."""
    bodies, x, y, angle, centres = [], [], [], [], {}
    vehicle = run.tables.motion[nodes, 0, :2]
    for name, (low, high, radius) in SHAPES.items():
        a, b = np.array(low), np.array(high)
        centre, length = (a + b) / 2, float(np.hypot(*(b - a)))
        q = run.of(name)[nodes]
        offset = centre - np.array(SEGMENTS[name][1:3])
        c, s = np.cos(q[:, 2]), np.sin(q[:, 2])
        x.append(q[:, 0] + c * offset[0] - s * offset[1] - vehicle[:, 0])
        y.append(q[:, 1] + s * offset[0] + c * offset[1] - vehicle[:, 1])
        angle.append(q[:, 2] + np.arctan2(b[1] - a[1], b[0] - a[0]) - np.pi / 2)
        bodies.append(
            Body(
                name=name,
                shape="capsule",
                size=(radius, length),
                role="head" if name == "head" else "occupant",
            )
        )
        centres[name] = (len(bodies) - 1, centre, float(angle[-1][0] - q[0, 2]))
    for name, (cx, cy, *size, glass) in CAB.items():
        x.append(np.full(len(nodes), cx))
        y.append(np.full(len(nodes), cy))
        angle.append(np.zeros(len(nodes)))
        bodies.append(Body(name=name, shape="box", size=tuple(size), role="vehicle", see_through=glass))
    poses = planar_poses(-np.stack(x, 1), np.stack(y, 1), -np.stack(angle, 1))
    kept = [i for i, density in enumerate(run.density) if density > THINNEST]
    return MotionRun(
        label=label, bodies=tuple(bodies), poses=poses, members=_members(run, kept, kinds, centres),
        forces=member_histories(run, kept).force[nodes] if kept else None,
    )  # fmt: skip


def _members(
    run: Trajectory, kept: Sequence[int], kinds: tuple[str, ...],
    centres: Mapping[str, tuple[int, np.ndarray, float]],
) -> tuple[Member, ...]:  # fmt: skip
    sites = member_sites()
    found = []
    for i in kept:
        site, kind = sites[i % len(sites)], kinds[i // len(sites)]
        body, centre, turn = centres[site.segment]
        # into the capsule's own frame, in which its axis is upright, and turned about the vertical
        d = np.array(site.on_occupant) - centre
        c, s = np.cos(turn), np.sin(turn)
        local = (-(c * d[0] + s * d[1]), ACROSS - site.across, float(c * d[1] - s * d[0]))
        fixed = (-site.on_vehicle[0], ACROSS - site.across - site.offset, site.on_vehicle[1])
        found.append(
            Member(
                name=f"{kind} {site.number}", kind=kind, density=float(min(run.density[i], 1.0)),
                body_a=body, point_a=(float(local[0]), float(local[1]), local[2]), body_b=-1, point_b=fixed,
            )
        )  # fmt: skip
    return tuple(found)
