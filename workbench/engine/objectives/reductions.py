"""Objectives: one number of a trajectory, as a weighted sum of nodal values and rates of a quantity.

Maximum and minimum refine the peak between nodes: a node peak has a gradient error of first order in the
step. The cubic Hermite through g and dg/dt at two nodes is used where the quantity knows its rate, the cubic
through four nodal values otherwise. At the peak the envelope theorem makes the weights of the nodes the
weights of their gradients (6.47 to 6.51 hold for this continuous peak only).
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..integration.kinds import AnyTrajectory
from .quantities import Quantity

__all__ = [
    "AtTime", "Integral", "LogSumExp", "Maximum", "Minimum", "NodeWeight", "Objective", "PNorm", "Peak",
    "Terminal",
]  # fmt: skip

Array = np.ndarray[Any, Any]
Window = tuple[float, float]
NEGLIGIBLE = 1e-14  # of a weight: below rounding of the sum


class NodeWeight(NamedTuple):
    """What a node contributes to an objective: weight * g + rate_weight * dg/dt."""

    node: int
    weight: float
    rate_weight: float = 0.0


class Objective(Protocol):
    """A number of a trajectory and its linearisation in the nodal values of one quantity."""

    quantity: Quantity

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        ...

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """dG/dg and dG/d(dg/dt) at the nodes that matter."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Peak:
    """One local peak of a quantity: where, how high, and which nodes make it. It is itself an objective."""

    quantity: Quantity
    time: float
    height: float
    parts: tuple[NodeWeight, ...]
    at_end: bool

    def value(self, trajectory: AnyTrajectory) -> float:
        """The weighted sum of the same nodes on any trajectory of the same grid."""
        values = self.quantity.values(trajectory)
        total = sum(part.weight * values[part.node] for part in self.parts)
        moving = [part for part in self.parts if part.rate_weight]
        if moving:
            rates = self.quantity.rates(trajectory, np.array([part.node for part in moving]))
            total += sum(part.rate_weight * rate for part, rate in zip(moving, rates, strict=True))
        return float(total)

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """The nodes of the peak."""
        return self.parts


def nodes_within(trajectory: AnyTrajectory, window: Window | None) -> tuple[int, int]:
    """First and last node inside a time window, its ends moved to the nearest nodes.

    Raises ValueError when the window is empty or outside the run.
    """
    times = trajectory.times
    if window is None:
        return 0, len(times) - 1
    low, high = window
    slack = 0.5 * float(np.diff(times).max())
    if not low < high or low < times[0] - slack or high > times[-1] + slack:
        raise ValueError(f"window needs 0 <= start < end <= {times[-1]:.6g} s, got {window}")
    return int(np.abs(times - low).argmin()), int(np.abs(times - high).argmin())


def hermite(s: float, h: float) -> tuple[float, float, float, float]:
    """Weights of g_a, g_b, dg_a/dt, dg_b/dt of the cubic Hermite at fraction s of an interval of length h."""
    return (1 + 2 * s) * (1 - s) ** 2, s * s * (3 - 2 * s), h * s * (1 - s) ** 2, -h * s * s * (1 - s)


def _hermite_top(ga: float, gb: float, da: float, db: float) -> float:
    """Fraction in [0, 1] where the Hermite cubic (rates times the interval length) is largest."""
    best, at = (ga, 0.0) if ga >= gb else (gb, 1.0)
    # derivative: da + 2 s b + 3 s^2 c
    c = 2 * (ga - gb) + da + db
    b = 3 * (gb - ga) - 2 * da - db
    roots: list[float] = []
    if abs(c) < 1e-14 * (abs(b) + abs(da) + 1e-300):
        if b != 0.0:
            roots.append(-da / (2 * b))
    else:
        disc = b * b - 3 * c * da
        if disc >= 0.0:
            q = -(b + math.copysign(math.sqrt(disc), b))
            roots.append(q / (3 * c))
            if q != 0.0:
                roots.append(da / q)
    for s in roots:
        if 0.0 < s < 1.0:
            value = ga + s * (da + s * (b + s * c))
            if value > best:
                best, at = value, s
    return at


def find_peaks(
    trajectory: AnyTrajectory, quantity: Quantity, first: int, last: int, *, sign: float, refine: bool
) -> list[Peak]:
    """Local maxima of sign * g between two nodes, ends included, highest first."""
    values = quantity.values(trajectory)
    g = sign * values
    if not np.isfinite(g[first : last + 1]).all():
        raise ValueError(
            "quantity is not finite along the trajectory; look at the run before taking its maximum"
        )
    inner = g[first : last + 1]
    rising = np.empty(len(inner) + 1, bool)
    rising[0], rising[-1] = True, False
    np.greater_equal(inner[1:], inner[:-1], out=rising[1:-1])
    tops = (first + np.flatnonzero(rising[:-1] > rising[1:])).tolist()
    if not refine or last - first < (1 if quantity.has_rates else 3):
        peaks = [_node_peak(trajectory, quantity, values, top, first, last) for top in tops]
    elif quantity.has_rates:
        # all rates at once: a long rest has hundreds of peaks by rounding
        near = sorted({node for top in tops for node in range(max(first, top - 1), min(last, top + 1) + 1)})
        found = sign * quantity.rates(trajectory, np.array(near))
        rates = dict(zip(near, found.tolist(), strict=True))
        peaks = [_by_hermite(trajectory, quantity, values, rates, top, first, last, sign) for top in tops]
    else:
        peaks = [_by_nodes(trajectory, quantity, values, top, first, last, sign) for top in tops]
    return sorted(peaks, key=lambda peak: -sign * peak.height)


