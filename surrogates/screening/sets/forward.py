"""Forward screening as published: section 3.3 of the dissertation, literal.

All inputs share one theta. In each step every input still in the pool S is tried with a theta of its own,
l is maximised over all free theta (one warm start: theta_i = theta_S), and the input with the largest l
leaves S. The screening ends when the best gain is not large. sigma^2 is profiled, which gives the same l
as maximising over it.

The search is greedy, and from one warm start it often stays in a local maximum: on Welch's function it
finds the six active inputs from 50 runs for one design in five or ten. It is kept because it is what was
published; see `docs/explanation/sampler-question.md`.
"""

from dataclasses import dataclass

import numpy as np

from ..partitions.optimum import Landscape, Optimum

__all__ = ["ForwardStep", "forward_path"]

# log theta of all inputs is searched from these, so that the first maximum is the global one
COMMON_STARTS = (-8.0, -6.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForwardStep:
    """One step: the unit that left the pool and the maximum without it."""

    added: int
    optimum: Optimum
    gain: float


def split(n_units: int, selected: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    """Each selected unit on its own, the others pooled last."""
    rest = tuple(u for u in range(n_units) if u not in selected)
    own = tuple((u,) for u in selected)
    return (*own, rest) if rest else own


def common_theta(landscape: Landscape, *, nugget: tuple[float, float]) -> Optimum:
    """The maximum with one theta for all units."""
    start = np.log(np.sqrt(nugget[0] * nugget[1]))
    ends = [
        landscape.climb(
            split(landscape.n_units, ()),
            np.array([c, start]),
            nugget=nugget,
            tolerance=1e-9,
            max_evaluations=80,
        )
        for c in COMMON_STARTS
    ]
    return max(ends, key=lambda o: o.value)


def forward_path(
    landscape: Landscape, *, nugget: tuple[float, float], threshold: float, steps: int | None = None
) -> tuple[Optimum, list[ForwardStep]]:
    """The maximum with all pooled, and the steps, the first one below `threshold` included.

    With `steps` the screening goes on to that number of steps whatever the gains.
    """
    here = base = common_theta(landscape, nugget=nugget)
    path: list[ForwardStep] = []
    selected: tuple[int, ...] = ()
    while len(selected) < landscape.n_units:
        best: tuple[Optimum, int] | None = None
        for u in (u for u in range(landscape.n_units) if u not in selected):
            partition = split(landscape.n_units, (*selected, u))
            k, phi = len(selected), here.phi
            # theta_i starts at theta_S, which is dropped when no unit is left to share it
            start = np.concatenate([phi[:k], phi[k : k + 1], phi[k : k + 1], phi[k + 1 :]])
            if len(partition) == k + 1:
                start = np.delete(start, k + 1)
            end = landscape.climb(partition, start, nugget=nugget, tolerance=1e-7, max_evaluations=100)
            if best is None or end.value > best[0].value:
                best = end, u
        assert best is not None
        gain = best[0].value - here.value
        here, unit = best
        selected = (*selected, unit)
        path.append(ForwardStep(added=unit, optimum=here, gain=gain))
        if steps is None and gain < threshold:
            break
        if steps is not None and len(path) >= steps:
            break
    return base, path
