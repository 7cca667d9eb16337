"""The maximum-likelihood original of the forward screening.

Welch, Buck, Sacks, Wynn, Mitchell & Morris, Technometrics 34 (1992), 15-25. Like
`surrogates.screening.sets.forward`, but with the full likelihood (3.11) and with the exponent of the
power-exponential correlation (3.6) free: a common theta and exponent for the pool, both of its own for every
input that leaves it. The exponents are taken from the ladder `ETAS`, which leaves the theta as the only
continuous unknowns.
"""

import numpy as np
from numpy.typing import NDArray

from ..partitions.canonical import CanonicalRuns
from ..partitions.optimum import Optimum
from ..partitions.packed import PackedLandscape, packed_distances
from .forward import ForwardStep, common_theta, split

__all__ = ["ETAS", "welch_path"]

ETAS = (2.0, 1.75, 1.5, 1.25, 1.0)
MOST_NUMBERS = 60_000_000  # doubles of packed distances: half a gigabyte


def welch_path(
    runs: CanonicalRuns, *, nugget: tuple[float, float], threshold: float, steps: int | None = None
) -> tuple[Optimum, list[ForwardStep], list[NDArray[np.float64]]]:
    """The maximum with all pooled, the steps, and the exponents of every unit at each of them, base first."""
    n, m = len(runs.y), len(runs.units)
    if len(ETAS) * m * n * n // 2 > MOST_NUMBERS:
        raise ValueError(
            f"method 'welch' holds all distances in memory and cannot take {n} runs of {m} inputs: "
            "use a part of the runs, or method='default'"
        )
    distances = {eta: packed_distances(runs, eta) for eta in ETAS}

    def landscape(etas: NDArray[np.float64]) -> PackedLandscape:
        return PackedLandscape(np.array([distances[e][u] for u, e in enumerate(etas)]), runs.y, False)

    def climbed(selected: tuple[int, ...], own: NDArray[np.float64], start: NDArray[np.float64]) -> Optimum:
        return landscape(own).climb(
            split(m, selected), start, nugget=nugget, tolerance=1e-6, max_evaluations=100
        )

    bases = [(common_theta(landscape(np.full(m, eta)), nugget=nugget), np.full(m, eta)) for eta in ETAS]
    here, etas = max(bases, key=lambda b: b[0].value)
    base, path, exponents = here, list[ForwardStep](), [etas]
    selected: tuple[int, ...] = ()
    while len(selected) < m:
        k, best = len(selected), None
        for u in (u for u in range(m) if u not in selected):
            shared = here.phi[k : k + 1] if m > k + 1 else np.empty(0)
            start = np.concatenate([here.phi[: k + 1], shared, here.phi[-1:]])
            for eta in ETAS:
                own = etas.copy()
                own[u] = eta
                end = climbed((*selected, u), own, start)
                if best is None or end.value > best[0].value:
                    best = end, u, own
        assert best is not None
        end, unit, etas = best
        selected = (*selected, unit)
        for eta in ETAS:  # the exponent of those that stay in the pool may change when one has left it
            own = np.full(m, eta)
            own[list(selected)] = etas[list(selected)]
            other = climbed(selected, own, end.phi)
            if other.value > end.value:
                end, etas = other, own
        path.append(ForwardStep(added=unit, optimum=end, gain=end.value - here.value))
        here = end
        exponents.append(etas)
        if (steps is None and path[-1].gain < threshold) or (steps is not None and len(path) >= steps):
            break
    return base, path, exponents
