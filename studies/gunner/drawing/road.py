"""The ground under a run to look at: waves as a strip along the way driven, boxes that wheels strike.

The viewer's ground is the plane z = 0. A road whose troughs lie below it is drawn that much higher, and
everything on it (`depth`). A flat road is left to the viewer.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.engine import Box, Road, TreeTrajectory
from workbench.motion.frames import Body
from workbench.motion.meshes import Mesh
from workbench.motion.trajectories import Drawn

from ..manoeuvre import Ground

__all__ = ["depth", "ground_drawn"]

Array = NDArray[np.float64]

AHEAD, BEHIND, BESIDE = 8.0, 5.0, 3.0  # m of road drawn beyond the places of the vehicle
ALONG = 0.5  # m between the stations of the strip
ACROSS = 0.25  # m, where a kerb of the road crosses it


def ground_drawn(ground: Ground, runs: Sequence[TreeTrajectory]) -> Iterator[Drawn]:
    """The shapes of a ground that is not flat; of obstacles boxes alone, those of the proving grounds."""
    road = ground.road
    if has_height(road):
        vertices, triangles = _strip(road, runs)
        strip = Body(name="road", shape="mesh", role="other", vertices=vertices, triangles=triangles)
        yield Drawn(shape=strip, on="ground")
    for k, obstacle in enumerate(ground.obstacles):
        if isinstance(obstacle, Box):
            x, y, z = (2.0 * half for half in obstacle.half)
            yield Drawn(
                shape=Body(name=f"obstacle {k}", shape="box", size=(x, y, z), role="other"), on="ground",
                at=(obstacle.centre[0], obstacle.centre[1], obstacle.centre[2] + depth(road)),
            )  # fmt: skip


def has_height(road: Road) -> bool:
    """Whether a road is more than a plane."""
    return bool(road.amplitude or road.kerb_height or road.waves)


def depth(road: Road) -> float:
    """How far the troughs of a road may lie below z = 0, m."""
    waves = abs(road.amplitude) + sum(abs(amplitude) for amplitude, _, _ in road.waves)
    return waves + max(0.0, -road.kerb_height)


def _strip(road: Road, runs: Sequence[TreeTrajectory]) -> Mesh:
    """Points of the road in rows across the way, and the triangles between them, seen from above."""
    heading = np.array([np.cos(road.heading), np.sin(road.heading)])
    aside = np.array([-heading[1], heading[0]])
    way = np.vstack([run.frames("vehicle").origin[:, :2] for run in runs])
    along, across = way @ heading, way @ aside
    u = np.arange(along.min() - BEHIND, along.max() + AHEAD, ALONG)
    low, high = across.min() - BESIDE, across.max() + BESIDE
    w = np.arange(low, high, ACROSS) if road.kerb_height else np.array([low, high])
    points = [
        (float(x), float(y), road.height(float(x), float(y)) + depth(road))
        for x, y in (a * heading + b * aside for a in u for b in w)
    ]
    n = len(w)
    corners = [i * n + j for i in range(len(u) - 1) for j in range(n - 1)]
    triangles = [t for k in corners for t in ((k, k + n, k + n + 1), (k, k + n + 1, k + 1))]
    return tuple(points), tuple(triangles)