def _node_peak(t: AnyTrajectory, quantity: Quantity, values: Array, top: int, first: int, last: int) -> Peak:
    return Peak(
        quantity=quantity, time=float(t.times[top]), height=float(values[top]),
        parts=(NodeWeight(top, 1.0),), at_end=top in (first, last),
    )  # fmt: skip


def _by_hermite(
    t: AnyTrajectory, quantity: Quantity, values: Array, known: dict[int, float], top: int, first: int,
    last: int, sign: float,
) -> Peak:  # fmt: skip
    begin, end = max(first, top - 1), min(last, top + 1) + 1
    rates = [known[node] for node in range(begin, end)]
    g, times = (sign * values[begin:end]).tolist(), t.times[begin:end].tolist()
    most, best = g[top - begin], None
    for k in range(len(g) - 1):
        h = times[k + 1] - times[k]
        s = _hermite_top(g[k], g[k + 1], h * rates[k], h * rates[k + 1])
        wa, wb, ra, rb = hermite(s, h)
        height = wa * g[k] + wb * g[k + 1] + ra * rates[k] + rb * rates[k + 1]
        if height > most and 0.0 < s < 1.0:
            most, best = height, (times[k] + s * h, begin + k, wa, wb, ra, rb)
    if best is None:
        return _node_peak(t, quantity, values, top, first, last)
    time, a, wa, wb, ra, rb = best
    return Peak(
        quantity=quantity, time=time, height=sign * most,
        parts=(NodeWeight(a, wa, ra), NodeWeight(a + 1, wb, rb)), at_end=False,
    )  # fmt: skip


def _by_nodes(
    t: AnyTrajectory, quantity: Quantity, values: Array, top: int, first: int, last: int, sign: float
) -> Peak:
    start = int(np.clip(top - 1, first, last - 3))
    nodes = np.arange(start, start + 4)
    h = float(t.times[start + 1] - t.times[start])
    cubic = np.polyfit(np.arange(4.0), values[nodes], 3)
    best = _node_peak(t, quantity, values, top, first, last)
    for s in np.roots(np.polyder(cubic)):
        if abs(s.imag) > 1e-12 or not max(0.0, top - start - 1) < s.real < min(3.0, top - start + 1):
            continue
        x = float(s.real)
        weights = [np.prod([(x - j) / (i - j) for j in range(4) if j != i]) for i in range(4)]
        height = float(np.dot(weights, values[nodes]))
        if sign * height > sign * best.height:
            parts = tuple(NodeWeight(int(n), float(w)) for n, w in zip(nodes, weights, strict=True))
            best = Peak(
                quantity=quantity,
                time=float(t.times[start] + x * h),
                height=height,
                parts=parts,
                at_end=False,
            )
    return best


@dataclass(frozen=True, slots=True, kw_only=True)
class Maximum:
    """G = max of a quantity over time (6.47), over `window` (s) if given; refine=False keeps to the nodes."""

    quantity: Quantity
    window: Window | None = None
    refine: bool = True

    def peaks(self, trajectory: AnyTrajectory, *, within: float = np.inf) -> tuple[Peak, ...]:
        """Local peaks, highest first, no lower than the highest by more than `within` times its height."""
        return _peaks(self, trajectory, 1.0, within)

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        return self.peaks(trajectory)[0].height

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """dG/dg and dG/d(dg/dt) at the nodes of the highest peak."""
        return self.peaks(trajectory)[0].parts


@dataclass(frozen=True, slots=True, kw_only=True)
class Minimum:
    """G = min of a quantity over time, over `window` (s) if given; refine=False keeps to the nodes."""

    quantity: Quantity
    window: Window | None = None
    refine: bool = True

    def peaks(self, trajectory: AnyTrajectory, *, within: float = np.inf) -> tuple[Peak, ...]:
        """Local minima, lowest first."""
        return _peaks(self, trajectory, -1.0, within)

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        return self.peaks(trajectory)[0].height

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """dG/dg and dG/d(dg/dt) at the nodes of the lowest minimum."""
        return self.peaks(trajectory)[0].parts


