"""Minimax searches over categories, integers, switches and grid steps, against enumeration."""

from itertools import product

import numpy as np
import pytest

from workbench.errors import StudyError
from workbench.robust.joint_trend import MixedTrend, largest_trend
from workbench.robust.minimax import MinimaxStatus, minimax
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.box import Parameter, Space

ONE_PERCENT = 0.01

METAL = {"steel": 0.0, "aluminium": 0.4, "glass": -0.5, "wood": 0.8}
WEATHER = {"hot": 1.0, "cold": -0.7, "wet": 0.3}
GRADE = {"p": 0.2, "q": -0.3, "r": 0.5}


def words(name, levels):
    return Parameter(name, kind="categorical", levels=tuple(levels))


def line(name, lower=-1, upper=1):
    return Parameter(name, lower=lower, upper=upper)


def four_and_three(x, u):
    a, k = METAL[x["metal"]], WEATHER[u["weather"]]
    return (x["x"] - a) ** 2 + 0.5 * abs(a) + u["u"] * (x["x"] + k) + k * a


def three_and_three(x, u):
    b, k = GRADE[x["grade"]], WEATHER[u["weather"]]
    return 2 * (x["x"] - b) ** 2 - (u["u"] - b * k) ** 2 + x["x"] * u["u"] + b**2 + 0.4 * k * x["x"]


def every_kind(x, u):
    n, k = x["n"], WEATHER[u["weather"]]
    belt = 0.6 - 0.5 * u["step"] if x["belt"] else 0.0
    return 0.05 * (n - 4.3) ** 2 + (x["x"] - 0.03 * n) ** 2 + belt + u["step"] * (x["x"] - 0.5) + 0.02 * k * n


def curved(x, u):
    a, k = METAL[x["metal"]], WEATHER[u["weather"]]
    wave = np.sin(2 * u["u"] + k) * (1 + 0.5 * x["x"])
    return np.exp(-a) * (x["x"] - 0.4 * a) ** 2 + wave + 0.3 * x["y"] ** 2 - 0.4 * x["y"] * k


PROBLEMS = {
    "four levels and three": (
        four_and_three,
        Space([words("metal", METAL), line("x")]),
        Space([line("u"), words("weather", WEATHER)]),
    ),
    "three levels and three": (
        three_and_three,
        Space([words("grade", GRADE), line("x")]),
        Space([line("u"), words("weather", WEATHER)]),
    ),
    "every kind": (
        every_kind,
        Space([Parameter("n", kind="integer", lower=0, upper=9), Parameter("belt", kind="binary"),
               line("x", 0)]),
        Space([Parameter("step", lower=0, upper=2, step=0.1), words("weather", WEATHER)]),
    ),
    "curved": (
        curved,
        Space([words("metal", METAL), line("x"), line("y")]),
        Space([line("u"), words("weather", WEATHER)]),
    ),
}  # fmt: skip


def rows(space, n):
    axes = [np.linspace(0, 1, n) if grid is None else grid for grid in space.unit_levels]
    return space.rows(np.array(list(product(*axes))))


def worst_of(function, design, uncertainty, n=41):
    return max(function(design, u) for u in rows(uncertainty, n))


def enumerated(function, designs, uncertainty):
    """The best of a grid of designs, then of finer grids of its continuous parameters around it."""
    scenarios = rows(uncertainty, 41)
    candidates, width = rows(designs, 17), 1 / 16
    for _ in range(5):
        values = [max(function(x, u) for u in scenarios) for x in candidates]
        best = candidates[int(np.argmin(values))]
        around = [
            np.clip(np.linspace(c - width, c + width, 7), 0, 1) if grid is None else np.array([c])
            for c, grid in zip(designs.unit([best])[0], designs.unit_levels, strict=True)
        ]
        candidates, width = designs.rows(np.array(list(product(*around)))), width / 3
    return min(values)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [*list(PROBLEMS)[:3], pytest.param("curved", marks=pytest.mark.slow)])
def test_mixed_problems_within_one_percent_of_their_enumeration(name, seed):
    function, designs, uncertainty = PROBLEMS[name]
    known = enumerated(function, designs, uncertainty)
    result = minimax(function, designs, uncertainty, budget=300, seed=seed)
    assert result.evaluations <= 300
    assert worst_of(function, result.design, uncertainty) == pytest.approx(known, rel=ONE_PERCENT)
    assert function(result.design, result.scenario) == pytest.approx(result.value, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(PROBLEMS)[:3])
