"""The loop of a worst-case search: a Kriging of all runs, a look at the gap, and a batch of new runs."""

from dataclasses import dataclass, field

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.models.evaluator import RepeatingEvaluator
from workbench.search.arguments import Arguments
from workbench.search.evidence.border import has_failed
from workbench.search.evidence.gap import modelled_gap
from workbench.search.evidence.gap_history import GapHistory
from workbench.search.noisy import FEWEST_FINAL
from workbench.search.proposals.border_walk import BORDER, BorderWalk
from workbench.search.proposals.corners import FINISHING_RUNS, CornerPlan
from workbench.search.proposals.gradient_ascent import ascend, runs_kept_back
from workbench.search.proposals.known import Known, failed_share
from workbench.search.proposals.portfolio import propose
from workbench.search.proposals.turns import Turn
from workbench.search.record import Status
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger, distinct
from workbench.search.runs.repeats import run_again
from workbench.search.second_look import LOOK, SecondLook
from workbench.search.start import begin, far_points
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.growing_failures import GrowingFailures, growth_of
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.noisy import SLIGHT, looks_noisy
from workbench.space.streams import stream

__all__ = ["Loop"]

QUIET_BATCHES = 3  # batches in a row with a gap below the tolerance before the search stops
FLAT_RUNS = 10  # per parameter, all of one value, before a response counts as constant
SAME = 1e-12  # relative: values that differ by rounding only
MOST_COUNTED, REDRAWN = 100, 20  # runs that count failures, and points drawn for each
LATE = 0.5  # of the budget: from then on, or when the search has settled, slight noise is asked for
STALLED_RUNS = 6  # without a gain, or one per parameter where there are more


