from collections import Counter

import numpy as np

from workbench import Parameter, Space
from workbench.search.evidence.attack.strata import Strata
from workbench.search.runs.unit_space import SearchSpace


def _space(*extra, numbers=3, constraints=()):
    return Space([*(Parameter(f"x{i}", lower=0, upper=1) for i in range(numbers)), *extra], constraints)


HANDS = Parameter("hands", kind="categorical", levels=("none", "one", "two"))
BELT = Parameter("belt", kind="binary")


def _strata(space, seed=0, **options):
    return Strata.of(SearchSpace.of(space), rng=np.random.default_rng(seed), **options)


def test_every_combination_gets_an_equal_share():
    strata = _strata(_space(HANDS, BELT, numbers=8))
    points = strata.corners(600, np.random.default_rng(1))
    counts = Counter(map(tuple, points[:, [8, 9]]))
    assert len(counts) == 6
    assert max(counts.values()) - min(counts.values()) <= 20  # corners that were drawn twice fall out
    assert set(np.unique(points[:, :8])) == {0.0, 1.0}


def test_all_corners_are_taken_where_they_fit():
    strata = _strata(_space(HANDS))
    points = strata.corners(24, np.random.default_rng(1))
    assert len(np.unique(points, axis=0)) == 24
    assert len(strata.corners(23, np.random.default_rng(1))) < 24
    assert [strata.has_corners_within(size) for size in (23, 24)] == [False, True]


def test_near_corners_have_coordinates_inside():
    points = _strata(_space(numbers=6)).near_corners(200, np.random.default_rng(1))
    inside = np.mean((points > 0) & (points < 1))
    assert 0.2 < inside < 0.3


def test_too_many_combinations_are_drawn_from_with_every_level_in_turn():
    words = [Parameter(f"w{i}", kind="categorical", levels=("a", "b", "c", "d")) for i in range(5)]
    strata = _strata(_space(*words), most=32)
    assert strata.count == 1024
    assert not strata.has_corners_within(10**6)  # some combinations are not among those drawn
    assert 28 <= len(strata) <= 32
    for column in strata.levels.T:
        assert min(Counter(column).values()) >= 6


def test_a_space_without_levels_is_one_stratum():
    strata = _strata(_space())
    assert (len(strata), strata.count) == (1, 1)
    assert strata.index(np.random.default_rng(0).random((4, 3))).tolist() == [0, 0, 0, 0]


def test_points_find_their_stratum():
    strata = _strata(_space(HANDS, BELT))
    points = strata.near_corners(30, np.random.default_rng(2))
    index = strata.index(points)
    np.testing.assert_allclose(points[:, [3, 4]], strata.levels[index])


def test_constraints_hold():
    strata = _strata(_space(constraints=("x0 + x1 <= 1",)))
    for points in (
        strata.corners(100, np.random.default_rng(1)),
        strata.near_corners(100, np.random.default_rng(1)),
    ):
        assert (points[:, 0] + points[:, 1] <= 1).all()
        assert len(points) >= 6


def test_cases_from_anywhere_are_by_turns_of_every_combination_and_half_of_them_near_corners():
    strata = _strata(_space(HANDS, BELT, numbers=6))
    points = strata.anywhere(600, np.random.default_rng(1))
    counts = Counter(map(tuple, points[:, [6, 7]]))
    assert len(counts) == 6
    assert min(counts.values()) >= 90  # corners that were drawn twice fall out
    assert len(set(map(tuple, points[:6, [6, 7]]))) == 6
    is_inside = ((points[:, :6] > 0) & (points[:, :6] < 1)).all(axis=1)
    assert 0.4 < is_inside.mean() < 0.6
    at_ends = ((points[:, :6] == 0) | (points[:, :6] == 1))[~is_inside]
    assert 0.65 < at_ends.mean() < 0.85
