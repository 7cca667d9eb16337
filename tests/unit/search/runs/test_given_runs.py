"""Runs that a search is given: outcomes, another search's runs, rows, tables."""

import pandas as pd
import pytest

from workbench.errors import StudyError
from workbench.models.readings import weighted, within
from workbench.search.runs.given_runs import Run, given_outcomes
from workbench.search.worst_case import worst_case
from workbench.search.worst_cases import worst_cases
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=2.0), Parameter("b", lower=0.0, upper=1.0)])
ROWS = [
    {"a": 0.0, "b": 0.0, "y": 0.0},
    {"a": 2.0, "b": 0.5, "y": 1.5},
    {"a": 1.0, "b": 1.0, "y": 0.0},
    {"a": 0.5, "b": 0.2, "y": 0.3},
]


def model(a, b):
    return {"load": a * (1 + b), "travel": a * a + b}


def test_the_runs_of_one_search_begin_another():
    first = worst_case(lambda a, b: a - b, BOX, budget=8, seed=0)
    second = worst_case(lambda a, b: a - b, BOX, budget=3, seed=7, start=first.runs)
    given = [run for run in second.runs if run.number == 0]
    assert [run.value for run in given] == [run.value for run in first.runs]
    assert given[0].key == "given run 1"
    assert second.evaluations <= 3
    assert second.value == 2.0


def test_the_runs_of_one_response_serve_another_and_those_left_out_come_back():
    kept = worst_case(model, BOX, response=within("load", {"travel": (None, 2.0)}), budget=12, seed=0)
    assert "excluded" in kept.failures
    free = worst_case(model, BOX, response=weighted({"load": 1.0, "travel": 2.0}), budget=2, start=kept.runs)
    for run in free.runs:
        outputs = model(**run.parameters)
        assert run.value == pytest.approx(outputs["load"] + 2 * outputs["travel"])


def test_failed_runs_stay_failed_and_keep_their_error():
    def brittle(a, b):
        if a > 1.5:
            raise RuntimeError("diverged")
        return a - b

    first = worst_case(brittle, BOX, budget=12, seed=0)
    again = given_outcomes(first.runs, BOX, response=None)
    assert {o.error for o in again if o.status == "failed"} == {"RuntimeError: diverged"}


def test_a_table_is_its_rows():
    table = pd.DataFrame(ROWS)
    found = worst_case(lambda a, b: a - b, BOX, budget=4, seed=0, start=table)
    assert [run.value for run in found.runs[:4]] == [0.0, 1.5, 0.0, 0.3]
    table["note"], table["time"] = "by hand", [1.0, float("nan"), 2.0, 3.0]
    found = worst_case(lambda a, b: {"y": a - b}, BOX, response="y", budget=4, seed=0, start=table)
    assert [run.value for run in found.runs[:4]] == [0.0, 1.5, 0.0, 0.3]


def test_several_responses_take_a_table():
    table = pd.DataFrame([{"a": r["a"], "b": r["b"], **model(r["a"], r["b"])} for r in ROWS])
    found = worst_cases(model, BOX, {"load": "max", "travel": "max"}, budget=10, start=table)
    assert found["load"].value == pytest.approx(4.0)


@pytest.mark.parametrize("missing", [None, float("nan")])
def test_a_row_without_its_value_is_a_run_that_failed(missing):
    found = worst_case(lambda a, b: a - b, BOX, budget=4, start=[*ROWS, {"a": 1.0, "b": 0.1, "y": missing}])
    assert found.failures == {"nonfinite": 1}


def test_a_run_without_outputs_is_its_value():
    run = Run(key="k", number=4, proposal="ei", parameters={"a": 1, "b": 1}, status="ok", value=3.0)
    assert given_outcomes([run], BOX, response="load")[0].outputs == {"load": 3.0}
    with pytest.raises(StudyError, match="row 1 of start holds no outputs to read a combination"):
        given_outcomes([run], BOX, response=weighted({"load": 1.0}))


@pytest.mark.parametrize(
    ("start", "response", "match"),
    [
        (
            [{**ROWS[0], "y": "high"}],
            None,
            "row 1 of start has y = 'high', but a response is a number. Leave",
        ),
        ([ROWS[1], {**ROWS[0], "y": "high"}], "y", "row 2 of start has y = 'high'"),
        ([{**ROWS[0], "note": "x"}], None, "row 1 of start has note = 'x', .* or say which one is searched"),
        ([ROWS[0]], "z", r"row 1 of start has no 'z'; beside the parameters it has \['y'\]"),
        (
            [{"a": 1.0, "b": 1.0}],
            None,
            r"row 1 of start holds no response beside its parameters \['a', 'b'\]",
        ),
        ([3.0], None, "row 1 of start needs a mapping of parameters and responses, .* got 3.0"),
        ("runs.csv", None, "start needs a sequence of runs or a table, got str"),
        ([{**ROWS[0], "a": None}], None, "run 1 of start is not in the space: "),
        ([{**ROWS[0], "a": "wide"}], None, "run 1 of start is not in the space: "),
    ],
)
def test_what_is_no_run_is_named(start, response, match):
    with pytest.raises(StudyError, match=match):
        worst_case(lambda a, b: a - b, BOX, response=response, budget=6, start=start)


def test_a_result_is_asked_for_its_runs():
    found = worst_case(lambda a, b: a - b, BOX, budget=6)
    with pytest.raises(StudyError, match=r"got WorstCase\. Give result.runs of another search"):
        worst_case(lambda a, b: a - b, BOX, budget=6, start=found)
