"""Steps that keep the error of a run within a tolerance: short where the motion is quick, long elsewhere.

Generalised-alpha leaves in a step of length h, by Taylor's series of the step formulas,

    of the place  |(alpha_m - alpha_f)/2 + beta - 1/6| h^3 w',      of the velocity  h^3 w''/12

and an error of the velocity is felt in all places until the end, T - t times as large. So a step counts

    e = h^3 (c |w'| + (T - t) |w''|/12),   the largest over the coordinates

with w', w'' from differences of the accelerations of the run itself. For a given number of steps the error is
least where all count alike. A first run goes from window to window of equal steps, takes those that do not
count too much, and repeats the others with shorter ones. Its steps are then smoothed in time, so that
neighbours are alike.

How fine all must be is measured and not believed: of two runs over that grid the second halves every step. At
order 2 its places are off by a third of the difference of both, and it is the one that is returned. Order 8
goes over the grids of generalised-alpha, made as fine as its own error asks for; it is off by less than that
third.
"""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import NotConverged
from ..integration.schemes import GeneralisedAlpha

__all__ = ["error_controlled"]

Array = np.ndarray[Any, Any]
Part = Callable[[Array, Any], Any]

SLOPE = 0.15  # how fast a step may grow over time, 1: neighbours differ by less than a fifth, as joints need
WINDOW = 12  # steps of one length that are tried at once
OVER = 3.0  # a step may count this often what it should: its length is right within OVER^(1/3)
SHARPEST = 1.0 / 16.0  # least share of its length that a step gets at once
AIM = 0.6  # of the tolerance
CLOSE = 0.3  # a measured error above this share of it is not made larger
ROUNDS = 12  # grids that are tried
SHORTEST = 1e-13  # of the time: steps cannot be told from rounding


def _marched(
    part: Part, scheme: GeneralisedAlpha, t_end: float, level: float, longest: float, most: int
) -> Array:
    """Steps from 0 s to t_end of which none counts much more than `level`; the times of their nodes."""
    nodes, start, h = [0.0], None, longest
    while t_end - nodes[-1] > 100.0 * SHORTEST * t_end:  # the last window may end rounding before it
        t, left = nodes[-1], t_end - nodes[-1]
        count = min(WINDOW, max(2, int(np.ceil(left / h))))
        h = min(h, left / count)
        if h < SHORTEST * t_end or len(nodes) > most:
            raise NotConverged(
                f"{most} steps do not keep the error within the tolerance: at t = {t:.6g} s steps of {h:.3g} "
                "s are asked for. Take a larger tolerance, allow more by most=, or look at the forces there",
                t,
            )
        times = t + h * np.arange(count + 1)
        try:
            tried = part(times, start)
        except NotConverged:
            h *= 0.25
            continue
        counts = _counts(tried, t_end, scheme)
        share = np.clip((level / np.maximum(counts, 1e-300)) ** (1 / 3), SHARPEST, 2.0)
        over = np.flatnonzero(counts > OVER * level)
        # what leads to a step that counts too much may be its beginning
        good = max(int(over[0]) - 1, 0) if len(over) else count
        if good:
            nodes += [float(x) for x in times[1 : good + 1]]
            start = tried.start_at(good)
        h *= float(share[over[0] if len(over) else slice(-3, None)].min())
        h = min(h, longest)
    nodes[-1] = t_end
    return np.array(nodes)


def _counts(trajectory: Any, t_end: float, scheme: GeneralisedAlpha) -> Array:
    """(steps,) e of every step."""
    am, af, _, beta = scheme.numbers
    times, w = trajectory.times, trajectory.acceleration
    h = np.diff(times)
    if len(h) < 2:
        return np.full(len(h), np.inf)  # nothing to compare with
    first = np.diff(w, axis=0) / h[:, None]
    middle = 0.5 * (times[1:] + times[:-1])
    second = np.diff(first, axis=0) / np.diff(middle)[:, None]
    # of a step: the larger of those at its ends
    ends = np.concatenate([second[:1], second, second[-1:]])
    bend = np.maximum(np.abs(ends[1:]), np.abs(ends[:-1]))
    place = abs(0.5 * (am - af) + beta - 1.0 / 6.0) * np.abs(first)
    return np.asarray(h**3 * (place + (t_end - times[:-1])[:, None] * bend / 12.0).max(axis=1, initial=0.0))