@dataclass(slots=True, kw_only=True)
class Loop:
    """A running search: `begun` runs went into its start design, after `searched` the gradients take over.

    `quiet`: how many batches in a row met a gap below the tolerance. `is_noisy`: a run made again gave
    another value, which ends the loop; `is_suspected`: whether a Kriging so far took some of the scatter for
    noise; `is_checked`: whether that was asked.
    """

    evaluate: RepeatingEvaluator
    ledger: Ledger
    asked: Arguments
    begun: int
    searched: int
    corners: CornerPlan
    look: SecondLook
    gaps: GapHistory = field(default_factory=GapHistory)
    model: SearchModel | None = None
    quiet: int = 0
    is_noisy: bool = False
    is_suspected: bool = False
    is_checked: bool = False

    @classmethod
    def started(cls, evaluate: RepeatingEvaluator, ledger: Ledger, asked: Arguments) -> "Loop":
        """The loop after its start design.

        Raises:
            StudyError: the budget is below the start design.
            NotEnoughRuns: too few of its runs gave a value.
        """
        begun = begin(evaluate, ledger, budget=asked.budget, seed=asked.seed, workers=asked.workers)
        ledger.require_values(1 if ledger.is_exhausted else FEWEST_RUNS)
        searched = asked.budget - runs_kept_back(ledger, asked.budget)
        return cls(
            evaluate=evaluate,
            ledger=ledger,
            asked=asked,
            begun=begun,
            searched=searched,
            corners=CornerPlan.of(ledger, budget=searched - begun),
            look=SecondLook(seed=asked.seed),
        )

    def run(self) -> Status:
        """Batches until the gap stays closed or the runs are spent, then the gradients; says why it ended."""
        ledger, ended = self.ledger, None
        while ended is None and ledger.spent < self.searched and not ledger.is_exhausted:
            ended = self._batch()
        if self.is_noisy or ended is Status.FAILED:
            return ended or Status.BUDGET
        if ledger.slopes and not ledger.is_exhausted:
            ascend(self.evaluate, ledger, budget=self.asked.budget)
        if ledger.is_exhausted:
            return Status.EXHAUSTED
        if ledger.is_flat:
            return Status.CONSTANT
        if self.is_settled:
            return Status.CONVERGED  # also where corners without a gain took the rest of the budget
        return ended or Status.BUDGET

    @property
    def is_settled(self) -> bool:
        """Whether the gap has stayed below the tolerance for long enough."""
        return self.quiet > QUIET_BATCHES

    def _batch(self) -> Status | None:
        """One batch of runs; why the search ends here, None when it goes on."""
        ledger, workers = self.ledger, self.asked.workers
        known = self._learnt()
        if self.asked.failures == "worst" and any(has_failed(run) for run in ledger.runs):
            self._count_failures()
            return Status.FAILED
        if self._is_found_noisy():
            return Status.BUDGET
        left = self.searched - ledger.spent
        if left <= 0:
            return None
        room = self.corners.room(ledger, runs=left)
        if (self.is_settled or room <= 0) and self._run_corners(most=left):
            return None
        if self._look_elsewhere(known, most=room if room > 0 else left):
            return None
        is_short = ledger.is_flat and len(ledger.v) < FLAT_RUNS * ledger.where.dimension
        if self.is_settled and not is_short:
            return Status.CONVERGED
        rng = stream(self.asked.seed, "worst case", replicate=ledger.spent)
        size = min(workers, room if room > 0 else left)
        batch = propose(known, self._turn(left), size=size, rng=rng, border=self._border(known, left))
        if len(batch.u):
            ledger.add(
                self.evaluate(ledger.where.rows(batch.u), purpose=batch.proposals[0]),
                batch.u,
                proposals=batch.proposals,
                predicted=ledger.sign * batch.predicted,
                std=batch.std,
            )
            return None
        # no proposal is left, which says nothing of the gap: fill the space
        rng = stream(self.asked.seed, "worst case fill", replicate=ledger.spent)
        far = far_points(ledger.where, ledger.u, size=min(workers, left), rng=rng)
        if not len(far):
            return Status.NO_POINT
        ledger.run(self.evaluate, far, purpose="fill")
        return None

    def _learnt(self) -> Known:
        """What all runs say: a Kriging, where runs fail, and how wide the gap still is."""
        ledger, seed = self.ledger, self.asked.seed
        features = ledger.where.features(ledger.u_ok)
        self.model = fit_search_model(
            features, ledger.v, previous=self.model, seed=seed, scale=self.asked.transform, sign=ledger.sign
        )
        ok = ledger.ok if self.asked.failures == "avoid" else np.ones(len(ledger.runs), dtype=bool)
        success = SuccessChance.of(ledger.where.features(ledger.u), ok)
        # the full bound is sought only when a cheap look at it suggests that the search is over
        full = self.quiet >= QUIET_BATCHES
        gap = modelled_gap(ledger, self.model, success, seed=seed, full=full)
        self.gaps.note(gap, ledger, full=full)
        self.quiet = self.quiet + 1 if gap.width <= self.asked.tolerance * ledger.scale else 0
        if not self.quiet and not full:
            self.look.begin_anew()  # the full bound alone may stay open for long, whatever the look has met
        return Known.of(ledger, self.model, success)

    def _border(self, known: Known, left: int) -> BorderWalk | None:
        """The border of failures to search along with `left` runs to go, None where no run failed or failures
        are sought.
        """
        ledger = self.ledger
        if not known.success.classifiers:
            return None
        features = ledger.where.features(ledger.u)
        grows = growth_of(lambda at: known.model.predict(at)[0], features[ledger.ok])
        failures = GrowingFailures.of(features, ledger.ok, grows)
        return BorderWalk(
            failures=failures,
            lost=ledger.u[~ledger.ok],
            failed=failed_share(ledger),
            made=sum(run.proposal == BORDER for run in ledger.runs),
            left=left,
        )

    def _count_failures(self) -> None:
        """An even sample of the box, of the runs that are left: how often runs fail remains to be said."""
        ledger, left = self.ledger, min(self.searched - self.ledger.spent, MOST_COUNTED)
        rng = stream(self.asked.seed, "worst case failures")
        drawn = ledger.where.snap(rng.random((REDRAWN * MOST_COUNTED, ledger.where.dimension)))
        points = distinct(drawn[ledger.where.allowed(drawn)], ledger.u)[:left]
        for batch in range(0, len(points), self.asked.workers):
            ledger.run(self.evaluate, points[batch : batch + self.asked.workers], purpose="even")

    def _is_found_noisy(self) -> bool:
        """Whether the worst run gives another value when it is made again.

        Asked once, when the Kriging takes a good part of the scatter for noise and explains the rest, or late
        in the search when it took a little, at the cost of one run of the budget. A run that agrees to the
        tolerance teaches nothing and stays out of the ledger.
        """
        model, ledger = self.model, self.ledger
        if self.asked.noise is not None or self.is_checked or model is None:
            return False
        self.is_suspected |= looks_noisy(model, SLIGHT)
        is_late = self.is_settled or ledger.spent >= LATE * self.asked.budget
        left = self.asked.budget - ledger.spent - 1  # after the run that asks
        if left < FEWEST_FINAL or not (looks_noisy(model) or (self.is_suspected and is_late)):
            return False
        self.is_checked = True
        self.searched -= 1
        (again,) = run_again(self.evaluate, ledger, ledger.incumbent[None], times=1, purpose="repeat")
        run = ledger.run_of(again, number=ledger.spent + 1, proposal="repeat")
        best = float(ledger.v.max())
        same = max(SAME * abs(best), self.asked.tolerance * ledger.scale)
        if run.value is None or abs(ledger.sign * run.value - best) <= same:
            return False
        ledger.add([again], ledger.incumbent[None], proposals=["repeat"])
        self.is_noisy = True
        return True

    def _turn(self, left: int) -> Turn:
        """Whose turn it is with `left` runs to go."""
        since = self.ledger.since_improvement
        return Turn(
            number=self.ledger.spent - self.begun,
            stalled=since > max(self.ledger.where.dimension, STALLED_RUNS),
            finishing=left <= FINISHING_RUNS and since > FINISHING_RUNS,
        )

    def _look_elsewhere(self, known: Known, *, most: int) -> bool:
        """Run what a second look asks for once the quick gap has stayed closed; a worse run begins anew."""
        ledger = self.ledger
        if self.quiet < QUIET_BATCHES or ledger.is_flat:
            return False
        points = self.look.due(known, left=most, workers=self.asked.workers)
        if not len(points):
            return False
        mean, std = known.model.in_units(ledger.where.features(points))
        best = float(np.max(ledger.v))
        ledger.run(self.evaluate, points, purpose=LOOK, predicted=ledger.sign * mean, std=std)
        is_worse = float(np.max(ledger.v)) > best
        self.look.made(len(points), is_worse=is_worse)
        if is_worse:
            self.quiet = 0
        return True

    def _run_corners(self, *, most: int) -> bool:
        """Run the corners that are due; a corner that is worse than all before begins the search anew."""
        unrun = self.corners.due(self.ledger, most=most)
        if not len(unrun):
            return False
        best = float(np.max(self.ledger.v))
        self.ledger.run(self.evaluate, unrun, purpose="corner")
        if float(np.max(self.ledger.v)) > best:
            self.quiet = 0
        return True
