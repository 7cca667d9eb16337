"""The true runs of a minimax search: points z = (x, u) of design and uncertainty, and their values."""

from dataclasses import dataclass, field

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.evaluator import Evaluator, Reading
from workbench.search_space import SearchSpace
from workbench.streams import stream

__all__ = ["JointRuns", "design_box"]

Array = np.ndarray

SAME = 1e-6  # of the unit cube: closer points are one point


@dataclass(slots=True, kw_only=True)
class JointRuns:
    """Runs so far within a budget; `y` is NaN where one failed. x (dx,) and u (du,) in their unit cubes."""

    design: SearchSpace
    uncertain: SearchSpace
    evaluate: Evaluator
    read: Reading
    budget: int
    seed: int
    scenarios: list[Array] = field(default_factory=list)  # accumulated: given ones, and those run at a design
    z: Array = field(init=False)
    y: Array = field(init=False)

    def __post_init__(self) -> None:
        self.z, self.y = np.empty((0, self.dimension)), np.empty(0)

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
    def left(self) -> int:
        """Runs that the budget still allows."""
        return self.budget - len(self.y)

    @property
    def spread(self) -> float:
        """Interquartile range of the values seen."""
        values = self.y[np.isfinite(self.y)]
        return float(np.subtract(*np.quantile(values, [0.75, 0.25])))

    def run(self, z: Array, purpose: str) -> Array:
        """True values at z (m, dx + du), NaN where failed; at most as many as the budget allows."""
        z = np.array(z[: max(self.left, 0)], ndmin=2).reshape(-1, self.dimension)
        if not len(z):
            return np.empty(0)
        x_rows, u_rows = self.design.rows(z[:, : self.dx]), self.uncertain.rows(z[:, self.dx :])
        rows = [{**x, **u} for x, u in zip(x_rows, u_rows, strict=True)]
        outcomes = self.evaluate(rows, purpose=purpose)
        y = np.array([self.read(o.outputs) if o.status == "ok" else np.nan for o in outcomes])
        self.z, self.y = np.vstack([self.z, z]), np.concatenate([self.y, y])
        return y

    def fill(self, count: int, *, centre: Array, box: float, replicate: int) -> None:
        """Run `count` space-filling points with x inside the box of width `box` around `centre`."""
        count = min(count, self.left)
        if count < 1:
            return
        rng = stream(self.seed, "minimax fill", replicate=replicate)
        kept = np.empty((0, self.dimension))
        for _ in range(50):
            drawn = doe.optimised_lhs(max(count, 2), self.dimension, criterion="phi_p", swaps=5000, rng=rng)
            low, high = design_box(centre, box)
            drawn[:, : self.dx] = low + drawn[:, : self.dx] * (high - low)
            drawn = np.column_stack(
                [self.design.snap(drawn[:, : self.dx]), self.uncertain.snap(drawn[:, self.dx :])]
            )
            fine = self.design.allowed(drawn[:, : self.dx]) & self.uncertain.allowed(drawn[:, self.dx :])
            kept = np.vstack([kept, drawn[fine]])
            if len(kept) >= count:
                break
        if not len(kept):
            raise StudyError("no point meets the constraints of design and uncertainty: loosen them")
        self.run(kept[:count], "minimax start" if replicate == 0 else "minimax fill")

    def worst_run(self, x: Array) -> tuple[float, Array]:
        """The largest true value at the design x and its scenario; -inf when there is none."""
        mine = np.all(np.abs(self.z[:, : self.dx] - x) < SAME, axis=1) & np.isfinite(self.y)
        if not mine.any():
            return -np.inf, np.full(self.du, 0.5)
        top = np.flatnonzero(mine)[int(np.argmax(self.y[mine]))]
        return float(self.y[top]), self.z[top, self.dx :]

    def is_run(self, x: Array, u: Array) -> bool:
        """Whether f was run at (x, u), or so near that another run would tell nothing."""
        here = np.all(np.abs(self.z[:, : self.dx] - x) < SAME, axis=1)
        return bool((here & np.all(np.abs(self.z[:, self.dx :] - u) < 1e-4, axis=1)).any())


def design_box(centre: Array, box: float) -> tuple[Array, Array]:
    """Corners of the box of width `box` around the centre (dx,), moved inside the unit cube."""
    low = np.clip(centre - box / 2, 0, 1 - min(box, 1))
    return low, low + min(box, 1)