def _peaks(
    objective: Maximum | Minimum, trajectory: AnyTrajectory, sign: float, within: float
) -> tuple[Peak, ...]:
    first, last = nodes_within(trajectory, objective.window)
    found = find_peaks(trajectory, objective.quantity, first, last, sign=sign, refine=objective.refine)
    limit = sign * found[0].height - within * abs(found[0].height) if np.isfinite(within) else -np.inf
    return tuple(peak for peak in found if sign * peak.height >= limit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Terminal:
    """G = g at the end of the run."""

    quantity: Quantity

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        return float(self.quantity.values(trajectory)[-1])

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """The last node."""
        return (NodeWeight(len(trajectory.times) - 1, 1.0),)


@dataclass(frozen=True, slots=True, kw_only=True)
class AtTime:
    """G = g at one time, by cubic Hermite between nodes (at the nearest node for a scalar without rates)."""

    quantity: Quantity
    time: float

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """The nodes around the time."""
        times = trajectory.times
        if not times[0] <= self.time <= times[-1] * (1 + 1e-12):
            raise ValueError(f"time needs to lie in the run, 0 to {times[-1]:.6g} s, got {self.time}")
        a = int(np.clip(np.searchsorted(times, self.time, side="right") - 1, 0, len(times) - 2))
        h = float(times[a + 1] - times[a])
        s = float((self.time - times[a]) / h)
        if not self.quantity.has_rates or s in (0.0, 1.0):
            return (NodeWeight(a + round(s), 1.0),)
        wa, wb, ra, rb = hermite(s, h)
        return (NodeWeight(a, wa, ra), NodeWeight(a + 1, wb, rb))

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        parts = self.weights(trajectory)
        return Peak(quantity=self.quantity, time=self.time, height=0.0, parts=parts, at_end=False).value(
            trajectory
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Integral:
    """G = integral of g dt over the run or a window: trapezoids, Hermite corrections at the ends."""

    quantity: Quantity
    window: Window | None = None

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """Trapezoid weights; h^2/12 on the end rates."""
        first, last = nodes_within(trajectory, self.window)
        h = np.diff(trajectory.times)[first:last]
        weight = np.zeros(last - first + 1)
        weight[:-1] += 0.5 * h
        weight[1:] += 0.5 * h
        rate = np.zeros(last - first + 1)
        if self.quantity.has_rates:
            rate[0], rate[-1] = h[0] ** 2 / 12.0, -(h[-1] ** 2) / 12.0
        return tuple(NodeWeight(first + i, float(weight[i]), float(rate[i])) for i in range(len(weight)))

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        parts = self.weights(trajectory)
        return Peak(quantity=self.quantity, time=0.0, height=0.0, parts=parts, at_end=False).value(trajectory)


@dataclass(frozen=True, slots=True, kw_only=True)
class PNorm:
    """G = (mean over time of |g|^p)^(1/p): a smooth stand-in for the maximum of |g|, never above it."""

    quantity: Quantity
    p: float = 20.0
    window: Window | None = None

    def _shares(self, trajectory: AnyTrajectory) -> tuple[int, Array, Array]:
        if self.p < 1.0:
            raise ValueError(f"p-norm needs p >= 1, got p={self.p}")
        first, last = nodes_within(trajectory, self.window)
        share = np.ones(last - first + 1)
        share[[0, -1]] = 0.5
        return first, share / share.sum(), self.quantity.values(trajectory)[first : last + 1]

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        _, share, g = self._shares(trajectory)
        top = np.abs(g).max()
        return float(top * (share @ (np.abs(g) / top) ** self.p) ** (1.0 / self.p)) if top > 0.0 else 0.0

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """dG/dg at every node of the window."""
        first, share, g = self._shares(trajectory)
        norm = self.value(trajectory)
        if norm == 0.0:
            return (NodeWeight(first, 0.0),)
        slope = share * np.sign(g) * (np.abs(g) / norm) ** (self.p - 1.0)
        return tuple(NodeWeight(first + i, float(s)) for i, s in enumerate(slope) if s != 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogSumExp:
    """G = log(mean over time of exp(s g))/s: a smooth stand-in for the maximum of g, of either sign.

    sharpness: s, in 1 over the unit of g, < 0 for the minimum. G lies below the peak (above the minimum) by
    about log(duration/time near the peak)/|s|.
    """

    quantity: Quantity
    sharpness: float
    window: Window | None = None

    def _shares(self, trajectory: AnyTrajectory) -> tuple[int, Array, float]:
        """First node, the nodes' parts of the sum, and the value."""
        if self.sharpness == 0.0:
            raise ValueError("log-sum-exp needs sharpness other than 0, got 0")
        first, last = nodes_within(trajectory, self.window)
        share = np.ones(last - first + 1)
        share[[0, -1]] = 0.5
        x = self.sharpness * np.asarray(self.quantity.values(trajectory))[first : last + 1]
        top = float(x.max())
        parts = share / share.sum() * np.exp(x - top)
        return first, parts / parts.sum(), float(top + np.log(parts.sum())) / self.sharpness

    def value(self, trajectory: AnyTrajectory) -> float:
        """The objective."""
        return self._shares(trajectory)[2]

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """dG/dg at the nodes that count."""
        first, parts, _ = self._shares(trajectory)
        return tuple(NodeWeight(first + i, float(p)) for i, p in enumerate(parts) if p > NEGLIGIBLE)
