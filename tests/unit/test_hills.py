"""Hills among the runs, and the searches that climb the next one."""

import numpy as np
import pytest

from studies.worst_case_gallery import PROBLEMS
from workbench.hills import FEWEST_TRIES, HALF_WIDTH, hill_tops, next_hill
from workbench.worst_case import worst_case

DEPTH = 0.05


def two_peaks(u):
    """A broad peak of height 1 at (0.2, 0.2) and a narrow one of height 1.2 at (0.8, 0.8)."""
    broad = np.exp(-((u - 0.2) ** 2).sum(axis=1) / 0.05)
    return broad + 1.2 * np.exp(-((u - 0.8) ** 2).sum(axis=1) / 0.02)


def grid(count):
    line = np.linspace(0, 1, count)
    return np.array(np.meshgrid(line, line)).reshape(2, -1).T


def test_tops_are_the_peaks_of_the_runs_highest_first():
    u = grid(11)
    tops = hill_tops(u, two_peaks(u))
    np.testing.assert_allclose(u[tops[:2]], [[0.8, 0.8], [0.2, 0.2]])
    assert len(tops) == 2


def test_the_next_hill_is_another_one_and_is_given_up_after_vain_tries():
    u = grid(11)
    peak = np.abs(u - 0.2).max(axis=1) < 1e-9
    u = np.vstack([u[~peak], u[peak]])  # runs after a top count as tries: the top comes last
    top = next_hill(u, two_peaks(u), two_peaks, depth=DEPTH)
    assert top == len(u) - 1
    near = np.array([0.2, 0.2]) + HALF_WIDTH * np.array([[0.5, 0.3], [-0.4, 0.2], [0.1, -0.6]])
    assert len(near) == FEWEST_TRIES
    more = np.vstack([u, near[:2]])
    assert next_hill(more, two_peaks(more), two_peaks, depth=DEPTH) == top
    more = np.vstack([u, near])
    assert next_hill(more, two_peaks(more), two_peaks, depth=DEPTH) is None


def test_a_ridge_without_a_valley_is_one_hill():
    def ridge(u):
        return 1.0 - 4 * (u[:, 1] - 0.5) ** 2 + 0.1 * u[:, 0]

    u = np.array([[0.0, 0.5], [1.0, 0.5], [0.1, 0.1], [0.1, 0.9], [0.2, 0.0], [0.9, 0.1], [0.9, 0.9]])
    assert next_hill(u, ridge(u), ridge, depth=DEPTH) is None


@pytest.mark.slow
def test_a_search_leaves_the_local_minimum_of_hartmann_6():
    """Without hills this search ends at -3.2032 and states a gap of 1e-4; every second one does."""
    problem = next(p for p in PROBLEMS if p.name == "hartmann6")
    found = worst_case(problem.function, problem.space, sense="min", budget=60, seed=306)
    assert found.value < -3.29
    assert any(run.proposal == "hill" for run in found.runs)
