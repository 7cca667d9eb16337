"""How near can a search along a border of failures come, if it knows the response exactly?

The response is linear with known slopes a, and runs fail beyond a plane n u = c that nobody knows, as in the
planes of `studies.failure_border`; a sixth of the box fails or so. A search has d + 2 space-filling runs and
then, up to 30 in all, the run of the largest score, where what is known of the plane is its exact posterior:

    one step    (m - b) P^2, with the gain m - b over the worst run and the chance of success P >= `least`
    two steps   the expected gain of the best run that may follow, over both answers of this one

`rising` asks for more chance, the more runs have failed, as `workbench.search.proposals.border_walk` once
did.

The posterior of (n, c) is a normal law cut by one half-space per run, sampled by hit-and-run; before any run
the normal is along the slopes, give or take 70 % of each. A real search knows less: it predicts the response.

`python -m studies.border_known_response 7 30` prints every rule on 30 drawn planes in 7 inputs.
"""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linprog
from scipy.special import ndtr, ndtri

import doe

__all__ = ["RULES", "run"]

BUDGET, CLOSE = 30, 0.01  # of the constrained worst
SPREAD = 0.7  # of a slope of the border, relative to that of the response
DRAWS, STEPS = 240, 40  # planes that are drawn, and steps of hit-and-run between two runs
NOTICEABLE = 3e-3  # of the worst
# candidates: worst cases of drawn planes, random points, points near the best
TOPS, INSIDE, NEAR = 60, 300, 100
KEPT = 60  # candidates of the largest score that two steps are looked ahead from
LARGEST = 4.0  # deviations of the law before any run, of a first plane that agrees with all runs
SLOPE, MOST = 3.0, 0.95  # by which the least chance rises with the share of runs that failed beyond `rate`
SETTLING = 8  # runs before the share of failures is taken as such
RULES = {
    "one step, rising": (1, 0.3, 0.25),
    "one step, rising later": (1, 0.3, 0.35),
    "one step": (1, 0.3, 1.0),
    "one step, bolder": (1, 0.1, 1.0),
    "two steps": (2, 0.3, 1.0),
}  # steps, least chance, share of failed runs (of those after the first) beyond which it rises

Array = np.ndarray


def _terms(u: Array) -> Array:
    """1 and the centred inputs (m, 1 + d): the margin of a plane is linear in them."""
    return np.column_stack([np.ones(len(u)), u - 0.5])


class _Planes:
    """Planes drawn from what the runs say: margins `terms @ s`, positive where a run succeeds."""

    def __init__(self, slopes: Array, rng: np.random.Generator) -> None:
        """slopes: (d,) of the response."""
        size = 0.5 * float(slopes.sum()) * 0.5
        self.mean = np.concatenate([[0.6 * size], -slopes])
        self.deviation = np.concatenate([[size], SPREAD * slopes])
        self.rng = rng
        self.whitened = rng.standard_normal((DRAWS, len(self.mean)))

    @property
    def drawn(self) -> Array:
        """(DRAWS, 1 + d)"""
        planes: Array = self.mean + self.whitened * self.deviation
        return planes

    def learn(self, u: Array, ok: Array) -> None:
        """Draw again after runs at u (n, d) of which ok (n,) succeeded."""
        y = np.where(ok, 1.0, -1.0)
        rows, offset = y[:, None] * _terms(u) * self.deviation, y * (_terms(u) @ self.mean)
        kept = np.flatnonzero((self.whitened @ rows.T + offset >= 0).all(axis=1))
        if len(kept) < 5:
            start: Array = np.array([self._inside(rows, offset) for _ in range(8)])
        else:
            start = self.whitened[kept]
        z = start[self.rng.integers(0, len(start), DRAWS)]
        for _ in range(STEPS if len(kept) >= 5 else 2 * STEPS):
            along = self.rng.standard_normal(z.shape)
            along /= np.linalg.norm(along, axis=1)[:, None]
            margin, slope = z @ rows.T + offset, along @ rows.T
            with np.errstate(divide="ignore", invalid="ignore"):
                reach = -margin / slope
            low = np.where(slope > 0, reach, -np.inf).max(axis=1)
            high = np.where(slope < 0, reach, np.inf).min(axis=1)
            middle = -(z * along).sum(axis=1)
            ends = ndtr(low - middle), ndtr(high - middle)
            share = ends[0] + (ends[1] - ends[0]) * self.rng.random(DRAWS)
            step = np.clip(middle + ndtri(np.clip(share, 1e-15, 1 - 1e-15)), low, high)
            z = z + np.where(np.isfinite(step), step, 0.0)[:, None] * along
        self.whitened = z

    def _inside(self, rows: Array, offset: Array) -> Array:
        """A plane (1 + d,) that agrees with all runs, by a random linear programme."""
        k = rows.shape[1]
        solve: Any = linprog
        found = solve(
            np.concatenate([0.01 * self.rng.standard_normal(k), [-1.0]]),
            A_ub=np.column_stack([-rows, np.ones(len(rows))]), b_ub=offset,
            bounds=[(-LARGEST, LARGEST)] * k + [(0, 0.05)],
        )  # fmt: skip
        if found.status != 0:
            raise RuntimeError("no plane within four deviations agrees with the runs")
        inside: Array = found.x[:k]
        return inside

    def tops(self, slopes: Array) -> Array:
        """Worst cases (TOPS, d) of drawn planes: what gains most for its share of the margin comes first."""
        made = []
        for plane in self.drawn[:TOPS]:
            price = -plane[1:]
            u = (price <= 0).astype(float)
            left = float(plane[0] + price.sum() / 2 - price @ u)
            for j in np.argsort(-slopes / np.maximum(price, 1e-9)):
                if price[j] > 0 and left > 0:
                    u[j] = min(1.0, left / price[j])
                    left -= price[j] * u[j]
            made.append(u)
        return np.array(made)


