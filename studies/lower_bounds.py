"""Does the lower bound of a minimax search hold? Games in which some designs lie in valleys of their own.

    peaks           two peaks in the uncertainty, as in `studies.two_peak_games`, heights steep in the design
    peak valleys    the same over designs with waves, a sum of h (1 - cos 2 pi n (x - x1)), and weak bowls
    waves, crest    the waves and the bent resonance of `studies.other_games` over designs with such waves

over one to three designs and one or two scenarios in unit cubes. What designs reach is found by enumeration:
the worst of a design on a dense grid of scenarios, the least of it over random designs and short walks from
the best of them, apart from each other; of the least one the worst is climbed for.

A bound is false where a design of the part that it is stated of gets more than FALSE below it. The
predicted value of the best design, which is what the bound was before decision 329, is counted beside it.
`python -m studies.lower_bounds 0 48 1` plays games 0 to 47 of draw 1 and prints a line for each.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

from studies import other_games, two_peak_games
from studies.asked_range import asked_range
from studies.two_peak_games import ATTACK, RUNS
from workbench import Parameter, Space
from workbench.robust.minimax import minimax

__all__ = ["FALSE", "Valleys", "game", "run"]

FALSE = 2e-3  # of the least worst case, the tolerance of the search
BROAD, NARROW = (0.3, 0.5), (0.1, 0.25)
GRID = {1: 401, 2: 61}  # points per scenario input
DESIGNS = {1: 400, 2: 900, 3: 2000}
WALKS, STEPS, APART = 6, 300, 0.12  # from the best designs, so far apart in one input at least
CLIMBS = 10

Array = np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Valleys:
    """A game `values`: design (dx,), scenarios (m, du) -> (m,), over designs with waves."""

    name: str
    dx: int
    du: int
    values: Callable[[Array, Array], Array]

    @property
    def designs(self) -> Space:
        """The unit cube of the designs."""
        return Space([Parameter(f"x{i + 1}", lower=0.0, upper=1.0) for i in range(self.dx)])

    @property
    def uncertainty(self) -> Space:
        """The unit cube of the scenarios."""
        return Space([Parameter(f"u{i + 1}", lower=0.0, upper=1.0) for i in range(self.du)])

    def __call__(self, x: Mapping[str, float], u: Mapping[str, float]) -> float:
        """f of named design and scenario."""
        return float(self.values(np.array(list(x.values())), np.array(list(u.values()))[None])[0])

    def scenarios(self) -> Array:
        """A dense grid (m, du)."""
        axes = np.meshgrid(*[np.linspace(0, 1, GRID[self.du])] * self.du, indexing="ij")
        return np.column_stack([axis.ravel() for axis in axes])

    def worst(self, x: Array) -> float:
        """The largest f over all scenarios at a design x (dx,), climbed for from the worst of a grid."""
        grid = self.scenarios()
        found = self.values(x, grid)
        climb: Any = minimize
        ends = [
            climb(lambda u: -self.values(x, u[None])[0], grid[i], bounds=[(0, 1)] * self.du)
            for i in np.argsort(-found)[:CLIMBS]
        ]
        return max(float(found.max()), *(-float(end.fun) for end in ends))

    def least(self, low: Array, high: Array) -> tuple[float, Array]:
        """The least worst case that was found among the designs of a box, and its design (dx,)."""
        rng, grid = np.random.default_rng(self.dx), self.scenarios()
        width = high - low

        def on_grid(x: Array) -> float:
            return float(self.values(x, grid).max())

        x = np.vstack([low + width * rng.random((DESIGNS[self.dx], self.dx)), low, high])
        order = np.argsort([on_grid(one) for one in x])
        starts: list[Array] = []
        for i in order:
            if all(np.abs((x[i] - start) / width).max() > APART for start in starts):
                starts.append(x[i])
            if len(starts) == WALKS:
                break
        ends = [_walked(on_grid, start, low, high, rng) for start in starts]
        best = min(ends, key=on_grid)
        return self.worst(best), best


def _walked(
    f: Callable[[Array], float], start: Array, low: Array, high: Array, rng: np.random.Generator
) -> Array:
    """Random steps downhill from a start, longer after a success and shorter after six failures."""
    x, value, step, failures = start, f(start), 0.1, 0
    for _ in range(STEPS):
        tried = np.clip(x + step * (high - low) * rng.standard_normal(len(x)), low, high)
        if (here := f(tried)) < value:
            x, value, step, failures = tried, here, min(1.5 * step, 0.2), 0
        elif (failures := failures + 1) >= 6:
            step, failures = max(step / 1.6, 1e-5), 0
    return x


def game(number: int, draw: int) -> Valleys:
    """The game of a number and a draw: the four kinds by turns."""
    rng = np.random.default_rng([192, draw, number])
    kind, dx, du = number % 4, int(rng.integers(1, 4)), int(rng.integers(1, 3))
    if kind < 2:
        peaks = two_peak_games.Game(
            best=rng.random(dx),
            heights=np.array([rng.uniform(0.8, 1.2), rng.uniform(0.6, 1.4)]),
            tilts=rng.uniform(-1.5, 1.5, (2, dx)),
            centres=rng.uniform(0.1, 0.9, (2, du)),
            moves=rng.uniform(-0.6, 0.6, (2, du, dx)),
            widths=np.array([rng.uniform(*BROAD), rng.uniform(*NARROW)]),
        )
        if kind == 0:
            return Valleys(name="peaks", dx=dx, du=du, values=peaks.values)
        best, weaker = peaks.best, rng.uniform(0.3, 1.0)
        wave = _wave(rng, dx)
        return Valleys(
            name="peak valleys", dx=dx, du=du,
            values=lambda x, u: peaks.values(x, u) + wave(x) - weaker * float(((x - best) ** 2).sum()),
        )  # fmt: skip
    family = {f.__name__.strip("_"): f for f in other_games.FAMILIES}["waves" if kind == 2 else "resonance"]
    played, wave = family(rng, dx, du), _wave(rng, dx)
    return Valleys(
        name="waves" if kind == 2 else "crest", dx=dx, du=du,
        values=lambda x, u: played.values(x, u, 0) + wave(x),
    )  # fmt: skip


def _wave(rng: np.random.Generator, dx: int) -> Callable[[Array], float]:
    height, number, low = rng.uniform(0.05, 0.2), rng.uniform(1.0, 2.0), rng.random(dx)
    return lambda x: height * float((1 - np.cos(2 * np.pi * number * (x - low))).sum())


def run(numbers: range = range(1), *, draw: int = 1, seed: int = 0) -> xr.Dataset:
    """Every game once: `value`, `lower`, `predicted`, the true `worst` of the design, and what designs of the
    part that the bounds are stated of reach, the `least`; how many `runs` were made, whether bounds `met`."""
    rows = []
    for number in numbers:
        played = game(number, draw)
        budget, attack = RUNS * (played.dx + played.du), ATTACK * played.du
        found = minimax(played, played.designs, played.uncertainty, budget=budget, seed=seed, attack=attack)
        low, high = (np.array([ends[k] for ends in found.part.values()]) for k in (0, 1))
        least, _ = played.least(low, high)
        worst = played.worst(np.array([found.design[name] for name in played.designs.names]))
        met = found.status.name == "CONVERGED"
        rows.append((found.value, found.lower, found.predicted, worst, least, found.evaluations, met))
    names = ("value", "lower", "predicted", "worst", "least", "runs", "met")
    return xr.Dataset(
        {name: ("game", np.array([row[k] for row in rows])) for k, name in enumerate(names)},
        coords={"game": list(numbers)},
    )


if __name__ == "__main__":
    numbers, draw = asked_range(sys.argv[1:]), int((sys.argv[3:] or ["1"])[0])
    parts = []
    for number in numbers:
        one = run(range(number, number + 1), draw=draw)
        value, lower, predicted, least = (
            float(one[name].values[0]) for name in ("value", "lower", "predicted", "least")
        )
        is_met, runs = bool(one["met"].values[0]), int(one["runs"].values[0])
        parts.append(((lower - least) / abs(least), (predicted - least) / abs(least), is_met, runs))
        kind, word = game(number, draw).name, "converged" if is_met else ""
        print(
            f"{kind:12s} {number:2d} {word:9s} least {least:8.4f}, value {value / least - 1:7.2%}, predicted "
            f"{parts[-1][1]:7.2%}, bound {parts[-1][0]:7.2%} from it",
            flush=True,
        )
    every = np.array(parts)
    bound, said, met = every[:, 0], every[:, 1], every[:, 2] > 0
    print(
        f"{len(every)} games, {int(every[:, 3].sum())} runs: {int((said > FALSE).sum())} predicted values "
        f"and {int((bound > FALSE).sum())} bounds lie more than {FALSE:.1%} above what a design reaches; of "
        f"{int(met.sum())} converged {int((said[met] > FALSE).sum())} and {int((bound[met] > FALSE).sum())}; "
        f"the bound lies {-np.median(bound):.2%} below it in the median, {-np.median(bound[met]):.2%} of "
        f"converged ones"
    )
