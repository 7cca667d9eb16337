"""Figures of a run of the engine: series over time, and the bodies at some times side by side."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from workbench.engine import Trajectory
from workbench.figures.parts import BLUE, GREY, VERMILLION, any_label, axis_label, current_axes
from workbench.motion.frames import frame_at
from workbench.motion.trajectories import tied_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_histories", "plot_storyboard"]

Array = NDArray[np.float64]

STYLES = ("-", "--", "-.", ":")  # told apart without colour


@any_label
def plot_histories(
    series: dict[str, Any], times: Any, *, label: str = "value", unit: str = "1", ax: "Axes | None" = None
) -> "Axes":
    """Several series over time, told apart by line style as well as colour."""
    ax = current_axes(ax)
    colours = (BLUE, VERMILLION, GREY)
    for i, (name, values) in enumerate(series.items()):
        ax.plot(times, values, STYLES[i % len(STYLES)], color=colours[i % len(colours)], label=name)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(axis_label(label, unit))
    if len(series) > 1:
        ax.legend(frameon=False)
    return ax


@any_label
def plot_storyboard(trajectory: Trajectory, times: Sequence[float], *, ax: "Axes | None" = None) -> "Axes":
    """The bodies at some times, side by side, with members as thick as their density; y up, one scale.

    Bodies are drawn as the outline of their tied points, free ones dark, prescribed ones grey.
    """
    ax = current_axes(ax)
    outlines = {name: _outline(points) for name, points in tied_points(trajectory).items()}
    free = {body.name for body in trajectory.system.free}
    stills = [frame_at(trajectory.times, t) for t in times]
    ends = {name: trajectory.of(name)[stills] for name in outlines}
    reach = [_placed(points, place)[:, 0] for name, points in outlines.items() for place in ends[name]]
    pitch = 1.15 * float(max(x.max() for x in reach) - min(x.min() for x in reach))
    for k, node in enumerate(stills):
        for name, points in outlines.items():
            corners = _placed(points, ends[name][k]) + np.array([k * pitch, 0.0])
            closed = np.vstack([corners, corners[:1]])
            ax.plot(closed[:, 0], closed[:, 1], color=BLUE if name in free else GREY, linewidth=1.3)
        _draw_members(trajectory, node, k * pitch, ax)
        middle = np.mean(
            [_placed(points, ends[name][k]).mean(axis=0)[0] for name, points in outlines.items()]
        )
        ax.annotate(
            f"{trajectory.times[node]:.3g} s", (middle + k * pitch, 1.02), va="bottom", ha="center",
            xycoords=("data", "axes fraction"),
        )  # fmt: skip
    ax.set_aspect("equal")
    ax.set_xlabel("x [m], shifted from still to still")
    ax.set_ylabel("y [m]")
    return ax


def _draw_members(trajectory: Trajectory, node: int, shift: float, ax: "Axes") -> None:
    from matplotlib.collections import LineCollection

    density = trajectory.density
    share = density / max(float(density.max(initial=0.0)), 1e-300)
    lines, widths = [], []
    for i, member in enumerate(trajectory.system.members):
        if share[i] < 1e-3:
            continue
        ends = []
        for body, point in ((member.a, member.point_a), (member.b, member.point_b)):
            place = np.zeros(3) if body == "ground" else trajectory.of(body)[node]
            ends.append(_placed(np.array([point]), place)[0] + np.array([shift, 0.0]))
        lines.append(ends)
        widths.append(share[i])
    thickest = min(2.0, 60.0 / max(len(lines), 1))
    ax.add_collection(
        LineCollection(lines, linewidths=thickest * np.array(widths), colors=VERMILLION, alpha=0.6)
    )


def _outline(points: Array) -> Array:
    """Convex outline of the tied points, or the points themselves when there are too few."""
    spread = points - points.mean(axis=0)
    if len(np.unique(points, axis=0)) < 3 or np.linalg.matrix_rank(spread, tol=1e-9) < 2:
        return points
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points).vertices])


def _placed(points: Array, place: Array) -> Array:
    c, s = np.cos(place[2]), np.sin(place[2])
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + place[:2])
