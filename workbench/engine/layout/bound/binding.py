"""Min-max over many scenarios by those few that bind, a working set that grows.

    A <- scenarios that are worst at the start
    repeat   some steps of the trust region for  min max over A
             run all scenarios at the design that came of it; the worst one above the bound of A joins A
    until    none lies above it and the search over A has ended

A run of few scenarios is cheap, and its model has few rows: a step goes as far as those scenarios allow, and
the others are asked what they say of its end, not of every step on the way. That is why it ends in better
local optima than a search with all rows from the same start, not only sooner (decision 0196). Every design
that all scenarios have seen is kept, and the best of them is the result. Where the same scenarios bind
throughout it is the search over these alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import Recorder
from .probing import values_alone
from .trust_region import TrustRegionRun

__all__ = ["CHECK", "FEWEST", "BindingRun", "ByScenario", "binding_scenarios", "is_by_scenario"]

Array = NDArray[np.float64]

_BLOCK = 6  # steps before all scenarios are looked at again
_ABOVE = 1e-3  # of the bound: what a scenario has to rise above it to join a search that goes on
_AT_ONCE = 1e-2  # of the largest value: scenarios this close below it are in the set from the start
CHECK = 0.4  # of an evaluation: runs of all scenarios whose slopes nobody asks for
_FALL = 2.0  # what a bound may still fall, in what it fell in the second half of a block
_RADIUS = 0.3  # of the trust region at the beginning of every block, at least
FEWEST = 11  # scenarios, as few as it was measured with


@runtime_checkable
class ByScenario(Protocol):
    """An objective that can be evaluated in some of its scenarios."""

    def __call__(self, design: Array, /) -> Evaluation:
        """All scenarios."""

    def of_scenarios(self, chosen: Sequence[int]) -> Callable[[Array], Evaluation]:
        """The objective of these scenarios alone, in this order."""


def is_by_scenario(problem: LayoutProblem, first: Evaluation) -> bool:
    """Whether a search by binding scenarios can be made: several histories, and each can be run alone."""
    scenarios, nodes = np.atleast_2d(first.values).shape
    return isinstance(problem.evaluate, ByScenario) and scenarios >= FEWEST and nodes > 1


@dataclass(slots=True, kw_only=True)
class BindingRun:
    """One search by binding scenarios; `block` goes on where it stopped.

    values: (scenarios, nodes) at its first density, which the caller has recorded.
    most: evaluations of the recorder, a run of k of n scenarios with slopes counted k/n.
    index: of the start, for the history.
    Read: density; value and best, the least largest row of all scenarios and its design; bound, the largest
    row of those in the set; hoped, the bound less what it may still fall; finished, and ended where that
    was by itself.
    """

    problem: LayoutProblem
    recorder: Recorder
    density: Array
    values: Array
    tolerance: float
    most: int
    index: int = 0
    value: float = field(init=False)
    best: Array = field(init=False)
    bound: float = np.inf
    hoped: float = -np.inf
    finished: bool = False
    ended: bool = False
    _working: list[int] = field(init=False)
    _run: TrustRegionRun | None = None

    def __post_init__(self) -> None:
        heights = self.values.max(axis=1)
        self.value, self.best = float(heights.max()), self.density
        near = self.value - _AT_ONCE * abs(self.value)
        self._working = [int(k) for k in np.argsort(-heights) if heights[k] >= near]

    def block(self) -> None:
        """Some steps with the scenarios of the set, and a look at all of them."""
        problem, recorder, scenarios = self.problem, self.recorder, len(self.values)
        assert isinstance(problem.evaluate, ByScenario)
        recorder.start_index = self.index
        share = len(self._working) / scenarios
        run = self._run
        if run is None:
            part = replace(problem, evaluate=problem.evaluate.of_scenarios(self._working))
            run = self._run = TrustRegionRun(
                problem=part, recorder=Recorder(part), density=self.density,
                evaluation=part.checked(self.density), tolerance=self.tolerance, radius=_RADIUS,
            )  # fmt: skip
            recorder.beside += share
        fell = [run.value]
        for _ in range(_BLOCK):
            if run.finished or recorder.evaluations >= self.most:
                break
            made = run.recorder.evaluations
            run.step()
            fell.append(run.value)
            recorder.beside += share * (run.recorder.evaluations - made)
        self.density = run.density
        seen = values_alone(problem, self.density)
        if seen is None:  # a scenario outside the set cannot be run there: all of them from the best so far
            recorder.fail(self.density)
            self.density, self._working, self._run = self.best, list(range(scenarios)), None
            self.finished = share == 1.0
            return
        recorder.beside -= 1.0 - CHECK
        recorder.add(self.density, problem.checked(self.density), radius=run.radius)
        heights, self.bound = seen.max(axis=1), run.value
        if heights.max() < self.value:
            self.value, self.best = float(heights.max()), self.density
        self.hoped = self.bound - _FALL * (fell[-1 - len(fell) // 2] - self.bound)
        above = heights > self.bound + (self.tolerance if run.finished else _ABOVE) * abs(self.bound)
        above[self._working] = False
        if above.any():
            self._working = [*self._working, int(np.where(above, heights, -np.inf).argmax())]
            self._run = None
        elif run.finished:
            self.finished = self.ended = True
        else:
            run.radius = max(run.radius, _RADIUS)


def binding_scenarios(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> bool:
    """Search from the start of a problem; True when it has ended by itself. The best is in the recorder.

    max_evaluations: a run of k of n scenarios with slopes counts k/n.
    """
    density = problem.into_budgets(problem.start)
    first = problem.checked(density)
    recorder.add(density, first, radius=_RADIUS)
    run = BindingRun(
        problem=problem, recorder=recorder, density=density, values=np.atleast_2d(first.values),
        tolerance=tolerance, most=max_evaluations,
    )  # fmt: skip
    while recorder.evaluations < max_evaluations and not run.finished:
        run.block()
    return run.ended
