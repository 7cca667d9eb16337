"""Smooth aggregates of the rows."""

import numpy as np
import pytest

from workbench.engine.layout.formulation.aggregate import aggregated
from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem


def test_aggregates_bound_the_maximum():
    problem = static_problem(
        lambda a: (np.array([a[0], 2 * a[1], 0.3]), np.array([[1.0, 0], [0, 2.0], [0, 0]])), start=[0.4, 0.25]
    )
    top = 0.5
    for kind in ("ks", "p_norm"):
        smooth = aggregated(problem, kind)
        evaluation = smooth.evaluate(smooth.start)
        assert top <= evaluation.values[0, 0] <= 1.1 * top
        h = 1e-6
        for i in range(2):
            e = np.eye(2)[i] * h
            slope = (smooth.evaluate(smooth.start + e).values - smooth.evaluate(smooth.start - e).values) / (
                2 * h
            )
            assert evaluation.gradients(np.array([0]))[0, i] == pytest.approx(slope[0, 0], rel=1e-5, abs=1e-8)
    with pytest.raises(InvalidLayout, match="kind needs to be 'ks' or 'p_norm'"):
        aggregated(problem, "max")
    with pytest.raises(InvalidLayout, match="sharpness needs to be >= 1"):
        aggregated(problem, sharpness=0.5)
