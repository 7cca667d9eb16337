"""Min-max over many scenarios from several starts: where the caller began decides little of where it ends.

Beside the start that was given, searches by the scenarios that bind (`binding.py`) begin at

    the layout of the first scenario, the nominal one as a rule, made from the even layout
    the layout of the scenario in which that is worst, made in the same way
    half way between these two

none of which knows the start. Layouts of one scenario are cheap and sparse: what one load case does not need
is gone, where a search from the even layout takes it away step by step. Each search gets one block of
steps; then the next block goes to the one that may fall lowest. One that may no longer come noticeably below
the best of all scenarios waits. When all wait, searches begin half way between the best design and those of
the others, the next best first; the best one gets what is left.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import LayoutProblem
from ..outcome.history import Recorder
from .binding import CHECK, BindingRun, ByScenario, binding_scenarios
from .probing import spread, values_alone
from .trust_region import TrustRegionRun

__all__ = ["ENOUGH", "binding_from_several_starts", "by_binding_scenarios"]

Array = NDArray[np.float64]

ENOUGH = 12  # evaluations, as few as it was measured with
_ALONE = 12  # steps for a layout of one scenario
_GAIN = 1e-3  # of the best value: what a search has to promise to be gone on with
_APART = 1e-2  # of the bounds' width: root mean square between designs that are worth mixing


def by_binding_scenarios(
    problem: LayoutProblem, recorder: Recorder, most: int, tolerance: float, *, several: bool
) -> tuple[bool, str]:
    """From several starts where that is asked for and `most` evaluations are enough; whether the search has
    ended by itself, and what to add to the words for it."""
    if not several or most < ENOUGH:
        return binding_scenarios(problem, recorder, max_evaluations=most, tolerance=tolerance), ""
    done = binding_from_several_starts(problem, recorder, max_evaluations=most, tolerance=tolerance)
    return done, ", from several starts"


def binding_from_several_starts(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> bool:
    """Search from the start of a problem and from others; True when the best of them has ended by itself.

    max_evaluations: a run of k of n scenarios with slopes counts k/n. The best value of each search
    is in `recorder.ends`, the best design in the recorder.
    """
    density = problem.into_budgets(problem.start)
    first = problem.checked(density)
    recorder.add(density, first)
    searches: list[BindingRun] = []

    def begin(density: Array, values: Array) -> BindingRun:
        searches.append(BindingRun(
            problem=problem, recorder=recorder, density=density, values=values, tolerance=tolerance,
            most=max_evaluations, index=len(searches),
        ))  # fmt: skip
        return searches[-1]

    def look(density: Array) -> Array | None:
        """(scenarios, nodes) there, all run without slopes; None where that fails."""
        recorder.start_index = len(searches)
        values = values_alone(problem, density)
        if values is None:
            recorder.fail(density)
        else:
            recorder.beside -= 1.0 - CHECK
            recorder.add(density, problem.checked(density))
        return values

    begin(density, np.atleast_2d(first.values))
    nominal = _layout_of_one(problem, recorder, 0, len(first.values), tolerance)
    seen = look(nominal)
    if seen is not None:
        begin(nominal, seen)
    worst = int(np.argmax((np.atleast_2d(first.values) if seen is None else seen)[1:].max(axis=1))) + 1
    others = _layout_of_one(problem, recorder, worst, len(first.values), tolerance)
    for start in (others, problem.into_budgets(0.5 * (nominal + others))):
        seen = look(start)
        if seen is not None:
            begin(start, seen)
    mixed: set[frozenset[int]] = set()
    while recorder.evaluations < max_evaluations:
        best = min(searches, key=lambda s: s.value)
        low = best.value - _GAIN * abs(best.value)
        going = [s for s in searches if not s.finished and s.hoped < low]
        if going:
            min(going, key=lambda s: s.hoped).block()
            continue
        pair = _to_mix(problem, best, searches, mixed)
        if pair is None and best.finished:
            break
        if pair is None:
            best.block()
            continue
        mixed.add(frozenset({pair.index, best.index}))
        start = problem.into_budgets(0.5 * (best.best + pair.best))
        seen = look(start)
        if seen is not None:
            begin(start, seen)
    recorder.ends += [search.value for search in searches]
    recorder.optima += [search.value for search in searches if search.ended]
    return min(searches, key=lambda s: s.value).ended


def _layout_of_one(
    problem: LayoutProblem, recorder: Recorder, scenario: int, scenarios: int, tolerance: float
) -> Array:
    """The layout of one scenario from the even one."""
    assert isinstance(problem.evaluate, ByScenario)
    alone = replace(problem, evaluate=problem.evaluate.of_scenarios([scenario]))
    density = problem.into_budgets(spread(problem))
    evaluation = alone.tried(density)
    if evaluation is None:
        return density
    run = TrustRegionRun(
        problem=alone, recorder=Recorder(alone), density=density, evaluation=evaluation, tolerance=tolerance
    )
    for _ in range(_ALONE - 1):
        if run.finished:
            break
        run.step()
    recorder.beside += (1 + run.recorder.evaluations) / scenarios
    return run.density


def _to_mix(
    problem: LayoutProblem, best: BindingRun, searches: list[BindingRun], mixed: set[frozenset[int]]
) -> BindingRun | None:
    """The next best search with another design than the best one, not mixed with it before."""
    width = np.maximum(problem.upper - problem.lower, 1e-300)

    def apart(other: BindingRun) -> float:
        return float(np.sqrt(np.mean(((other.best - best.best) / width) ** 2)))

    fit = [s for s in searches if frozenset({s.index, best.index}) not in mixed and apart(s) > _APART]
    return min(fit, key=lambda s: s.value, default=None)
