"""The true runs of a minimax search: points z = (x, u) of design and uncertainty, and their values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.models.evaluator import Evaluator, Outcome, Reading
from workbench.models.values import is_value
from workbench.robust.minimax_record import FailedRun
from workbench.search.evidence.failure_map import LevelFailures, failure_map
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.feasibility import Feasibility
from workbench.space.streams import stream

__all__ = ["LEAST_CHANCE", "SAME", "JointRuns", "Region"]

Array = np.ndarray

SAME = 1e-6  # of the unit cube: closer points are one point
LEAST_CHANCE = 0.5 - 1e-9  # of a value: half way between success and failure, whatever the last bit
MOST_COUNTED = 4096  # points of a finite design and uncertainty that may all be run
DRAWS = 50
DRAWS_AFTER_FAILURES = 4  # then fewer points than wanted are run: what is left of the box likely fails
LEAST_WEIGHT = 1e-6  # in the metric of failures: a border is followed to 1e-3 without regard to inert inputs
RELEARN = 1.1  # growth of the runs after which the metric of the failures is learnt again


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """The part of the design space that a cycle looks at: the box of `width` around `centre` (dx,), in the
    unit cube."""

    centre: Array
    width: float


@dataclass(slots=True, kw_only=True)
class JointRuns:
    """Different runs within a budget; `y` is NaN where one failed. x (dx,) and u (du,) in unit cubes."""

    design: SearchSpace
    uncertain: SearchSpace
    evaluate: Evaluator
    read: Reading
    budget: int
    seed: int
    scenarios: list[Array] = field(default_factory=list)  # accumulated: given ones, and those run at a design
    failed: list[FailedRun] = field(default_factory=list)
    z: Array = field(init=False)
    y: Array = field(init=False)
    _place: dict[tuple[Any, ...], int] = field(init=False, default_factory=dict)  # row -> its number
    _known: dict[Any, Outcome] = field(default_factory=dict)
    _feasibility: Feasibility | None = field(init=False, default=None)
    _learnt_at: int = field(init=False, default=0)
    _every: int | None = field(init=False, default=None)  # allowed points, None when there is no end of them

    def __post_init__(self) -> None:
        self.z, self.y = np.empty((0, self.dimension)), np.empty(0)
        if self.design.size * self.uncertain.size <= MOST_COUNTED:
            x, u = self.design.points(), self.uncertain.points()
            self._every = None if x is None or u is None else len(x) * len(u)

    @property
    def dx(self) -> int:
        """Design coordinates."""
        return self.design.dimension

    @property
    def du(self) -> int:
        """Uncertain coordinates."""
        return self.uncertain.dimension

    @property
    def dimension(self) -> int:
        """Coordinates of both."""
        return self.dx + self.du

    @property
    def free_features(self) -> int:
        """Coordinates of both, a category of m levels counted m - 1 times."""
        both = (self.design, self.uncertain)
        return sum(space.n_features - sum(space.categorical) for space in both)

    @property
    def left(self) -> int:
        """Runs that the budget still allows."""
        return self.budget - len(self.y)

    def allow(self, count: int) -> None:
        """Let so many more runs be made from here on, none where it is negative."""
        self.budget = len(self.y) + max(count, 0)

    @property
    def spread(self) -> float:
        """Interquartile range of the values seen."""
        values = self.y[np.isfinite(self.y)]
        return float(np.subtract(*np.quantile(values, [0.75, 0.25])))

    def threshold(self, value: float, tolerance: float) -> float:
        """By how much bounds about a value may differ that have met."""
        return tolerance * max(abs(value), 1e-2 * self.spread)

    @property
    def has_failures(self) -> bool:
        """Whether a run gave no value."""
        return bool(np.isnan(self.y).any())

    def features(self, z: Array) -> Array:
        """Kriging features (m, p) of points z (m, dx + du)."""
        return np.column_stack(
            [self.design.features(z[:, : self.dx]), self.uncertain.features(z[:, self.dx :])]
        )

    def run(self, z: Array, purpose: str) -> Array:
        """True values at z (m, dx + du), NaN where failed; of new points at most as many as the budget
        allows. A point that was run is answered from memory and costs nothing."""
        z = np.array(z, ndmin=2).reshape(-1, self.dimension)
        rows = self._rows(z)
        new: dict[tuple[Any, ...], int] = {}
        for i, row in enumerate(rows):
            if _address(row) not in self._place and len(new) < self.left:
                new.setdefault(_address(row), i)
        if new:
            first = list(new.values())
            self._make(z[first], [rows[i] for i in first], purpose)
        places = [self._place[_address(row)] for row in rows if _address(row) in self._place]
        return self.y[places]

    def keep(self, z: Array, scenario: Mapping[str, Any]) -> None:
        """Make a run of an attack at z (dx + du,) one of the search's, at no cost: it is the outcome known of
        this very row, which z returns to but for its last bits."""
        row = {**self.design.rows(z[None, : self.dx])[0], **scenario}
        if _address(row) not in self._place:
            self._make(z[None], [row], "minimax attack")

    def is_known(self, x: Array, u: Array) -> bool:
        """Whether design x was run in scenario u, or so near to it that another run would tell nothing."""
        row = self._rows(np.concatenate([x, u])[None])[0]
        return _address(row) in self._place or bool(self.near(x, u).any())

    def _make(self, z: Array, rows: list[dict[str, Any]], purpose: str) -> None:
        outcomes = self.outcomes(rows, purpose=purpose)
        y = np.array([self.read(o.outputs) if self._has_value(o) else np.nan for o in outcomes])
        for row in rows:
            self._place[_address(row)] = len(self._place)
        self.z, self.y = np.vstack([self.z, z]), np.concatenate([self.y, y])

    def outcomes(self, rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        """The outcomes of design and scenario in one row each; no row is run twice, failures are kept."""
        new = {_address(row): row for row in rows if _address(row) not in self._known}
        made = self.evaluate([dict(row) for row in new.values()], purpose=purpose) if new else []
        for (address, row), outcome in zip(new.items(), made, strict=True):
            self._known[address] = outcome
            if not self._has_value(outcome):
                self.failed.append(
                    FailedRun(
                        design={name: row[name] for name in self.design.space.names},
                        scenario={name: row[name] for name in self.uncertain.space.names},
                        status="excluded" if outcome.status == "ok" else outcome.status,
                        error=outcome.error,
                    )
                )
        return [self._known[_address(row)] for row in rows]

    def _has_value(self, outcome: Outcome) -> bool:
        """Whether a run stands among the values: a reading such as `within` leaves out some that ended
        well, and a combination of responses may be too large where these are not."""
        return outcome.status == "ok" and is_value(self.read(outcome.outputs))

    @property
    def failure_map(self) -> tuple[LevelFailures, ...]:
        """Failures by level of the unordered parameters, those of an attack included."""
        outcomes = list(self._known.values())
        return failure_map(
            [outcome.parameters for outcome in outcomes],
            [not self._has_value(o) for o in outcomes],
            design=self.design.space,
            uncertainty=self.uncertain.space,
        )

    @property
    def made(self) -> int:
        """Runs that were made, those of an attack included."""
        return len(self._known)

    def _rows(self, z: Array) -> list[dict[str, Any]]:
        x_rows, u_rows = self.design.rows(z[:, : self.dx]), self.uncertain.rows(z[:, self.dx :])
        return [{**x, **u} for x, u in zip(x_rows, u_rows, strict=True)]

    def fill(self, count: int, region: Region, *, replicate: int) -> None:
        """Run `count` new space-filling points with x inside the region; fewer where no more are left or
        runs are likely to fail.

        Raises:
            StudyError: nothing was run yet and no point meets the constraints.
        """
        count = min(count, self.left)
        if count < 1:
            return
        rng = stream(self.seed, "minimax fill", replicate=replicate)
        low, high = self.design_box(region)
        kept = np.empty((0, self.dimension))
        for draw in range(DRAWS):
            drawn = doe.optimised_lhs(max(count, 2), self.dimension, criterion="phi_p", swaps=5000, rng=rng)
            drawn[:, : self.dx] = low + drawn[:, : self.dx] * (high - low)
            kept = np.vstack([kept, self._usable(self._snapped(drawn, region))])
            kept = kept[np.sort(np.unique(kept, axis=0, return_index=True)[1])]
            if len(kept) >= count or (self.has_failures and draw + 1 >= DRAWS_AFTER_FAILURES):
                break
        if not len(kept) and not len(self.y):
            raise StudyError("no point meets the constraints of design and uncertainty: loosen them")
        self.run(kept[:count], "minimax start" if replicate == 0 else "minimax fill")

    def _snapped(self, drawn: Array, region: Region) -> Array:
        """The drawn points on their levels; in a zoomed region every other keeps the centre's categories."""
        drawn = drawn.copy()
        flags = (*self.design.categorical, *self.uncertain.categorical)
        for j, (is_category, grid) in enumerate(
            zip(flags, (*self.design.levels, *self.uncertain.levels), strict=True)
        ):
            if is_category and grid is not None:
                # an equal share of every level; snapping would halve that of the first and the last
                drawn[:, j] = grid[np.minimum((drawn[:, j] * len(grid)).astype(int), len(grid) - 1)]
                if region.width < 1.0 and j < self.dx:
                    drawn[::2, j] = region.centre[j]
        return np.column_stack(
            [self.design.snap(drawn[:, : self.dx]), self.uncertain.snap(drawn[:, self.dx :])]
        )

    def _usable(self, z: Array) -> Array:
        """Those of z (m, dx + du) that are allowed, were not run yet and are not likely to fail."""
        fine = self.design.allowed(z[:, : self.dx]) & self.uncertain.allowed(z[:, self.dx :])
        z = z[fine]
        z = z[[_address(row) not in self._place for row in self._rows(z)]] if len(z) else z
        feasibility = self.feasibility()
        if feasibility is None or not len(z):
            return z
        return z[feasibility.probability(self.features(z)) >= LEAST_CHANCE]

    def feasibility(self) -> Feasibility | None:
        """Where runs fail, from all runs; None as long as none has."""
        if not self.has_failures:
            return None
        ok, n = np.isfinite(self.y), len(self.y)
        if self._feasibility is None or n >= RELEARN * self._learnt_at:
            self._feasibility = Feasibility.of(
                self.features(self.z), ok, seed=self.seed, least_weight=LEAST_WEIGHT
            )
            self._learnt_at = n
        elif len(self._feasibility.ok) < n:
            self._feasibility = replace(self._feasibility, features=self.features(self.z), ok=ok)
        return self._feasibility

    def at_design(self, x: Array) -> Array:
        """Which runs were made at the design x, (n,) of bool."""
        mine: Array = np.all(np.abs(self.z[:, : self.dx] - x) < SAME, axis=1)
        return mine

    def worst_run(self, x: Array) -> tuple[float, Array]:
        """The largest true value at the design x and its scenario; -inf when there is none."""
        mine = self.at_design(x) & np.isfinite(self.y)
        if not mine.any():
            return -np.inf, np.full(self.du, 0.5)
        top = np.flatnonzero(mine)[int(np.argmax(self.y[mine]))]
        return float(self.y[top]), self.z[top, self.dx :]

    def worst_design(self, x: Array) -> Array:
        """The design of that worst run itself, to the last bit: a neighbour within 1e-6 of it may fail."""
        mine = self.at_design(x) & np.isfinite(self.y)
        top = np.flatnonzero(mine)[int(np.argmax(self.y[mine]))]
        exact: Array = self.z[top, : self.dx]
        return exact

    def near(self, x: Array, u: Array) -> Array:
        """Runs at (x, u), or so near that another run would tell nothing, (n,) of bool."""
        mine: Array = self.at_design(x) & np.all(np.abs(self.z[:, self.dx :] - u) < 1e-4, axis=1)
        return mine

    def is_exhausted(self) -> bool:
        """Whether design and uncertainty have finitely many points and every allowed one was run."""
        return self._every is not None and len(self.y) >= self._every

    def design_box(self, region: Region) -> tuple[Array, Array]:
        """Lowest and highest design (dx,) of a region, moved inside the unit cube; categories keep all their
        levels, which have no order."""
        width = min(region.width, 1)
        low = np.clip(region.centre - region.width / 2, 0, 1 - width)
        high = low + width
        category = np.array(self.design.categorical, dtype=bool)
        return np.where(category, 0.0, low), np.where(category, 1.0, high)


def _address(row: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(row.values())
