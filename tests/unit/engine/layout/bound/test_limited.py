"""The trust region with limits: a design that breaks them is brought inside in a few steps."""

import numpy as np

from tests.limited_layouts import limited
from workbench.engine.layout.bound.trust_region import TrustRegionRun
from workbench.engine.layout.outcome.history import FEASIBLE, Recorder


def test_a_design_that_breaks_its_limits_is_brought_inside():
    problem, _, _ = limited(1, "material")
    inside = problem.start
    outside = inside - 0.35  # too little of everything
    evaluation = problem.checked(outside)
    recorder = Recorder(problem)
    run = TrustRegionRun(
        problem=problem, recorder=recorder, density=outside, evaluation=evaluation, tolerance=1e-6
    )
    assert run.penalty.violation(evaluation) > 0.1
    for _ in range(6):
        run.come_inside()
    assert recorder.best_density is not None
    assert np.max(problem.checked(recorder.best_density).constraints) <= FEASIBLE
    assert recorder.best < float(inside.sum())
