"""Does a minimax value stand on games that are not made of two peaks? Five families, drawn by number.

    corners      |x - x0|^2 + (u - 1/2)'Q(u - 1/2) + x'A u, convex in u: a corner is worst, x says which
    cliff        |x - x0|^2 + b(x) u, and a step up where n u + m x > c        (worst by linear programming)
    resonance    |x - x0|^2 + a / sqrt((1 - r^2)^2 + (2 z r)^2), r affine in x and u: a bent crest, not a peak
    waves        |x - x0|^2 + b(x) u and two oblique waves: many peaks of nearly the same height
    levels       one of four labels, each with a smooth hill of its own in the other inputs

over designs and scenarios in unit cubes of one to three inputs each. The true worst of a design is a linear
programme (cliff), all corners (corners), or the best of an even sample, all corners and climbs by L-BFGS-B.
Where a claim is false says `studies.two_peak_games`; no choice of the method was made on these games.

`python -m studies.other_games 0 15 5` plays games 0 to 14 with seed 5 and prints a line for each.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linprog, minimize

from studies.asked_range import asked_range
from studies.two_peak_games import ATTACK, FALSE, RUNS
from workbench import Parameter, Space
from workbench.robust.minimax import MinimaxStatus, minimax
from workbench.search.evidence.grade import Grade

__all__ = ["FAMILIES", "OtherGame", "game", "run"]

SAMPLE, CLIMBED = 4000, 12
LABELS = ("dry", "wet", "snow", "ice")

Array = np.ndarray
Values = Callable[[Array, Array, int], Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherGame:
    """`values`: design (dx,), scenarios (m, du) and the place of a label -> f (m,).

    exact: design (dx,) -> its true worst, None where it is sampled and climbed for.
    """

    name: str
    dx: int
    du: int
    values: Values
    labels: tuple[str, ...] = ()
    exact: Callable[[Array], float] | None = None

    @property
    def designs(self) -> Space:
        """The unit cube of the designs."""
        return Space([Parameter(f"x{i + 1}", lower=0.0, upper=1.0) for i in range(self.dx)])

    @property
    def uncertainty(self) -> Space:
        """The unit cube of the scenarios, and the label where there is one."""
        cube = [Parameter(f"u{i + 1}", lower=0.0, upper=1.0) for i in range(self.du)]
        road = [Parameter("road", kind="categorical", levels=list(self.labels))] if self.labels else []
        return Space([*cube, *road])

    def __call__(self, x: Mapping[str, Any], u: Mapping[str, Any]) -> float:
        """f of named design and scenario."""
        label = self.labels.index(u["road"]) if self.labels else 0
        at = np.array([[u[f"u{i + 1}"] for i in range(self.du)]])
        return float(self.values(np.array([x[f"x{i + 1}"] for i in range(self.dx)]), at, label)[0])

    def worst(self, x: Array) -> float:
        """The largest f over all scenarios at a design x (dx,)."""
        if self.exact is not None:
            return self.exact(x)
        even = np.random.default_rng(self.du).random((SAMPLE, self.du))
        starts = np.vstack([np.array(list(product((0.0, 1.0), repeat=self.du))), even])
        climb: Any = minimize
        largest = -np.inf
        for label in range(max(len(self.labels), 1)):
            found = self.values(x, starts, label)
            ends = [
                climb(lambda u, k=label: -self.values(x, u[None], k)[0], start, bounds=[(0, 1)] * self.du)
                for start in starts[np.argsort(-found)[:CLIMBED]]
            ]
            largest = max(largest, float(found.max()), *(-float(end.fun) for end in ends))
        return largest


def _corners(rng: np.random.Generator, dx: int, du: int) -> OtherGame:
    best, root = rng.random(dx), rng.standard_normal((du, du))
    cross, convex = rng.uniform(-1, 1, (dx, du)), root @ root.T / du

    def values(x: Array, u: Array, label: int) -> Array:
        made: Array = 2.0 + ((x - best) ** 2).sum() + x @ cross @ u.T
        return made + np.einsum("mi,ij,mj->m", u - 0.5, convex, u - 0.5)

    ends = np.array(list(product((0.0, 1.0), repeat=du)))
    return OtherGame(
        name="corners", dx=dx, du=du, values=values, exact=lambda x: float(values(x, ends, 0).max())
    )


def _cliff(rng: np.random.Generator, dx: int, du: int) -> OtherGame:
    best, slope, turn = rng.random(dx), rng.uniform(-0.5, 0.5, du), rng.uniform(-0.5, 0.5, (dx, du))
    normal, shift, step = rng.standard_normal(du), rng.uniform(-0.5, 0.5, dx), rng.uniform(0.3, 0.8)
    share = rng.uniform(0.02, 0.3)  # of the scenarios beyond the edge, at the middle of the designs
    edge = float(np.quantile(rng.random((20_000, du)) @ normal, 1 - share)) + float(shift.sum()) / 2

    def values(x: Array, u: Array, label: int) -> Array:
        made: Array = 2.0 + ((x - best) ** 2).sum() + u @ (slope + x @ turn)
        return made + step * (u @ normal + shift @ x > edge)

    def exact(x: Array) -> float:
        rise, base = slope + x @ turn, 2.0 + float(((x - best) ** 2).sum())
        left = edge - float(shift @ x)
        solve: Any = linprog
        beyond = solve(-rise, A_ub=-normal[None], b_ub=[-left], bounds=[(0, 1)] * du)
        top = base + float(np.maximum(rise, 0.0).sum())
        return max(top, base - float(beyond.fun) + step) if beyond.status == 0 else top

    return OtherGame(name="cliff", dx=dx, du=du, values=values, exact=exact)


def _resonance(rng: np.random.Generator, dx: int, du: int) -> OtherGame:
    best, along, by = rng.random(dx), rng.uniform(-0.6, 0.6, du), rng.uniform(-0.4, 0.4, dx)
    tuned = rng.uniform(-0.2, 0.2)
    damping, size, tilt = rng.uniform(0.05, 0.15), rng.uniform(0.1, 0.2), rng.uniform(-0.3, 0.3, du)

    def values(x: Array, u: Array, label: int) -> Array:
        ratio = 1.0 + (u - 0.5) @ along + (x - 0.5) @ by + tuned
        gain: Array = size / np.sqrt((1 - ratio**2) ** 2 + (2 * damping * ratio) ** 2)
        return 1.0 + ((x - best) ** 2).sum() + gain + u @ tilt

    return OtherGame(name="resonance", dx=dx, du=du, values=values)


def _waves(rng: np.random.Generator, dx: int, du: int) -> OtherGame:
    best, slope, turn = rng.random(dx), rng.uniform(-0.3, 0.3, du), rng.uniform(-0.3, 0.3, (dx, du))
    numbers, phases = rng.uniform(1.0, 3.0, (2, du)), rng.uniform(0, 2 * np.pi, 2)
    heights, moved = rng.uniform(0.1, 0.4, 2), rng.uniform(-2, 2, (2, dx))

    def values(x: Array, u: Array, label: int) -> Array:
        waves = np.sin(2 * np.pi * u @ numbers.T / np.sqrt(du) + phases + moved @ x) @ heights
        made: Array = 2.0 + ((x - best) ** 2).sum() + u @ (slope + x @ turn) + waves
        return made

    return OtherGame(name="waves", dx=dx, du=du, values=values)


def _levels(rng: np.random.Generator, dx: int, du: int) -> OtherGame:
    best, tops = rng.random(dx), rng.random((4, du))
    heights, tilts = rng.uniform(0.5, 1.0, 4), rng.uniform(-0.6, 0.6, (4, dx))
    widths = rng.uniform(0.15, 0.6, 4)

    def values(x: Array, u: Array, label: int) -> Array:
        away = ((u - tops[label]) ** 2).sum(axis=1) / (2 * widths[label] ** 2)
        made: Array = (
            1.0 + ((x - best) ** 2).sum() + (heights[label] + tilts[label] @ (x - 0.5)) * np.exp(-away)
        )
        return made

    return OtherGame(name="levels", dx=dx, du=du, values=values, labels=LABELS)


FAMILIES = (_corners, _cliff, _resonance, _waves, _levels)


def game(number: int) -> OtherGame:
    """The game of a number: families by turns, designs and uncertainties of 1 to 3 inputs."""
    rng = np.random.default_rng([191, number])
    dx, du = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    return FAMILIES[number % len(FAMILIES)](rng, dx, du)


def _played(number: int, seed: int) -> tuple[float, float, bool, bool]:
    played = game(number)
    n_uncertain = played.du + bool(played.labels)
    found = minimax(
        played, played.designs, played.uncertainty, budget=RUNS * (played.dx + n_uncertain), seed=seed,
        attack=ATTACK * n_uncertain,
    )  # fmt: skip
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
        "value": value, "worst": worst, "short": (worst - value) / np.abs(worst), "claims": made[:, :, 2],
        "converged": made[:, :, 3],
    }  # fmt: skip
    return xr.Dataset(
        {name: (("game", "seed"), column) for name, column in columns.items()},
        coords={"game": list(numbers), "seed": list(seeds)},
    )


if __name__ == "__main__":
    numbers = asked_range(sys.argv[1:])
    parts = []
    for number, seed in product(numbers, [int(text) for text in sys.argv[3:]] or [0]):
        one = run((number,), (seed,))
        short, claims, converged = (float(one[key].values[0, 0]) for key in ("short", "claims", "converged"))
        parts.append((short, claims, converged))
        word = "converged" if converged else "attacked" if claims else "searched"
        stated, worst = float(one["value"].values[0, 0]), float(one["worst"].values[0, 0])
        name = game(number).name
        print(
            f"{name:9s} {number:2d} seed {seed} {word:9s} {stated:8.4f} {worst:8.4f} {short:8.2%}", flush=True
        )
    every = np.array(parts)
    false = int(((every[:, 0] > FALSE) & (every[:, 1] > 0)).sum())
    print(
        f"{len(every)} searches: {int(every[:, 1].sum())} claim, {int(every[:, 2].sum())} of them converged; "
        f"{false} claims lie more than 1 % under the true worst"
    )
