"""Peaks among the runs, and the searches that climb the next one."""

import numpy as np
import pytest

from studies.worst_case_gallery import PROBLEMS
from workbench.search.proposals.other_peaks import (
    FEWEST_TRIES,
    HALF_WIDTH,
    next_top,
    peak_tops,
)
from workbench.search.worst_case import worst_case

DEPTH, GAIN = 0.05, 0.01


def two_peaks(u):
    """A broad peak of height 1 at (0.2, 0.2) and a narrow one of height 1.2 at (0.8, 0.8)."""
    broad = np.exp(-((u - 0.2) ** 2).sum(axis=1) / 0.05)
    return broad + 1.2 * np.exp(-((u - 0.8) ** 2).sum(axis=1) / 0.02)


def grid(count):
    line = np.linspace(0, 1, count)
    return np.array(np.meshgrid(line, line)).reshape(2, -1).T


def test_tops_are_the_peaks_of_the_runs_highest_first():
    u = grid(11)
    tops = peak_tops(u, two_peaks(u))
    np.testing.assert_allclose(u[tops[:2]], [[0.8, 0.8], [0.2, 0.2]])
    assert len(tops) == 2


def test_runs_beyond_the_box_are_no_rivals_of_a_top():
    u = np.array([[0.1, 0.1], [0.1, 0.31], [0.25, 0.1]])
    assert peak_tops(u, np.array([1.0, 2.0, 0.5])).tolist() == [1, 0]
    assert peak_tops(u, np.array([1.0, 2.0, 1.5])).tolist() == [1, 2]


def test_the_next_top_is_another_one_and_is_given_up_after_vain_tries():
    u = np.array([[0.8, 0.8], [0.5, 0.5], [0.2, 0.2]])
    top = next_top(u, two_peaks(u), two_peaks, depth=DEPTH, gain=GAIN)
    assert top == 2
    near = np.array([0.2, 0.2]) + HALF_WIDTH * np.array([[0.5, 0.3], [-0.4, 0.2], [0.1, -0.6]])
    assert len(near) == FEWEST_TRIES
    more = np.vstack([u, near[:2]])
    assert next_top(more, two_peaks(more), two_peaks, depth=DEPTH, gain=GAIN) == top
    more = np.vstack([u, near])
    assert next_top(more, two_peaks(more), two_peaks, depth=DEPTH, gain=GAIN) is None


def test_a_peak_that_still_gains_is_not_given_up():
    u = np.vstack([[[0.8, 0.8]], np.linspace([0.35, 0.35], [0.2, 0.2], 6)])  # five runs climb to the top
    assert next_top(u, two_peaks(u), two_peaks, depth=DEPTH, gain=GAIN) == 6
    assert next_top(u, two_peaks(u), two_peaks, depth=DEPTH, gain=1.0) is None  # all of them in vain


def test_a_ridge_without_a_valley_is_one_peak_unless_the_runs_leave_room_for_one():
    def ridge(u):
        return 1.0 - 4 * (u[:, 1] - 0.5) ** 2 + 0.1 * u[:, 0]

    u = np.array([[0.0, 0.5], [1.0, 0.5]])
    assert next_top(u, ridge(u), ridge, depth=DEPTH, gain=GAIN) is None
    assert next_top(u, ridge(u), lambda p: ridge(p) - 0.2, depth=DEPTH, gain=GAIN) == 0


@pytest.mark.slow
def test_a_search_leaves_the_local_minimum_of_hartmann_6():
    """This search runs its first forty points at the local minimum, as every third one does."""
    problem = next(p for p in PROBLEMS if p.name == "hartmann6")
    found = worst_case(problem.function, problem.space, sense="min", budget=100, seed=603)
    assert found.value < -3.29
    assert -3.21 < min(found.history[:40]) < -3.18
    assert any(run.proposal == "hill" for run in found.runs)
