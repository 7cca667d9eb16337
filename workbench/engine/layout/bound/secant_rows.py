"""Curvature of rows from runs that were made anyway: what linear rows miss at designs visited before.

At a design x with rows g_j and gradients dg_j the run of another design x_i, taken or refused, tells

    e_ij = g_j(x_i) - g_j(x) - dg_j d_i,      d_i = x_i - x,

by how much the linear row is wrong there. Rows get the second-order term that makes up for it and nothing
across the way to x_i,

    g_j(x + d) ~ g_j + dg_j d + 1/2 sum_i c_ij (u_i d)^2,     u_i = d_i / |d_i|^2,

c_ij = 2 max(0, e_ij less what nearer designs explain of it): the rows stay convex, exact at x in value and
slope, and where they bend upwards exact at the nearest x_i. An end of a history that a long step throws
far up is known before it is thrown a second time.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import local_peaks

__all__ = ["VisitedDesigns"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_KEPT = 12  # designs
_USED = 2  # of them, the nearest first
_REACH = 3.0  # in radii of the trust region
_HERE = 1e-12  # in widths: the same design


@dataclass(slots=True, kw_only=True)
class VisitedDesigns:
    """densities (members,) and histories (scenarios, nodes) of the last designs that were run."""

    densities: list[Array] = field(default_factory=list)
    histories: list[Array] = field(default_factory=list)

    def add(self, density: Array, values: Array) -> None:
        """One more; the oldest is forgotten."""
        self.densities.append(density)
        self.histories.append(values)
        del self.densities[:-_KEPT], self.histories[:-_KEPT]

    def near(self, density: Array, reach: Array) -> list[int]:
        """The nearest of those within a reach (members,) of a design, that design itself left out."""
        size = np.where(reach > 0, reach, 1.0)
        apart = [float(np.abs((other - density) / size).max()) for other in self.densities]
        order = np.argsort(apart, kind="stable")
        return [int(i) for i in order if _HERE < apart[i] <= _REACH][:_USED]

    def peaks(self, near: list[int], *, above: float) -> Rows:
        """Rows that were peaks above a level at these designs."""
        found = [local_peaks(self.histories[i], above=above) for i in near]
        return np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.intp)

    def factors(self, near: list[int], density: Array, values: Array, rows: Rows, gradients: Array) -> Array:
        """(rows, designs, members): W with curvature W'W of every row."""
        here = values.ravel()[rows]
        ways = np.array([self.densities[i] - density for i in near])
        units = ways / (ways**2).sum(axis=1, keepdims=True)
        found = np.zeros((len(rows), len(near), len(density)))
        curvature = np.zeros((len(rows), len(near)))
        for k, i in enumerate(near):
            explained = 0.5 * curvature[:, :k] @ (units[:k] @ ways[k]) ** 2
            missed = self.histories[i].ravel()[rows] - here - gradients @ ways[k] - explained
            curvature[:, k] = 2 * np.maximum(missed, 0.0)
            found[:, k] = np.sqrt(curvature[:, k, None]) * units[k]
        return found
