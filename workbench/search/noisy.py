"""The worst case of a model with noise: the point of the largest mean, and the mean there of fresh runs.

    six tenths of the budget    points that fill the space, by turns with far corners, then where an
                                improvement of the mean is expected and where its upper bound is highest,
                                on a Kriging with a nugget
    two tenths                  repeats where they pay: at whichever of the points run so far, and of the
                                predicted worst, the upper bound of the mean is highest: incumbent and rivals
    two tenths                  runs at the point of the largest mean, made after it was chosen: what is
                                reported is their mean

The largest of many noisy runs is the luckiest. Here a run never counts for more than what the others make of
it, and the runs by which the point was chosen have no part in the mean that is stated.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from surrogates.analysis.success import SuccessChance
from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import RepeatingEvaluator
from workbench.search.arguments import Arguments
from workbench.search.proposals.best_point import best_point, start_pool
from workbench.search.proposals.known import Known
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger, Run, distinct
from workbench.search.runs.repeats import Mean, mean_of, run_again
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.start import begin, far_points, start_size
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.noisy import fit_noisy_model
from workbench.space.streams import stream

__all__ = ["FEWEST_FINAL", "NoisySearch", "disagreeing", "smoothed"]

FILLED, LOOKED = 0.35, 0.6  # of the budget: spent when the space is filled, when the search is over
LEAST_FILLED = 0.15  # of the budget beyond the start design, which is large with many inputs
FINAL = 0.2  # of the budget: runs at the point that is reported
FEWEST_FINAL, MOST_FINAL = 4, 30
CORNERS = 2000  # random ones that a far corner is chosen from, where there are too many
LEAN = 1.0  # deviations above the mean by which repeats are placed


@dataclass(slots=True, kw_only=True)
class NoisySearch:
    """A search among noisy runs, after the start design or after those of a search that found the noise."""

    evaluate: RepeatingEvaluator
    ledger: Ledger
    asked: Arguments
    model: SearchModel | None = None

    def run(self) -> tuple[Mean, Run]:
        """Spend the budget; the mean at the point chosen, in the sign of the ledger, and its first run.

        Raises:
            StudyError: the budget is below the start design and a few runs at the point chosen.
            NotEnoughRuns: too few runs gave a value, at the start or at the point chosen.
        """
        ledger, budget = self.ledger, self.asked.budget
        needed = start_size(ledger) + FEWEST_FINAL
        if ledger.spent + needed > budget:
            raise StudyError(
                f"budget={budget} is below the {needed} runs that a search among noise needs: the start "
                f"design and {FEWEST_FINAL} at the point it reports. Raise the budget to at least {needed}"
            )
        if not ledger.spent:
            begin(self.evaluate, ledger, budget=budget, seed=self.asked.seed, workers=self.asked.workers)
        ledger.require_values(FEWEST_RUNS)
        final = min(max(round(FINAL * budget), FEWEST_FINAL), MOST_FINAL, budget - ledger.spent)
        filled = int(max(FILLED * budget, ledger.spent + LEAST_FILLED * budget))
        self._fill(min(filled, budget - final))
        while ledger.spent < min(int(LOOKED * budget), budget - final):
            self._look(most=min(int(LOOKED * budget), budget - final) - ledger.spent)
        while ledger.spent < budget - final:
            known = self._learnt()
            points = self._points(known)
            self._run(points[[int(np.argmax(self._bound(known, points, LEAN)))]], "rival")
        known = self._learnt()
        points = self._points(known)
        chosen = points[int(np.argmax(self._bound(known, points, 0.0)))]
        first = len(ledger.runs)
        for _ in range(budget - ledger.spent):
            self._run(chosen[None], "repeat")
        self._learnt()
        made = [run for run in ledger.runs[first:] if run.value is not None]
        if len(made) < 2:
            raise NotEnoughRuns(
                f"{len(made)} of {len(ledger.runs) - first} runs at the point of the largest mean gave a "
                "value and 2 are needed for its interval. Raise the budget, or narrow the space to where "
                "runs succeed"
            )
        return mean_of([ledger.sign * run.value for run in made if run.value is not None]), made[0]

    def _fill(self, until: int) -> None:
        ledger = self.ledger
        while ledger.spent < until:
            rng = stream(self.asked.seed, "worst case fill", replicate=ledger.spent)
            size = min(self.asked.workers, until - ledger.spent)
            far = np.empty((0, ledger.where.dimension))
            if ledger.spent % 2:
                far = far_corners(ledger.where, ledger.u, size=size, rng=rng)
            if not len(far):
                far = far_points(ledger.where, ledger.u, size=size, rng=rng)
            if not len(far):
                return
            self.ledger.run(self.evaluate, far, purpose="fill")

    def _learnt(self) -> Known:
        """A Kriging of all runs, what it makes of each of them, and where runs fail."""
        ledger = self.ledger
        features = ledger.where.features(ledger.u_ok)
        self.model = fit_noisy_model(features, ledger.v, previous=self.model, seed=self.asked.seed)
        success = SuccessChance.of(ledger.where.features(ledger.u), ledger.ok)
        return Known.of(smoothed(ledger, self.model), self.model, success)

    def _look(self, *, most: int) -> None:
        """One batch of new points, by turns of expected improvement and of the highest upper bound."""
        known = self._learnt()
        rng = stream(self.asked.seed, "worst case", replicate=self.ledger.spent)
        pool = start_pool(known.where, known.incumbent, rng)
        points: list[np.ndarray] = []
        names: list[str] = []
        for i in range(min(self.asked.workers, most)):
            name = ("ei", "ucb")[(self.ledger.spent + i) % 2]
            point = best_point(name, known, pool)
            if point is None:
                break
            points.append(point)
            names.append(name)
            known = known.believing(point)
        if not points:  # a finite space of which every point was run
            every = self._points(known)
            self._run(every[[int(np.argmax(self._bound(known, every, LEAN)))]], "rival")
            return
        u = np.stack(points)
        outcomes = self.evaluate(self.ledger.where.rows(u), purpose=names[0])
        assert self.model is not None
        mean, std = self.model.in_units(self.ledger.where.features(u))
        self.ledger.add(outcomes, u, proposals=names, predicted=self.ledger.sign * mean, std=std)

    def _points(self, known: Known) -> np.ndarray:
        """Points (m, d) that may be the worst: those that gave a value, and the predicted worst."""
        rng = stream(self.asked.seed, "worst case", replicate=self.ledger.spent)
        none = np.empty((0, known.where.dimension))
        pool = start_pool(known.where, known.incumbent, rng)
        predicted = best_point("predicted", replace(known, u=none), pool)
        run = known.u_ok if predicted is None else np.vstack([predicted[None], known.u_ok])
        return run[np.sort(np.unique(run, axis=0, return_index=True)[1])]

    def _bound(self, known: Known, points: np.ndarray, lean: float) -> np.ndarray:
        return known.model.transformed_bound(known.where.features(points), lean)

    def _run(self, u: np.ndarray, purpose: str) -> None:
        """Run a point (1, d), anew where it was run before."""
        assert self.model is not None
        before = sum(not len(distinct(u, other[None])) for other in self.ledger.u)
        outcomes = run_again(self.evaluate, self.ledger, u, times=before, purpose=purpose)
        mean, std = self.model.in_units(self.ledger.where.features(u))
        self.ledger.add(outcomes, u, proposals=[purpose], predicted=self.ledger.sign * mean, std=std)


def far_corners(where: SearchSpace, u: np.ndarray, *, size: int, rng: np.random.Generator) -> np.ndarray:
    """Up to `size` corners (m, d) not run yet, each as far as possible from the points u (n, d)."""
    every = where.corners()
    if every is None:
        drawn = np.where(rng.random((CORNERS, where.dimension)) < 0.5, 0.0, 1.0)
        every = np.unique(where.snap(drawn), axis=0)
    corners = distinct(every[where.allowed(every)], u)
    corners = corners[rng.permutation(len(corners))]
    chosen: list[np.ndarray] = []
    for _ in range(min(size, len(corners))):
        nearest = cdist(corners, np.vstack([u, *chosen]), "sqeuclidean").min(axis=1)
        chosen.append(corners[int(np.argmax(nearest))])
    return np.array(chosen).reshape(len(chosen), where.dimension)


def smoothed(ledger: Ledger, model: SearchModel) -> Ledger:
    """The ledger with the mean that the model predicts at every run in place of its value."""
    mean = iter(ledger.sign * model.mean(ledger.where.features(ledger.u_ok)))
    runs = [run if run.value is None else replace(run, value=float(next(mean))) for run in ledger.runs]
    return replace(ledger, runs=runs, slopes={}, progress=None)


def disagreeing(ledger: Ledger) -> bool:
    """Whether two runs at one point gave different values."""
    seen: dict[tuple[float, ...], float] = {}
    for point, value in zip(np.round(ledger.u_ok, 9), ledger.v, strict=True):
        known = seen.setdefault(tuple(point), float(value))
        if abs(known - value) > 1e-12 * max(abs(known), abs(value)):
            return True
    return False
