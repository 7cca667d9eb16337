"""The steps of a minimax search: start design, cycles of master and oracle, zoom, the best design."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from workbench.errors import NotEnoughRuns
from workbench.robust.joint_prediction import fit_near
from workbench.robust.joint_runs import JointRuns, Region
from workbench.robust.master import robust_design
from workbench.robust.minimax_record import (
    ALLOWED_ERROR,
    Cycle,
    Minimax,
    MinimaxStatus,
    failure_counts,
)
from workbench.robust.worst_scenario import (
    SETTLED,
    Unmodelled,
    challenge,
    confirm,
    expected_worst,
    modelling,
)

__all__ = ["CuttingSets"]

Array = np.ndarray

START_PER_DIMENSION = 8  # a category of m levels counts as m - 1
START_REPEATS = 5
START_STREAM = 1_000_003  # replicates of the start, apart from the numbers of the cycles
FEWEST_RUNS = 3
RUNS_TO_ZOOM = 2  # new runs per coordinate in a zoomed box
SMALLEST_BOX = 2e-3
EDGE = 1e-3  # of the region's width: a design that near to its end lies at it
QUIET_CYCLES = 2
RE_EXAMINED = 4
RE_EXPECTED = 12
FAILURES_BEFORE_FILL = 3  # proposed designs without a value in a row
IDLE_CYCLES = 6  # cycles without a new run before the search stops
BOUND_STREAM = 2_000_003  # replicate of the last master, apart from the numbers of the cycles


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bounds:
    """A cycle's design x (dx,) with the master's value `lower` and its worst run `upper`; the best design
    tried so far with its worst run; by how much bounds may differ that have met, and whether they have.
    """

    x: Array
    lower: float
    upper: float
    best_x: Array
    best: float
    threshold: float
    met: bool

    @property
    def is_confirmed(self) -> bool:
        """Whether a run at x gave a value."""
        return bool(np.isfinite(self.upper))


class CuttingSets:
    """A minimax search over its runs: designs tried, cycles made, and the region that it looks at."""

    def __init__(self, runs: JointRuns) -> None:
        self.runs = runs
        self.tried: list[Array] = []  # designs run in their predicted worst scenario
        self.proposed: list[Array] = []
        self.cycles: list[Cycle] = []
        self.whole = Region(centre=np.full(runs.dx, 0.5), width=1.0)
        self.region = self.looked_at = self.whole  # of the next cycle, of the last one
        self.looks_everywhere = True  # whether the present cycles look at the whole design space
        self.quiet = 0  # cycles in a row whose bounds met
        self.unconfirmed = 0  # proposed designs in a row without a value

    def solve(self, *, tolerance: float, progress: Callable[[Cycle], None] | None) -> Minimax:
        """Search and report."""
        runs = self.runs
        self.start()
        note = ""
        try:
            status = self.search(tolerance=tolerance, progress=progress)
            value, x, scenario = self.lowest()
            if status is not MinimaxStatus.EXHAUSTED:
                value, x, scenario = self.best_confirmed(len(self.cycles) + 1)
                if runs.has_failures:
                    value, x, scenario = self.best_expected(len(self.cycles) + 2)
        except Unmodelled as exc:
            status, note = MinimaxStatus.UNMODELLED, str(exc)
            self.tried += [x for x in self.proposed[-1:] if np.isfinite(runs.worst_run(x)[0])]
            value, x, scenario = self.lowest()
        predicted = lower = min(self.last_lower, value)
        if status is MinimaxStatus.EXHAUSTED:
            predicted = lower = value
        elif status is not MinimaxStatus.UNMODELLED and self.tried:
            lower = min(lower, self.doubted_lower())
        if not self.tried:
            if note:
                raise NotEnoughRuns(
                    f"no design could be confirmed: no Kriging could be fitted to {self.n_ok} runs ({note}); "
                    "mend the model, or rescale its response. An evaluator that you pass keeps the runs"
                )
            raise NotEnoughRuns(
                f"no design could be confirmed: every run at a proposed design failed, {len(runs.failed)} of "
                f"{len(runs.y)} runs in all ({failure_counts(runs.failed)}); mend the model or narrow the "
                "spaces"
            )
        return Minimax(
            design=runs.design.rows(runs.worst_design(x)[None])[0],
            scenario=runs.uncertain.rows(scenario[None])[0],
            value=value,
            lower=lower,
            predicted=predicted,
            part=self.part,
            status=status,
            cycles=tuple(self.cycles),
            scenarios=tuple(runs.uncertain.rows(np.array(runs.scenarios))) if runs.scenarios else (),
            evaluations=len(runs.y),
            budget=runs.budget,
            seed=runs.seed,
            failed=tuple(runs.failed),
            failure_map=runs.failure_map,
            note=note,
        )

    @property
    def last_lower(self) -> float:
        """The master's value of the last cycle."""
        return self.cycles[-1].lower if self.cycles else -np.inf

    @property
    def part(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest design of the last cycle's region, of the parameters that have an order."""
        design = self.runs.design
        low, high = (design.rows(end[None])[0] for end in self.runs.design_box(self.looked_at))
        ordered = [n for n, word in zip(design.space.names, design.categorical, strict=True) if not word]
        return {name: (low[name], high[name]) for name in ordered}

    def doubted_lower(self) -> float:
        """The master's value in the region that the last cycle looked at, where the Kriging of all runs errs
        by ALLOWED_ERROR standard deviations in favour of every design; inf where it cannot be fitted."""
        try:
            with modelling():
                model = replace(fit_near(self.runs, self.looked_at), doubt=ALLOWED_ERROR)
                return robust_design(self.runs, model, self.looked_at, BOUND_STREAM)[1]
        except Unmodelled:
            return np.inf

    @property
    def n_ok(self) -> int:
        """Runs that gave a value."""
        return int(np.isfinite(self.runs.y).sum())

    def start(self) -> None:
        """Run the start design, and more where many of its runs fail, within half the budget."""
        runs = self.runs
        start = min(START_PER_DIMENSION * runs.free_features, max(runs.budget // 3, 2 * runs.dimension))
        wanted = max(FEWEST_RUNS, start // 2)
        runs.fill(start, self.whole, replicate=0)
        for repeat in range(START_REPEATS):
            allowance = runs.budget // 2 - len(runs.y)
            if self.n_ok >= wanted or not self.n_ok or allowance < 1:
                break
            more = min(wanted - self.n_ok, allowance)
            runs.fill(more, self.whole, replicate=START_STREAM + repeat)
        if self.n_ok < FEWEST_RUNS and not (self.n_ok and runs.is_exhausted()):
            raise NotEnoughRuns(
                f"{self.n_ok} of {len(runs.y)} runs of the start design gave a value and {FEWEST_RUNS} are "
                f"needed ({failure_counts(runs.failed)}); mend the model or narrow the spaces"
            )

    def search(self, *, tolerance: float, progress: Callable[[Cycle], None] | None) -> MinimaxStatus:
        """Cycles until the bounds meet or nothing is left to run; why it stopped."""
        runs, idle = self.runs, 0
        while not runs.is_exhausted():
            if runs.left < 1:
                return MinimaxStatus.BUDGET
            before = len(runs.y)
            bounds = self._cycle(tolerance)
            if progress is not None:
                progress(self.cycles[-1])
            self.quiet = self.quiet + 1 if bounds.met else 0
            if self.quiet >= QUIET_CYCLES:
                if self.looks_everywhere:
                    return MinimaxStatus.CONVERGED
                # the region has converged: look once more at the whole design space before believing it
                self.region, self.looks_everywhere = replace(self.whole, centre=bounds.best_x), True
                self.quiet = QUIET_CYCLES - 1
                continue
            self._zoom(bounds)
            self.looks_everywhere = self.region.width >= 1.0
            self.unconfirmed = 0 if bounds.is_confirmed else self.unconfirmed + 1
            # a design that cannot be run says where not to look: the master looks again at once
            if not bounds.met and self.unconfirmed % FAILURES_BEFORE_FILL == 0:
                runs.fill(RUNS_TO_ZOOM * runs.dimension, self.region, replicate=len(self.cycles))
            idle = idle + 1 if len(runs.y) == before else 0
            if idle >= IDLE_CYCLES:
                return MinimaxStatus.SETTLED
        self.tried = list(np.unique(runs.z[np.isfinite(runs.y), : runs.dx], axis=0))
        return MinimaxStatus.EXHAUSTED

    def _cycle(self, tolerance: float) -> _Bounds:
        """One cycle: the master's design, its true worst, and the best design tried so far."""
        runs, region = self.runs, self.region
        self.looked_at = region
        number = len(self.cycles) + 1
        with modelling():
            model = fit_near(runs, region)
            x, lower = robust_design(runs, model, region, number)
        x = runs.design.snap(x[None])[0]
        self.proposed.append(x)
        upper = confirm(runs, model, x, region, number)
        if np.isfinite(upper):
            self.tried.append(x)
        best, best_x, best_u = self.best_confirmed(number)
        self.cycles.append(
            Cycle(
                number=number,
                evaluations=len(runs.y),
                lower=lower,
                upper=upper,
                best=best,
                box=region.width,
                design=runs.design.rows(best_x[None])[0],
                scenario=runs.uncertain.rows(best_u[None])[0],
            )
        )
        threshold = runs.threshold(best, tolerance) if self.tried else 0.0
        met = best - lower <= threshold and abs(upper - lower) <= threshold
        if runs.has_failures:  # a design whose worst scenarios failed so far may look too good
            met = met and lower - best <= threshold
        return _Bounds(x=x, lower=lower, upper=upper, best_x=best_x, best=best, threshold=threshold, met=met)

    def _zoom(self, bounds: _Bounds) -> None:
        """Move the region to the better design; half as wide where it holds, twice at its edge."""
        centre, width = self.region.centre, self.region.width
        if bounds.is_confirmed:
            low, high = self.runs.design_box(self.region)
            x, near = bounds.x, EDGE * width
            at_edge = np.any(((x - low < near) & (low > 0)) | ((high - x < near) & (high < 1)))
            moved = float(np.abs(x - centre).max())
            centre = bounds.best_x if bounds.upper > bounds.best + bounds.threshold else x
            if at_edge:
                width = min(1.0, 2 * width)
            elif moved < width / 4 or abs(bounds.upper - bounds.lower) > bounds.threshold:
                width = max(width / 2, SMALLEST_BOX)
        elif self.tried:
            centre = bounds.best_x  # nothing was learnt about the values at x: the region stays as wide
        self.region = Region(centre=centre, width=width)

    def best_confirmed(self, number: int) -> tuple[float, Array, Array]:
        """The tried design of the lowest worst run, re-examined with what was learnt since it was tried."""
        for round_ in range(RE_EXAMINED if self.tried and self.runs.left > 0 else 0):
            before, x, _ = self.lowest()
            here = replace(self.region, centre=x)
            with modelling():
                model = fit_near(self.runs, here)
            confirm(self.runs, model, x, here, 104_729 * number + round_)
            challenge(self.runs, model, here, 104_729 * number + round_)
            if self.runs.worst_run(x)[0] <= before + SETTLED * (1 + abs(before)):
                break
        return self.lowest()

    def lowest(self) -> tuple[float, Array, Array]:
        """The tried design of the lowest worst run; inf at the middle of the space while there is none."""
        if not self.tried:
            return np.inf, np.full(self.runs.dx, 0.5), np.full(self.runs.du, 0.5)
        x = self.tried[int(np.argmin([self.runs.worst_run(t)[0] for t in self.tried]))]
        worst, u = self.runs.worst_run(x)
        return worst, x, u

    def best_expected(self, number: int) -> tuple[float, Array, Array]:
        """The tried design of the lowest expected worst: where worse scenarios failed or the budget ended
        first, the worst run of a design may be far from its worst."""
        order = np.argsort([self.runs.worst_run(x)[0] for x in self.tried], kind="stable")
        if not len(order):
            return self.lowest()
        best, lowest = self.tried[order[0]], np.inf
        for i in order[:RE_EXPECTED]:
            x = self.tried[i]
            if self.runs.worst_run(x)[0] >= lowest:
                break
            here = replace(self.region, centre=x)
            expected = expected_worst(self.runs, here, 104_729 * number + int(i))
            if expected < lowest:
                best, lowest = x, expected
        value, u = self.runs.worst_run(best)
        return value, best, u
