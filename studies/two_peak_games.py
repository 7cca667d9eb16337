"""Does a minimax value stand? Games with two peaks in the uncertainty, one broad and one narrow.

    f(x, u) = 1 + |x - x0|^2 + sum_k h_k(x) exp(-|u - c_k(x)|^2 / (2 w_k^2)),    k = broad, narrow

over designs x and scenarios u in unit cubes of one to three inputs each. Heights h_k = a_k + b_k x and
centres c_k = p_k + Q_k x are affine in the design, so that a search which follows the broad peak (w = 0.3 to
0.5) may leave a design whose worst scenario is the narrow one (w = 0.08 to 0.2). The true worst of a design
is found from the centres of both peaks, all corners and an even sample, refined by L-BFGS-B.

A claim is false where a result that is called converged, or whose evidence is graded attacked, lies more than
1 % under the true worst of its own design. `python -m studies.two_peak_games 0 30 0 1 2` plays games 0 to 29
with seeds 0, 1 and 2 and prints a line for each.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

from studies.asked_range import asked_range
from workbench import Parameter, Space
from workbench.robust.minimax import MinimaxStatus, minimax
from workbench.search.evidence.grade import Grade

__all__ = ["FALSE", "Game", "game", "run"]

FALSE = 0.01  # of the true worst: a claim that much below it is false
BROAD, NARROW = (0.3, 0.5), (0.08, 0.2)
SAMPLE, REFINED = 4000, 5
RUNS, ATTACK = 25, 150  # of the search per coordinate, of the attack per uncertain one

Array = np.ndarray
Point = Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Game:
    """`best` (dx,): x0; of both peaks `heights` (2,) with `tilts` (2, dx), `centres` (2, du) with `moves`
    (2, du, dx), `widths` (2,)."""

    best: Array
    heights: Array
    tilts: Array
    centres: Array
    moves: Array
    widths: Array

    @property
    def designs(self) -> Space:
        """The unit cube of the designs."""
        return _cube("x", len(self.best))

    @property
    def uncertainty(self) -> Space:
        """The unit cube of the scenarios."""
        return _cube("u", self.centres.shape[1])

    def tops(self, x: Array) -> Array:
        """Centres (2, du) of the peaks at a design x (dx,)."""
        moved: Array = np.clip(self.centres + self.moves @ (x - 0.5), 0.0, 1.0)
        return moved

    def values(self, x: Array, u: Array) -> Array:
        """f (m,) at a design x (dx,) in scenarios u (m, du)."""
        away = ((u[:, None, :] - self.tops(x)) ** 2).sum(axis=2)
        peaks = (self.heights + self.tilts @ (x - 0.5)) * np.exp(-away / (2 * self.widths**2))
        made: Array = 1.0 + ((x - self.best) ** 2).sum() + peaks.sum(axis=1)
        return made

    def __call__(self, x: Point, u: Point) -> float:
        """f of named design and scenario."""
        return float(self.values(np.array(list(x.values())), np.array(list(u.values()))[None])[0])

    def worst(self, x: Array) -> float:
        """The largest f over all scenarios at a design x (dx,)."""
        du = self.centres.shape[1]
        even = np.random.default_rng(du).random((SAMPLE, du))
        starts = np.vstack([self.tops(x), np.array(list(product((0.0, 1.0), repeat=du))), even])
        found = self.values(x, starts)
        climb: Any = minimize
        first = [0, 1, *np.argsort(-found)[:REFINED]]
        ends = [climb(lambda u: -self.values(x, u[None])[0], starts[i], bounds=[(0, 1)] * du) for i in first]
        return max(float(found.max()), *(-float(end.fun) for end in ends))


def _cube(prefix: str, count: int) -> Space:
    return Space([Parameter(f"{prefix}{i + 1}", lower=0.0, upper=1.0) for i in range(count)])


def game(number: int) -> Game:
    """The game of a number: designs and uncertainties of 1 to 3 inputs by turns."""
    rng = np.random.default_rng([190, number])
    dx, du = 1 + number % 3, 1 + number // 3 % 3
    return Game(
        best=rng.random(dx),
        heights=np.array([rng.uniform(0.8, 1.2), rng.uniform(0.6, 1.4)]),
        tilts=np.array([rng.uniform(-0.5, 0.5, dx), rng.uniform(-0.8, 0.8, dx)]),
        centres=rng.uniform(0.1, 0.9, (2, du)),
        moves=rng.uniform(-0.4, 0.4, (2, du, dx)),
        widths=np.array([rng.uniform(*BROAD), rng.uniform(*NARROW)]),
    )


def _played(number: int, seed: int) -> tuple[float, float, bool, bool]:
    played = game(number)
    dx, du = len(played.best), played.centres.shape[1]
    budget, attack = RUNS * (dx + du), ATTACK * du
    found = minimax(played, played.designs, played.uncertainty, budget=budget, seed=seed, attack=attack)
    worst = played.worst(np.array([found.design[name] for name in played.designs.names]))
    claims = found.status is MinimaxStatus.CONVERGED or found.grade is not Grade.SEARCHED
    return found.value, worst, claims, found.status is MinimaxStatus.CONVERGED


def run(numbers: Sequence[int] = (0,), seeds: Sequence[int] = (0,)) -> xr.Dataset:
    """Every game with every seed: the `value` that is stated, the true `worst` of the returned design, by how
    much of it the value is `short`, and whether the result `claims` (is converged, or graded attacked).
    """
    made: Any = np.array([[_played(number, seed) for seed in seeds] for number in numbers])
    value, worst = made[:, :, 0], made[:, :, 1]
    columns = {
        "value": value, "worst": worst, "short": (worst - value) / worst, "claims": made[:, :, 2],
        "converged": made[:, :, 3],
    }  # fmt: skip
    return xr.Dataset(
        {name: (("game", "seed"), column) for name, column in columns.items()},
        coords={"game": list(numbers), "seed": list(seeds)},
    )


if __name__ == "__main__":
    numbers = asked_range(sys.argv[1:])
    seeds = [int(text) for text in sys.argv[3:]] or [0]
    parts = []
    for number in numbers:
        for seed in seeds:
            one = run((number,), (seed,))
            parts.append([float(one[key].values[0, 0]) for key in ("short", "claims", "converged")])
            short, claims, converged = parts[-1]
            word = "converged" if converged else "attacked" if claims else "searched"
            stated, worst = float(one["value"].values[0, 0]), float(one["worst"].values[0, 0])
            print(
                f"game {number:2d} seed {seed} {word:9s} {stated:8.4f} {worst:8.4f} {short:8.2%}", flush=True
            )
    every = np.array(parts)
    false = int(((every[:, 0] > FALSE) & (every[:, 1] > 0)).sum())
    print(
        f"{len(every)} searches: {int(every[:, 1].sum())} claim, {int(every[:, 2].sum())} of them converged; "
        f"{false} claims lie more than 1 % under the true worst"
    )