@pytest.mark.parametrize("budget", [15, 100])
def test_a_small_budget_falls_back_to_a_smaller_trend(name, budget):
    function, designs, uncertainty = PROBLEMS[name]
    result = minimax(function, designs, uncertainty, budget=budget, seed=0)
    assert result.evaluations <= budget
    assert function(result.design, result.scenario) == pytest.approx(result.value, rel=1e-12)


@pytest.mark.slow
def test_categories_that_fail_are_left_out():
    function, designs, uncertainty = PROBLEMS["four levels and three"]

    def failing(x, u):
        if x["metal"] == "steel" or (u["weather"] == "hot" and u["u"] > 0.4):
            raise RuntimeError("no data")
        return function(x, u)

    result = minimax(failing, designs, uncertainty, budget=300, seed=0)
    known = min(
        max(
            function({"metal": metal, "x": x}, {"u": u, "weather": w})
            for w in WEATHER
            for u in np.linspace(-1, 0.4 if w == "hot" else 1, 2)  # the response is linear in u
        )
        for metal in METAL
        if metal != "steel"
        for x in np.linspace(-1, 1, 401)
    )
    assert result.value == pytest.approx(known, rel=ONE_PERCENT)
    assert result.design["metal"] != "steel"


def test_a_finite_problem_is_run_whole_and_no_point_twice():
    calls = []

    def table(x, u):
        calls.append((x["metal"], u["weather"]))
        return METAL[x["metal"]] * WEATHER[u["weather"]] + METAL[x["metal"]] ** 2

    designs, uncertainty = Space([words("metal", METAL)]), Space([words("weather", WEATHER)])
    best = min(METAL, key=lambda m: max(METAL[m] * w + METAL[m] ** 2 for w in WEATHER.values()))
    for budget in (12, 300):
        calls.clear()
        result = minimax(table, designs, uncertainty, budget=budget, seed=0)
        assert len(calls) == len(set(calls)) == result.evaluations <= 12
        assert result.design == {"metal": best}
    assert result.status is MinimaxStatus.EXHAUSTED
    assert sorted(calls) == sorted(product(METAL, WEATHER))
    assert result.lower == result.value


def test_constraints_hold_in_a_mixed_space():
    designs = Space(
        [Parameter("n", kind="integer", lower=0, upper=9), words("grade", GRADE), line("x")],
        constraints=["n + 2 * x <= 4"],
    )

    def f(x, u):
        return 0.1 * (x["n"] - 6) ** 2 + (x["x"] - GRADE[x["grade"]]) ** 2 + u["u"] * x["x"]

    result = minimax(f, designs, Space([line("u")]), budget=200, seed=0)
    assert result.design["n"] + 2 * result.design["x"] <= 4
    known = min(
        0.1 * (n - 6) ** 2 + (x - b) ** 2 + abs(x)
        for n in range(10)
        for b in GRADE.values()
        for x in np.linspace(-1, 1, 2001)
        if n + 2 * x <= 4
    )
    assert result.value == pytest.approx(known, rel=ONE_PERCENT)


def test_constraints_that_leave_no_point_are_named():
    designs = Space([line("x"), line("y")], constraints=["x + y >= 5"])
    with pytest.raises(StudyError, match="no point meets the constraints of design and uncertainty"):
        minimax(lambda x, u: 0.0, designs, Space([line("u")]), budget=30)


def test_the_trend_grows_with_the_runs():
    spaces = tuple(SearchSpace.of(space) for space in PROBLEMS["four levels and three"][1:])
    sizes = {n: largest_trend(spaces, n) for n in (8, 14, 30, 60)}
    assert sizes[8] == "constant"
    counts = [trend.n_terms for trend in (sizes[14], sizes[30], sizes[60])]
    assert counts == [8, 11, 27]  # linear, curved, with slopes per level
    features = np.column_stack([space.features(space.snap(np.full((2, 2), 0.5))) for space in spaces])
    assert isinstance(sizes[60], MixedTrend)
    assert sizes[60](features).shape == (2, 27)
    plain = (SearchSpace.of(Space([line("x"), line("y")])),)
    assert [largest_trend(plain, n) for n in (4, 5, 9)] == ["constant", "linear", "quadratic"]
