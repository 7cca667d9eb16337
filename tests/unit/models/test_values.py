"""Numbers that a response may be: what a Kriging cannot hold is no value, as infinity is none."""

import math

import pytest

from surrogates import Kriging
from surrogates.kriging import given_runs
from workbench.models.protocol import settle
from workbench.models.values import LARGEST, is_value, why_no_values
from workbench.robust.minimax import minimax
from workbench.screening.usable_runs import usable_runs
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0, upper=2), Parameter("b", lower=0, upper=1)])
DIVERGED = 6e293


def model(a, b):
    return DIVERGED if b > 0.9 else a


def test_a_response_within_the_limit_can_be_modelled_and_searched():
    assert 1e6 * LARGEST < given_runs.LARGEST  # the scales of a search stretch what they are given
    points = [[0.0], [0.5], [1.0], [0.2]]
    Kriging().fit(points, [0.0, LARGEST, -LARGEST, 0.3 * LARGEST])
    found = worst_case(lambda a, b: 0.5 * LARGEST * a * b, BOX, budget=14, seed=0)
    assert found.value == pytest.approx(LARGEST)
    assert is_value(-LARGEST)
    assert not is_value(math.nextafter(LARGEST, math.inf))


def test_the_sentence_names_responses_values_and_the_limit():
    assert why_no_values({"y": 1.0, "z": -1e139}) == ""
    assert why_no_values({"y": DIVERGED, "z": 1.0}) == (
        "too large a number: y = 6e+293 lies beyond 1e+140, as where an integration diverges"
    )
    assert "y = 6e+293, z = -1e+200 lie beyond" in why_no_values({"y": DIVERGED, "z": -1e200})
    assert why_no_values({"y": DIVERGED, "z": math.inf}) == "not a finite number: z = inf"


def test_a_run_that_diverged_is_a_failed_one_and_keeps_its_number():
    answer = settle({"y": DIVERGED, "z": 2.0}, {"y": None})
    assert (answer.status, dict(answer.outputs)) == ("nonfinite", {})
    assert answer.error.startswith("too large a number: y = 6e+293 lies beyond 1e+140")
    assert answer.kept == {"y": DIVERGED, "z": 2.0}


def test_a_search_goes_round_runs_that_diverged():
    found = worst_case(model, BOX, budget=20, seed=0)
    assert found.value == pytest.approx(2.0)
    assert set(found.failures) == {"nonfinite"}
    said = {run.error for run in found.runs if run.status == "nonfinite"}
    assert said == {"too large a number: y = 6e+293 lies beyond 1e+140, as where an integration diverges"}


def test_a_search_of_a_combination_leaves_out_what_is_too_large():
    found = worst_case(
        lambda a, b: {"y": a, "z": 1e139 * b}, BOX, response=lambda out: out["y"] + 20 * out["z"], budget=12
    )
    assert {run.status for run in found.runs} == {"ok", "nonfinite"}
    assert all(run.value is None for run in found.runs if run.parameters["b"] > 0.5)


def test_a_row_that_is_too_large_is_a_run_that_failed():
    rows = [{"a": 0.1 * i, "b": 0.1 * i, "y": 1.0 * i} for i in range(6)]
    large = {"a": 1.0, "b": 0.1, "y": DIVERGED}
    found = worst_case(lambda a, b: a - b, BOX, budget=4, start=[*rows, large])
    assert found.failures == {"nonfinite": 1}
    assert found.runs[6].error.startswith("too large a number: y = 6e+293")
    assert usable_runs([*rows, large], BOX, "y").n_left_out == 1


def test_minimax_goes_round_runs_that_diverged():
    design = Space([Parameter("x", lower=-1, upper=1)])
    uncertain = Space([Parameter("u", lower=-1, upper=1)])

    def loss(x, u):
        return DIVERGED if u["u"] > 0.8 else (x["x"] - 0.2) ** 2 + u["u"]

    found = minimax(loss, design, uncertain, budget=30, seed=1)
    assert {run.status for run in found.failed} == {"nonfinite"}
    assert found.value < 2.0
