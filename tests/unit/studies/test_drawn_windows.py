"""Drawn ground structures on drawn windows."""

import numpy as np

from studies.drawn_windows import drawn_problem, run


def test_problems_are_drawn_alike_and_within_their_bounds():
    for seed in range(12):
        problem, window = drawn_problem(seed)
        again, _ = drawn_problem(seed)
        assert 54 <= problem.members <= 336
        assert 0.5 <= window <= 2.5
        assert problem.excess(problem.start) <= 1e-12
        assert 0.05 <= problem.limits[0] / problem.members <= 0.25
        assert np.array_equal(again.geometry.point_a, problem.geometry.point_a)


def test_each_start_is_searched_with_and_without_runs_without_gradients():
    rows = list(run(3, 1, 2, plain=True, evaluations=8))
    assert [(seed, row.start) for seed, row in rows] == [(3, 0), (3, 0), (3, 1), (3, 1)]
    assert all(row.evaluations <= 8 and row.value > 0 for _, row in rows)
