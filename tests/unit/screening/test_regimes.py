"""A response that switches: its regimes, who switches it, what drives it inside each, where that is said."""

import numpy as np
import pytest

import doe
from workbench.errors import StudyError
from workbench.report.lines.screening import screening_lines
from workbench.report.lines.statements import regime_name, regime_of, regime_text
from workbench.screening.kriging import screen
from workbench.space.box import Space
from workbench.space.parameter import Parameter, Response

SPACE = Space([Parameter(name, lower=0.0, upper=2.0, unit="m") for name in "abcdef"])
NAMED = Response("flight", unit="m", regimes=("held", "left the vehicle"))


def flight(row):
    """Thrown out where 1.2 a + b is large; inside, other parameters act."""
    if 1.2 * row["a"] + row["b"] > 2.7:
        return 8.0 + 1.5 * row["c"] + 0.1 * row["d"]
    return 0.02 + 0.15 * row["d"] * (1.0 + 0.5 * row["c"])


def rows(n=60, seed=1):
    points = doe.optimised_lhs(n, 6, swaps=5_000, rng=np.random.default_rng(seed))
    return [{**row, "flight": flight(row)} for row in SPACE.rows(points)]


@pytest.fixture(scope="module")
def found():
    return screen(rows(), SPACE, NAMED, effects=False)


@pytest.mark.slow
def test_the_switch_and_the_regimes_have_drivers_of_their_own(found):
    regimes = found.regimes
    assert set(regimes["switch"]["selected"]) >= {"a", "b"}
    held, gone = regimes["regimes"]
    assert (held["name"], gone["name"]) == ("held", "left the vehicle")
    assert held["runs"] + gone["runs"] == 60
    assert set(held["selected"]) == {"c", "d"}
    assert gone["selected"][0] == "c"
    assert held["range"][1] < regimes["threshold"] < gone["range"][0]


def test_the_chance_is_judged_on_runs_left_out(found):
    switch = found.regimes["switch"]
    assert switch["right"] >= 50
    assert switch["brier"] < 0.4 * switch["brier_of_the_share"]
    assert switch["certain_right"] >= 0.9 * switch["certain"] > 30
    curve = switch["chance"]["a"]
    assert (curve["x"][0], curve["x"][-1]) == (0.0, 2.0)
    assert curve["mean"][-1] > curve["mean"][0] + 0.3


def test_it_is_said_and_worst_cases_speak_of_one_regime(found):
    document = found.to_dict()
    said = regime_text(document)
    assert said[0].startswith("of 60 runs ")
    assert " left the vehicle (" in said[0]
    assert "it is switched by " in said[1]
    assert any(line.startswith('inside "held" (') for line in screening_lines(document))
    text = regime_of(9.0, document)
    assert text.startswith('It lies in the regime "left the vehicle", above ')
    assert regime_of(0.2, document).startswith('It lies in the regime "held", below ')
    assert (regime_name(9.0, document), regime_name(0.2, document)) == ("left the vehicle", "held")
    assert regime_name(9.0, None) == ""


@pytest.mark.slow
def test_unnamed_off_and_smooth():
    unnamed = screen(rows(), SPACE, Response("flight", unit="m"), effects=False)
    assert "of 60 runs are in another regime (8" in regime_text(unnamed.to_dict())[0]
    assert regime_name(9.0, unnamed.to_dict()) == ""
    assert regime_of(9.0, unnamed.to_dict()).startswith("It lies in the upper regime, above ")
    assert screen(rows(), SPACE, NAMED, regimes="off", effects=False).regimes is None
    smooth = [{**row, "flight": row["a"] + np.sin(2 * row["b"])} for row in rows()]
    found = screen(smooth, SPACE, NAMED, effects=False).to_dict()
    assert found["regimes"] is None
    assert (regime_text(found), regime_of(1.0, found)) == ([], "")


def test_what_does_not_fit_is_refused():
    with pytest.raises(StudyError, match="screening regimes needs 'auto' or 'off', got 'on'"):
        screen(rows(), SPACE, NAMED, regimes="on")
    with pytest.raises(StudyError, match=r"regimes of response 'y' needs two different names, .* \['a'"):
        Response("y", regimes=("a", "a"))
