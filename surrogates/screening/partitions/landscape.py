"""The likelihood of canonical runs over partitions of the units into groups with one theta each.

A screening compares partitions: every unit on its own (ARD), a few selected units on their own and the
rest without effect (units in no group have theta = 0), or the rest pooled in one group with a common theta,
as published. A `Landscape` climbs from a start to a maximum of l for a given partition. Two ways lead up: up
to `PACKED_RUNS` runs a compiled ascent over packed distances, for larger designs matrix products over the
inputs. Both take average-information steps.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...likelihood.correlation import Correlation
from ...likelihood.likelihood import Likelihood
from .canonical import CanonicalRuns
from .dense import DenseLandscape
from .optimum import Landscape
from .packed import PackedLandscape, packed_distances

__all__ = ["PACKED_RUNS", "landscape_of"]

Array = NDArray[np.float64]

PACKED_RUNS = 130  # where LAPACK's blocked factorisation overtakes the compiled loops


def landscape_of(
    runs: CanonicalRuns,
    *,
    restricted: bool = True,
    eta: float | Array = 2.0,
    rows: NDArray[np.intp] | None = None,
) -> Landscape:
    """The landscape of canonical runs, or of some of their rows."""
    if rows is not None:
        runs = replace(runs, x=np.ascontiguousarray(runs.x[rows]), y=runs.y[rows])
    if len(runs.y) <= PACKED_RUNS or np.ptp(eta) > 0.0:
        return PackedLandscape(packed_distances(runs, eta), runs.y, restricted)
    eta = float(np.max(eta))
    correlation = Correlation(
        kind="gaussian" if eta == 2.0 else "power_exponential", eta=eta, labels=runs.labels
    )
    return DenseLandscape(
        Likelihood(
            x=runs.x,
            f=np.ones((len(runs.y), 1)),
            y=runs.y[:, None],
            correlation=correlation,
            groups=np.zeros(runs.x.shape[1], dtype=np.intp),
            restricted=restricted,
        ),
        runs.units,
    )