def _gradual(times: Array) -> Array:
    """A grid whose steps are at most those between the nodes `times`, and change by SLOPE in time at most.

    h(t) = min over all gaps g of (g + SLOPE times the distance from t to the gap)
    """
    gaps = np.diff(times)
    at = np.minimum(np.append(gaps, gaps[-1]), np.append(gaps[0], gaps))  # h at the nodes
    for k in range(len(gaps)):
        at[k + 1] = min(at[k + 1], at[k] + SLOPE * gaps[k])
    for k in range(len(gaps) - 1, -1, -1):
        at[k] = min(at[k], at[k + 1] + SLOPE * gaps[k])
    node, gap, length = times.tolist(), gaps.tolist(), at.tolist()

    def step_at(t: float) -> float:
        k = min(bisect_right(node, t) - 1, len(gap) - 1)
        return min(gap[k], length[k] + SLOPE * (t - node[k]), length[k + 1] + SLOPE * (node[k + 1] - t))

    found, end = [node[0]], node[-1]
    while True:
        t = found[-1]
        h = step_at(t)
        if end - t <= 1.5 * h:
            break
        found.append(t + min(h, step_at(t + h / (1.0 + SLOPE))))
    last = int(np.ceil((end - t) / min(h, length[-1]) - 1e-9))
    return np.array([*found, *np.linspace(t, end, last + 1)[1:]])


def _halved(times: Array) -> Array:
    out = np.empty(2 * len(times) - 1)
    out[::2] = times
    out[1::2] = 0.5 * (times[1:] + times[:-1])
    return out


def error_controlled(
    part: Part,
    whole: Callable[[Array], Any],
    *,
    order: int,
    scheme: GeneralisedAlpha,
    t_end: float,
    tolerance: float,
    longest: float,
    most: int,
) -> Any:
    """The run whose places are off by `tolerance` at most, m or rad, at all nodes, as far as was measured.

    Args:    part: runs with `scheme` over a grid of times from a start, None for the system's own
             whole: runs over a grid from 0 s to t_end, of `order`    longest: step, s
             most: steps of the run returned
    Returns: the trajectory; its notices say what was measured.
    Raises NotConverged where `most` steps do not reach the tolerance.
    """
    level, found = tolerance, np.inf
    for _ in range(ROUNDS):
        times = _gradual(_marched(part, scheme, t_end, level, longest, most))
        shortest, at = float(np.diff(times).min()) / 2, float(times[int(np.diff(times).argmin())])
        if 2 * (len(times) - 1) > most:
            raise NotConverged(
                f"{most} steps do not keep the error within {tolerance:.2g}: {2 * (len(times) - 1)} would be "
                f"taken, of {shortest:.2g} s at t = {at:.6g} s. Allow more by most=, or a larger tolerance",
                at,
            )
        try:
            rough, fine = whole(times), whole(_halved(times))
        except NotConverged:  # steps too long for the scheme itself
            level *= 0.1
            continue
        # laws of members, contacts and tyres are C2: order 8 is not relied upon here
        error = float(np.abs(fine.position[::2] - rough.position).max(initial=0.0)) / 3.0
        error = error if np.isfinite(error) else np.inf
        coarsest = 2.0 * shortest > 0.5 * longest  # no step was shortened
        if error <= tolerance and (error > CLOSE * tolerance or coarsest or np.isfinite(found)):
            break
        found = error if error <= tolerance else found
        level *= float(np.clip((AIM * tolerance / max(error, 1e-300)) ** (3 / order), 1e-4, 1e2))
    else:
        raise NotConverged(
            f"{ROUNDS} grids did not keep the error within {tolerance:.2g}, the last left {error:.2g}: the "
            "motion hangs on its past too sharply. Take a shorter time or a larger tolerance",
            t_end,
        )
    said = (
        f"{len(fine.times) - 1} steps of {shortest:.3g} to {np.diff(fine.times).max():.3g} s: places are "
        f"off by {error:.2g} m or rad, measured against half the steps, for a tolerance of {tolerance:.2g}"
    )
    return replace(fine, diagnosis=replace(fine.diagnosis, notices=(*fine.diagnosis.notices, said)))
