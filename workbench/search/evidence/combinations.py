"""Which combinations of discrete factors were tried, and how bad the response could be in each of them.

    bound of c = max(worst run of c, min(U, b_c + max(U - max_c b_c, 0)))
    b_c        = max over u in c of m(u) + 3 kappa s(u)

b_c is the bound of the cautious Kriging, sought at random points and corners of the combination and at its
own runs, and from the highest of them by pattern search with the discrete factors held. U is the bound that
was stated for the whole space: no combination can exceed it, and one of them holds it. Where U lies above
every b_c (a certificate, or a prediction beyond the runs) nothing says in which combination, and all are
raised alike.
"""

from collections.abc import Sequence
from itertools import product
from math import isfinite
from typing import Any

import numpy as np

from workbench.search.evidence.gap import BOUND_FACTOR, Gap
from workbench.search.runs.ledger import Ledger
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.pattern_search import maximise_score

__all__ = ["combinations_tried"]

RANDOM_POINTS, CORNERS = 300, 200  # of every combination; all its corners where these are fewer
REFINED, SWEEPS = 2, 25


def combinations_tried(
    ledger: Ledger,
    model: SearchModel,
    gap: Gap,
    *,
    u: np.ndarray,
    v: np.ndarray,
    excluded: np.ndarray,
    rng: np.random.Generator,
) -> tuple[dict[str, Any], ...]:
    """Per discrete combination that the constraints allow: its runs, their worst value, its bound (None where
    none is known), and whether that exceeds the worst run of all.

    `gap`: what is stated of the whole space, in the sign of the ledger. u (n, d) and v (n,): points and
    signed values of the runs; `excluded` (m, d): points that `within` excludes. Where every factor is
    discrete, a combination that was run is known.
    """
    where, discrete = ledger.where, list(ledger.where.discrete)
    table = where.combinations()
    if table is None:
        return ()
    pools = [_pool(ledger, combination, u, rng) for combination in table]
    kept = [i for i, pool in enumerate(pools) if len(pool)]
    table, pools = table[kept], [pools[i] for i in kept]
    mine = [_among(u, discrete, combination) for combination in table]
    worst = [float(v[which].max()) if which.any() else None for which in mine]
    known = [
        bool(where.is_finite and (which.any() or _among(excluded, discrete, combination).any()))
        for which, combination in zip(mine, table, strict=True)
    ]
    bounds = _bounds(ledger, model, pools, known)
    names = [where.space.names[j] for j in discrete]
    out = []
    for i, bound in enumerate(_agreeing(bounds, gap, worst, known)):
        values = where.rows(pools[i][:1])[0]
        has_worst = worst[i] is not None
        out.append(
            {
                "combination": {name: values[name] for name in names},
                "runs": int(mine[i].sum()),
                "worst": ledger.sign * worst[i] if has_worst else None,  # type: ignore[operator]
                "bound": ledger.sign * bound if isfinite(bound) else None,
                "open": bool(not known[i] and bound > v.max()),
            }
        )
    return tuple(out)


def _pool(ledger: Ledger, combination: np.ndarray, u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Allowed points (m, d) of a combination (k,): random ones, corners, and its own runs among u (n, d)."""
    where, discrete = ledger.where, list(ledger.where.discrete)
    free = [j for j in range(where.dimension) if j not in discrete]
    if not free:
        points = np.empty((1, where.dimension))
    else:
        inside = rng.random((RANDOM_POINTS, where.dimension))
        few = 2 ** len(free) <= CORNERS
        ends = np.array(list(product((0.0, 1.0), repeat=len(free)))) if few else None
        corners = np.zeros((CORNERS if ends is None else len(ends), where.dimension))
        corners[:, free] = rng.integers(0, 2, (CORNERS, len(free))) if ends is None else ends
        points = np.vstack([inside, corners, u[_among(u, discrete, combination)]])
    points[:, discrete] = combination
    allowed: np.ndarray = points[where.allowed(points)]
    return allowed


def _bounds(
    ledger: Ledger, model: SearchModel, pools: Sequence[np.ndarray], known: Sequence[bool]
) -> np.ndarray:
    """The largest bound (m,) of the cautious Kriging in each combination, -inf where it is `known`."""
    where, judge = ledger.where, model.cautious or model
    ceiling = float(ledger.v.max()) + float(np.ptp(ledger.v))  # as far as the gap of a search goes

    def score(points: np.ndarray) -> np.ndarray:
        bound = np.minimum(judge.bound(where.features(points), BOUND_FACTOR), ceiling)
        return np.where(where.allowed(points), bound, -np.inf)

    found = np.full(len(pools), -np.inf)
    starts, owners = [], []
    for i, pool in enumerate(pools):
        if known[i]:
            continue
        scores = score(pool)
        found[i] = float(scores.max())
        top = np.argsort(scores)[-REFINED:]
        starts.append(pool[top])
        owners += [i] * len(top)
    if starts and not where.is_finite:
        held = [None if grid is None else np.empty(0) for grid in where.levels]  # nothing else is tried of it
        climbed = maximise_score(score, np.vstack(starts), held, sweeps=SWEEPS)[1]
        np.maximum.at(found, owners, climbed)
    return found


def _agreeing(
    bounds: np.ndarray, gap: Gap, worst: Sequence[float | None], known: Sequence[bool]
) -> list[float]:
    """The `bounds` (m,) of the combinations, made to agree with the `gap` of the whole and with the runs."""
    own = np.array([-np.inf if value is None else value for value in worst])
    unknown = ~np.array(known, dtype=bool)
    stated = own.copy()
    if unknown.any():
        missing = max(gap.upper - float(bounds[unknown].max()), 0.0)
        stated[unknown] = np.maximum(own[unknown], np.minimum(gap.upper, bounds[unknown] + missing))
    return [float(value) for value in stated]


def _among(u: np.ndarray, discrete: list[int], combination: np.ndarray) -> np.ndarray:
    """Which of the points (n, d) have the combination (k,) of discrete coordinates."""
    same: np.ndarray = np.all(np.abs(u[:, discrete] - combination) < 1e-9, axis=1)
    return same
