"""The equivalent static load method: a rival that needs no gradient of a run.

Simulate; find the static loads under which a structure at rest would stand as the run moved; find the layout
of that structure, loads held; simulate it again. Densities that do not change are a fixed point, which is a
stationary point of the transient problem only as far as inertia does not matter. As published nothing bounds
a step; here one that makes the run worse is taken back and the next goes half as far, so that the best design
never gets worse.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation, InvalidLayout, LayoutProblem
from ..formulation.static_loads import static_evaluation, static_loads
from ..outcome.history import Recorder
from .min_max import min_max

__all__ = ["VARIANTS", "equivalent_static_loads"]

Array = NDArray[np.float64]

VARIANTS = {"esl": False, "esl_difference": True}  # method -> loads of differences between nodes

_INNER = 40  # evaluations of the static problem, which simulate nothing
_SMALLEST = 1e-4  # of the bounds' width: a step that is not worth a simulation


def equivalent_static_loads(
    problem: LayoutProblem, recorder: Recorder, *, difference: bool, max_evaluations: int, tolerance: float
) -> bool:
    """Search until the densities stand still or the evaluations are used up; True when they stand still.

    Raises InvalidLayout for problems without runs, with limits or law variables, or of a power other than 1.
    """
    density = problem.into_budgets(problem.start)
    evaluation = problem.checked(density)
    runs = getattr(evaluation, "runs", None)
    if runs is None or evaluation.constraints.size or problem.variables:
        raise InvalidLayout(
            "equivalent static loads need the runs of moving systems (`transient_problem` at power 1), with "
            "budgets only and without law variables; take method 'gsao'"
        )
    recorder.add(density, evaluation)
    value, reach, width = float(np.max(evaluation.values)), 1.0, problem.upper - problem.lower
    cases = _cases(evaluation, difference)
    while recorder.evaluations < max_evaluations:
        inner = replace(
            problem, evaluate=partial(static_evaluation, cases), start=density, simulated=None,
            lower=np.maximum(problem.lower, density - reach * width),
            upper=np.minimum(problem.upper, density + reach * width), times=None,
        )  # fmt: skip
        found = min_max(
            inner, Recorder(inner), max_evaluations=_INNER, tolerance=0.1 * tolerance, multi_start=False
        )
        step = np.abs(found.density - density).max() / width.max()
        if step <= _SMALLEST:
            return True
        trial = problem.into_budgets(found.density)
        tried = problem.tried(trial)
        if tried is None:
            recorder.fail(trial, radius=reach)
            reach = 0.5 * min(reach, float(step))
            continue
        better = float(np.max(tried.values)) < value
        recorder.add(trial, tried, radius=reach, accepted=better)
        if better:
            density, value, cases = trial, float(np.max(tried.values)), _cases(tried, difference)
        else:
            reach = 0.5 * min(reach, float(step))
    return False


def _cases(evaluation: Evaluation, difference: bool) -> list[Any]:
    runs: Any = evaluation
    return [static_loads(run, difference=difference) for run in runs.runs]
