"""Worst cases of several responses: of each, of a weighted sum, of one within limits of another."""

import numpy as np
import pytest

from workbench.errors import StudyError
from workbench.models.evaluator import FunctionEvaluator
from workbench.models.readings import weighted, within
from workbench.search.worst_case import worst_case
from workbench.search.worst_cases import worst_cases
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=2.0), Parameter("b", lower=0.0, upper=1.0)])


def model(a, b):
    return {"load": a * (1 + b), "travel": a * a + b}


@pytest.mark.slow
def test_every_response_has_its_worst_case_and_the_runs_are_shared():
    calls = []

    def counted(a, b):
        calls.append((a, b))
        return model(a, b)

    found = worst_cases(counted, BOX, {"load": "max", "travel": "min"}, budget=24, seed=1)
    assert found["load"].value == pytest.approx(4.0)
    assert found["travel"].value == pytest.approx(0.0, abs=1e-3)
    assert len(calls) <= 24
    # the second search began with all runs of the first and drew no start design of its own
    assert sum(run.number == 0 for run in found["travel"].runs) == found["load"].evaluations
    assert not any(run.proposal == "start" for run in found["travel"].runs)


@pytest.mark.slow
def test_a_weighted_sum_is_searched():
    found = worst_case(model, BOX, response=weighted({"load": 1.0, "travel": -2.0}), budget=30, seed=0)
    # a (1 + b) - 2 (a^2 + b): b pays only where a > 2, so b = 0 and a = 1/4
    assert found.value == pytest.approx(0.125, abs=1e-3)
    assert found.parameters["b"] == pytest.approx(0.0, abs=1e-2)


@pytest.mark.slow
def test_runs_outside_the_limits_are_excluded_and_counted():
    found = worst_case(model, BOX, response=within("load", {"travel": (None, 2.0)}), budget=45, seed=0)
    # a (1 + b) with a^2 + b = 2: a (3 - a^2) is largest at a = 1, b = 1
    assert found.value == pytest.approx(2.0, rel=0.01)
    assert set(found.failures) == {"excluded"}
    for run in found.runs:
        assert (run.status == "excluded") == (model(**run.parameters)["travel"] > 2.0)


@pytest.mark.slow
def test_an_evaluator_takes_the_place_of_the_function():
    senses = {"load": "max", "travel": "max"}
    plain = worst_cases(model, BOX, senses, budget=20, seed=1)
    through = worst_cases(None, BOX, senses, budget=20, seed=1, evaluator=FunctionEvaluator(model))
    assert {name: found.value for name, found in through.items()} == {
        name: found.value for name, found in plain.items()
    }


def test_limits_are_inclusive_and_open_sides_are_open():
    read = within("a", {"b": (1.0, None)})
    assert read({"a": 5.0, "b": 1.0}) == 5.0
    assert np.isnan(read({"a": 5.0, "b": 0.999}))


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: weighted({}), "weighted needs at least one response with its weight, got none"),
        (lambda: within("a", {}), r"within\('a', ...\) needs at least one limit, got none"),
        (lambda: within("a", {"b": (2.0, 1.0)}), r"limits of 'b' need low <= high, got \(2, 1\)"),
        (lambda: weighted({"z": 1.0})(model(1, 1)), "response 'z' is not among the model's outputs"),
        (lambda: within("load", {"z": (0, 1)})(model(1, 1)), "response 'z' is not among the model's outputs"),
        (lambda: within("a", {"b": (None, float("nan"))}), r"limits of 'b' need numbers, .*\(None, nan\)"),
        (lambda: within("a", {"b": ("1", None)}), r"limits of 'b' need numbers, or None for an open side"),
        (lambda: worst_cases(model, BOX, {}), "worst_cases needs at least one response with 'max' or 'min'"),
    ],
)
def test_bad_input_is_named(make, match):
    with pytest.raises(StudyError, match=match):
        make()


@pytest.mark.parametrize(
    ("senses", "budget", "most", "match"),
    [
        ({"load": "max", "travel": "up"}, 24, 0, "sense needs 'max' or 'min', got 'up'"),
        (
            {"load": "max", "weight": "max"},
            24,
            4,
            r"response 'weight' is not among the model's outputs \['load'",
        ),
        (
            {"load": "max", "travel": "max"},
            5,
            0,
            r"budget=5 is shared by 2 responses, and 2 runs are below the start design of 4\. .* least 10",
        ),
        ({"load": "max"}, 10.5, 0, "budget needs a whole number of runs >= 0, got 10.5"),
    ],
)
def test_what_no_search_can_use_is_said_before_the_first_search(senses, budget, most, match):
    calls = []

    def counted(a, b):
        calls.append(a)
        return model(a, b)

    with pytest.raises(StudyError, match=match):
        worst_cases(counted, BOX, senses, budget=budget)
    assert len(calls) <= most
