"""A run of order 8 with a node exactly on the peak of an objective."""

import numpy as np

from ..errors import NotSupported
from ..integration.schemes import RungeKutta8
from ..objectives.reductions import Maximum, Minimum
from ..planar.compiled import compiled
from ..planar.runge_kutta import with_node
from ..planar.trajectory import Trajectory

__all__ = ["locate_peak"]

PEAK_STEPS = 8  # secant steps on dg/dt = 0; three suffice from the Hermite start
NEAR = 1e-6  # of the interval: the last step, not evaluated again


def locate_peak(trajectory: Trajectory, objective: Maximum | Minimum) -> Trajectory:
    """The same run with one more node, exactly on the objective's highest peak (Newton on dg/dt = 0).

    The cubic Hermite between nodes is of order 4; with steps as long as order 8 allows it would be the
    largest error. Returns the trajectory unchanged when the peak is at an end or the quantity has no rate.
    """
    r = trajectory
    if not isinstance(r.scheme, RungeKutta8):
        raise NotSupported(
            "locate_peak is for RungeKutta8 trajectories; GeneralisedAlpha's peaks are refined already"
        )
    if r.splits is not None:
        raise NotSupported("locate_peak is for systems without joints; take more steps near the peak instead")
    peak = objective.peaks(r)[0]
    if peak.at_end or not objective.quantity.has_rates:
        return r
    parts = compiled(r.system)
    a = int(np.searchsorted(r.times, peak.time, side="right") - 1)
    low, high = float(r.times[a]), float(r.times[a + 1])

    def rate(time: float) -> float:
        # a short run is enough: the start (quantities may refer to it) and the step with the peak
        nodes = np.array([a, a + 1] if a == 0 else [0, a, a + 1])
        local = with_node(parts, r, nodes, time)
        return float(objective.quantity.rates(local, np.array([len(nodes) - 1]))[0])

    time, here = peak.time, rate(peak.time)
    ga, gb = objective.quantity.values(r)[[a, a + 1]]
    da, db = objective.quantity.rates(r, np.array([a, a + 1]))
    s, h = (time - low) / (high - low), high - low
    # curvature of the cubic for the first step, secants after it
    slope = ((6 - 12 * s) * (gb - ga) / h - (4 - 6 * s) * da - (2 - 6 * s) * db) / h
    for _ in range(PEAK_STEPS):
        move = -here / slope if slope != 0.0 else 0.0
        if not low < time + move < high:
            break
        if abs(move) < NEAR * h:  # what is left is this move times the one before
            time += move
            break
        there = rate(time + move)
        if abs(there) >= abs(here):
            break
        slope = (there - here) / move
        time, here = time + move, there
    return with_node(parts, r, np.arange(len(r.times)), time)
