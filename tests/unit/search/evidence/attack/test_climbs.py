import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.search.evidence.attack.climbs import (
    bisection,
    corner_climb,
    interior_climb,
    local_climb,
)
from workbench.search.runs.unit_space import SearchSpace


def _climbed(climb, f):
    """Play a climb on f; the points asked for with their kinds and values."""
    asked, step = [], next(climb)
    while True:
        value = f(step.point)
        asked.append((step.kind, step.point, value))
        try:
            step = climb.send(value)
        except StopIteration:
            return asked


def _cube(d):
    return SearchSpace.of(Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(d)]))


def _corner(where, start, f, slope=lambda _: None):
    rng = np.random.default_rng(0)
    return _climbed(corner_climb(where, start, f(start), slope=slope, spread=lambda: 4.0, rng=rng), f)


def test_single_changes_reach_the_best_corner_of_a_linear_response():
    weights = np.array([1.0, -2.0, 3.0, -4.0, 5.0])
    asked = _corner(_cube(5), np.array([0.0, 1, 0, 1, 0]), lambda u: float(u @ weights))
    best = max(range(len(asked)), key=lambda i: asked[i][2])
    np.testing.assert_array_equal(asked[best][1], weights > 0)
    assert best < 5
    assert asked[0][0] == "change"


def test_single_changes_try_every_level_of_a_category():
    space = Space(
        [Parameter("x", lower=0, upper=1), Parameter("c", kind="categorical", levels=tuple("abcd"))]
    )
    asked = _corner(SearchSpace.of(space), np.zeros(2), lambda u: float(abs(u[1] - 2 / 3) < 0.1))
    assert max(value for _, _, value in asked) == 1.0


def test_bisection_ends_at_the_edge_of_a_cliff():
    def f(u):
        return u[0] if u[0] < 0.7 else -1.0

    where = _cube(1)
    asked = _climbed(bisection(where, np.array([0.0]), 0.0, np.array([1.0]), -1.0), f)
    best = max(asked, key=lambda step: step[2])
    assert {kind for kind, _, _ in asked} == {"cliff"}
    assert 0.65 < best[2] < 0.7


def test_bisection_ends_on_the_side_that_runs():
    def f(u):
        return u[0] if u[0] < 0.7 else -np.inf

    asked = _climbed(bisection(_cube(1), np.array([0.0]), 0.0, np.array([1.0]), -np.inf), f)
    assert max(value for _, _, value in asked) > 0.65


def test_a_corner_climb_goes_to_the_edge_of_the_cliffs_beside_its_top():
    def f(u):
        return float(1 + u.sum()) if u.sum() < 1.5 else -2.0

    asked = _corner(_cube(2), np.zeros(2), f)
    assert "cliff" in {kind for kind, _, _ in asked}
    assert max(value for _, _, value in asked) > 2.4


def test_patterns_climb_a_peak_inside():
    top = np.array([0.3, 0.62, 0.8])

    def f(u):
        return float(-((u - top) ** 2).sum())

    where, start = _cube(3), np.array([0.9, 0.1, 0.1])
    climb = interior_climb(where, start, f(start), slope=lambda _: None, rng=np.random.default_rng(0))
    asked = _climbed(climb, f)
    assert max(value for _, _, value in asked) > -2e-3
    assert len(asked) < 120


def test_gradients_climb_in_fewer_runs():
    top = np.array([0.3, 0.62, 0.8])

    def f(u):
        return float(-((u - top) ** 2).sum())

    where, start = _cube(3), np.array([0.9, 0.1, 0.1])
    climb = interior_climb(
        where, start, f(start), slope=lambda u: -2 * (u - top), rng=np.random.default_rng(0)
    )
    asked = [step for step in _climbed(climb, f) if step[0] == "gradient"]
    assert max(value for _, _, value in asked) > -2e-3
    assert len(asked) < 30


def test_integers_move_by_whole_levels():
    space = Space(
        [Parameter("n", lower=0, upper=20, kind="integer"), Parameter("m", lower=0, upper=20, kind="integer")]
    )
    where = SearchSpace.of(space)

    def f(u):
        return -abs(20 * u[0] - 13) - abs(20 * u[1] - 6)

    start = np.array([0.0, 1.0])
    climb = interior_climb(where, start, f(start), slope=lambda _: None, rng=np.random.default_rng(0))
    assert max(value for _, _, value in _climbed(climb, f)) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("d", [1, 2, 4])
def test_a_local_climb_from_the_flank_of_a_narrow_peak_reaches_its_top_in_few_runs(d):
    centre = np.linspace(0.3, 0.6, d)

    def f(u):
        return float(np.exp(-((u - centre) ** 2).sum() / (2 * 0.1**2)))

    start = centre + 0.07 * (-1.0) ** np.arange(d)
    rng = np.random.default_rng(0)
    asked = _climbed(local_climb(_cube(d), start, f(start), slope=lambda _: None, rng=rng), f)
    assert {kind for kind, _, _ in asked} == {"local"}
    assert max(value for _, _, value in asked) > 0.999
    assert len(asked) <= 10 + 10 * d


def test_a_local_climb_stays_inside_and_leaves_categories_alone():
    space = Space(
        [
            Parameter("x", lower=0, upper=1),
            Parameter("n", kind="integer", lower=0, upper=10),
            Parameter("c", kind="categorical", levels=tuple("abcd")),
        ]
    )
    where = SearchSpace.of(space)
    start = where.snap(np.array([[0.97, 0.5, 1 / 3]]))[0]

    def f(u):
        return float(u[0] - (u[1] - 0.7) ** 2)

    asked = _climbed(
        local_climb(where, start, f(start), slope=lambda _: None, rng=np.random.default_rng(1)), f
    )
    best = max(asked, key=lambda step: step[2])[1]
    np.testing.assert_allclose(best, [1.0, 0.7, 1 / 3], atol=1e-9)
    assert all(point[2] == start[2] and 0 <= point.min() and point.max() <= 1 for _, point, _ in asked)


def test_a_local_climb_takes_gradients_where_the_model_gives_them():
    def f(u):
        return float(-((u - 0.4) ** 2).sum())

    start = np.full(3, 0.45)
    asked = _climbed(
        local_climb(_cube(3), start, f(start), slope=lambda u: -2 * (u - 0.4), rng=np.random.default_rng(0)),
        f,
    )
    assert {kind for kind, _, _ in asked} == {"gradient"}
    assert max(value for _, _, value in asked) > -1e-3