def _next(planes: _Planes, slopes: Array, best: Array, *, steps: int, least: float, gain: float) -> Array:
    """The next run (d,) by one of the rules; `best` (d,) is the worst run so far."""
    rng, d, value = planes.rng, len(slopes), float(slopes @ best)
    tops = planes.tops(slopes)
    among = np.vstack([
        tops, best + rng.random((TOPS, 1)) * (tops - best), rng.random((INSIDE, d)),
        np.clip(best + 0.1 * rng.standard_normal((NEAR, d)), 0, 1),
    ])  # fmt: skip

    def score(u: Array) -> tuple[Array, Array]:
        succeeds = _terms(u) @ planes.drawn.T >= 0
        chance, more = succeeds.mean(axis=1), u @ slopes - value
        worth = np.log(np.maximum(more, 1e-9)) + 2 * np.log(np.maximum(chance, 1e-9))
        return np.where((more > gain) & (chance >= least), worth, -np.inf), succeeds

    scores, succeeds = score(among)
    if not np.isfinite(scores).any():
        likely: Array = among[np.argmax(np.where(among @ slopes > value, succeeds.mean(axis=1), -1.0))]
        return likely
    if steps == 2:
        kept = np.argsort(scores)[::-1][:KEPT]
        return among[kept[_ahead(succeeds[kept].astype(float), among[kept] @ slopes, value)]]
    point, worth, length = among[np.argmax(scores)], float(scores.max()), 0.2
    while length > 2e-3:
        moved = rng.standard_normal((150, d)) * (rng.random((150, d)) < 0.5)
        tried = np.clip(point + length * rng.random((150, 1)) ** 2 * moved, 0, 1)
        values = score(tried)[0]
        if values.max() > worth + 1e-3:
            point, worth = tried[np.argmax(values)], float(values.max())
        else:
            length /= 2
    return point


def _ahead(succeeds: Array, values: Array, best: float) -> int:
    """Which candidate leaves the largest expected value after the run that follows it.

    succeeds: (m, DRAWS) whether it does under each plane.    values: (m,).    best: the worst run so far.
    """
    count = succeeds.sum(axis=1)
    both = succeeds @ succeeds.T
    after_success = both / np.maximum(count[:, None], 1)
    after_failure = (count - both) / np.maximum((succeeds.shape[1] - count)[:, None], 1)
    reached = np.maximum(values, best)
    then = reached + (np.maximum(values - reached[:, None], 0.0) * after_success).max(axis=1)
    else_ = best + (np.maximum(values - best, 0.0) * after_failure).max(axis=1)
    chance = count / succeeds.shape[1]
    return int(np.argmax(chance * then + (1 - chance) * else_))


def _searched(d: int, number: int, rule: str) -> tuple[float, float]:
    """How far the worst found is short of the constrained worst, and the share of the runs that fail."""
    drawn = np.random.default_rng([d, number])
    slopes, normal = 0.3 + drawn.random(d), 0.3 + drawn.random(d)
    limit = float(normal.sum() / 2 + np.sqrt((normal**2).sum() / 12))
    solve: Any = linprog
    worst = -float(solve(-slopes, A_ub=normal[None], b_ub=[limit], bounds=[(0, 1)] * d).fun)
    rng = np.random.default_rng(number)
    u = doe.optimised_lhs(d + 2, d, criterion="phi_p", swaps=2000, rng=rng)
    planes, (steps, least, rate) = _Planes(slopes, rng), RULES[rule]
    while len(u) < BUDGET:
        ok = u @ normal <= limit
        planes.learn(u, ok)
        best = u[ok][np.argmax(u[ok] @ slopes)]
        failed = float((~ok[d + 2 :]).sum()) / max(len(u) - d - 2, SETTLING)
        chance = float(np.clip(least + SLOPE * (failed - rate), least, MOST))
        following = _next(planes, slopes, best, steps=steps, least=chance, gain=NOTICEABLE * worst)
        u = np.vstack([u, following])
    ok = u @ normal <= limit
    return (worst - float((u[ok] @ slopes).max())) / worst, float((~ok[d + 2 :]).mean())


def run(dimension: int, numbers: Sequence[int], *, rules: Sequence[str] = tuple(RULES)) -> xr.Dataset:
    """Every rule on drawn planes: how far it stays `short` of the worst, and the share that `failed`."""
    made = np.array([[_searched(dimension, number, rule) for number in numbers] for rule in rules])
    return xr.Dataset(
        {"short": (("rule", "number"), made[:, :, 0]), "failed": (("rule", "number"), made[:, :, 1])},
        coords={"rule": list(rules), "number": list(numbers)},
        attrs={"budget": BUDGET, "close": CLOSE, "dimension": dimension},
    )


if __name__ == "__main__":
    d, count = (int(text) for text in (sys.argv[1:3] or ("7", "10")))
    for rule in RULES:
        found = run(d, range(count), rules=(rule,))
        print(
            f"{d} inputs, {rule:22s} within 1 % {float((found['short'] <= CLOSE).mean()):5.1%}   short "
            f"{float(found['short'].median()):6.2%} (mean {float(found['short'].mean()):6.2%})   "
            f"failed {float(found['failed'].mean()):5.1%}",
            flush=True,
        )
