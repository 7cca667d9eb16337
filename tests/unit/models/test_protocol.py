"""Models: what counts as an answer, how functions are found, what a table of runs must hold."""

import math

import numpy as np
import pytest

from workbench.errors import EvaluationFailed, NotEnoughRuns, StudyError
from workbench.models.histories import History, Reduction
from workbench.models.opening import open_model
from workbench.models.protocol import (
    Answer,
    ModelSpec,
    call,
    settle,
)
from workbench.models.python import load_function, source_digest
from workbench.models.table import TableModel, read_table

NUMBERS = {"y": None}


@pytest.mark.parametrize(
    "raw", [3, 3.0, np.float32(3), np.int64(3), np.array(3.0), {"y": 3, "z": "more"}, True + 2]
)
def test_numbers_are_answers(raw):
    answer = settle(raw, NUMBERS)
    assert answer.outputs == {"y": 3.0}
    assert type(answer.outputs["y"]) is float


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (None, "response 'y' came as None; a number is needed"),
        ("3", "came as '3'"),
        (b"3", "came as b'3'"),
        (1j, "came as 1j"),
        ([1.0], r"came as \[1.0\]"),
        (np.array([3.0]), r"came as an array of shape \(1,\)"),
        ({"z": 1}, "returned no 'y', it returned z"),
        ({}, "it returned an empty mapping"),
        ({"y": {}}, "came as {}"),
        (object, "came as <class 'object'>"),
        (list(range(10_000)), r"came as \[0, 1, .*\.\.\.; a number"),
    ],
)
def test_anything_else_fails_with_what_came(raw, words):
    with pytest.raises(EvaluationFailed, match=words):
        settle(raw, NUMBERS)


def test_several_responses_need_names():
    with pytest.raises(EvaluationFailed, match=r"the model returned 3.0; a mapping with a, b is needed"):
        settle(3.0, {"a": None, "b": None})


@pytest.mark.parametrize("raw", [np.linspace(0.0, 1.0, 300), np.zeros((3, 2)), "two\nlines"])
def test_what_came_in_place_of_a_history_is_told_on_one_line(raw):
    with pytest.raises(
        EvaluationFailed, match=r"'y' came as .*; a pair \(time, values\) is needed$"
    ) as caught:
        settle({"y": raw}, {"y": Reduction(kind="max")})
    message = str(caught.value)
    assert "\n" not in message
    if isinstance(raw, np.ndarray):
        assert f"came as an array of shape {raw.shape};" in message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float64("nan")])
def test_what_is_not_finite_is_told_apart_from_failure(value):
    answer = settle(value, NUMBERS)
    assert answer.status == "nonfinite"
    assert answer.outputs == {}
    assert "not a finite number: y = " in answer.error


SQUARE = History([0.0, 1.0, 2.0], [0.0, -4.0, 2.0])


@pytest.mark.parametrize(
    ("reduction", "number"),
    [
        (Reduction(kind="max"), 2.0),
        (Reduction(kind="min"), -4.0),
        (Reduction(kind="max_abs"), 4.0),
        (Reduction(kind="final"), 2.0),
        (Reduction(kind="mean"), (-2.0 - 1.0) / 2),
        (Reduction(kind="at", at=0.25), -1.0),
        (Reduction(kind="at", at=2.0), 2.0),
        (Reduction(kind="norm", p=2), math.sqrt((8.0 + 10.0) / 2)),
        (Reduction(kind="norm", p=1), (2.0 + 3.0) / 2),
    ],
)
def test_histories_become_numbers(reduction, number):
    assert reduction.of(SQUARE) == pytest.approx(number)
    assert settle({"y": SQUARE}, {"y": reduction}).outputs == pytest.approx({"y": number})
    assert settle((SQUARE.time, SQUARE.values), {"y": reduction}).histories["y"] == SQUARE


def test_a_high_norm_does_not_overflow():
    assert Reduction(kind="norm", p=400).of(History([0, 1], [1e200, 1e200])) == pytest.approx(1e200)
    assert Reduction(kind="norm").of(History([0, 1], [0, 0])) == 0


def test_histories_that_are_none():
    with pytest.raises(EvaluationFailed, match="times and values alike, got 2 and 1"):
        Reduction(kind="max").of(History([0, 1], [1]))
    with pytest.raises(EvaluationFailed, match="runs from 0 to 2, its value at 3 does not exist"):
        Reduction(kind="at", at=3.0).of(SQUARE)
    with pytest.raises(EvaluationFailed, match=r"a pair \(time, values\) is needed"):
        settle(3.0, {"y": Reduction(kind="max")})
    assert settle(([0, 1], [1, math.nan]), {"y": Reduction(kind="max")}).status == "nonfinite"


def spec_of(tmp_path, function, names=("a",), responses=None):
    return ModelSpec(
        kind="python",
        options={"function": function},
        folder=str(tmp_path),
        names=names,
        responses=responses or NUMBERS,
        identity="m",
        version="1",
    )


def test_specs_travel_as_json(tmp_path):
    import json

    spec = spec_of(tmp_path, "m.py:f", responses={"y": Reduction(kind="norm", p=3), "z": None})
    assert ModelSpec.from_dict(json.loads(json.dumps(spec.to_dict()))) == spec


def test_a_function_of_a_file_is_found_with_its_neighbours(tmp_path):
    (tmp_path / "neighbour_of_m.py").write_text("factor = 3")
    (tmp_path / "m.py").write_text("from neighbour_of_m import factor\ndef f(a): return factor * a")
    spec = spec_of(tmp_path, "m.py:f")
    assert call(open_model(spec), spec, {"a": 2.0}).outputs == {"y": 6.0}
    assert source_digest("m.py:f", tmp_path) != ""
    assert source_digest("json:loads", tmp_path) != ""
    assert source_digest("no_such_module:f", tmp_path) == ""


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ("f", "needs the form 'module:name' or 'file.py:name'"),
        ("gone.py:f", "no file .*gone.py"),
        ("m.py:peek", "m.py has no 'peek'. Did you mean 'peak'"),
        ("m.py:number", "'number' is a int, not a function"),
        ("no_such_module_here:f", "no module 'no_such_module_here'"),
        ("json.nothing:f", "no module 'json.nothing'"),
        ("broken.py:f", "importing broken.py failed: ZeroDivisionError"),
        ("leaves.py:f", "importing leaves.py failed: SystemExit"),
        ("needs.py:f", "importing needs.py failed: No module named 'no_such_thing'"),
        ("m.py:other", r"other\(b\) cannot be called with the study's parameters a"),
    ],
)
def test_functions_that_cannot_be_used(tmp_path, function, words):
    (tmp_path / "m.py").write_text("number = 3\ndef peak(a): return a\ndef other(b): return b")
    (tmp_path / "broken.py").write_text("1 / 0")
    (tmp_path / "leaves.py").write_text("raise SystemExit(3)")
    (tmp_path / "needs.py").write_text("import no_such_thing")
    with pytest.raises(StudyError, match=words):
        open_model(spec_of(tmp_path, function))


def test_functions_in_c_are_called_as_they_are(tmp_path):
    assert load_function("math:hypot", tmp_path) is math.hypot


@pytest.mark.parametrize(
    ("body", "status", "words"),
    [
        ("raise ValueError('too stiff')", "failed", "ValueError: too stiff"),
        ("raise SystemExit(3)", "failed", "SystemExit: 3"),
        ("raise MemoryError", "failed", "ran out of memory"),
        ("return float('nan')", "nonfinite", "y = nan"),
        ("return None", "failed", "came as None"),
        ("raise ValueError('x' * 10**6)", "failed", "xxx"),
    ],
)
def test_calls_never_raise(tmp_path, body, status, words):
    (tmp_path / "m.py").write_text(f"def f(a):\n    {body}")
    spec = spec_of(tmp_path, "m.py:f")
    answer = call(open_model(spec), spec, {"a": 1.0})
    assert isinstance(answer, Answer)
    assert answer.status == status
    assert words in answer.error
    assert len(answer.error) <= 4000
    if "stiff" in words:
        assert "m.py" in answer.log  # the place of the error


HEADER = "a,b,y\n"
ROWS = "1,2,3\n2,2,4\n3,2,5\n"


def table(tmp_path, text, **options):
    path = tmp_path / "runs.csv"
    path.write_text(text)
    return read_table(path, ("a", "b"), ("y",), **options)


def test_a_table_is_read_by_name(tmp_path):
    rows = table(tmp_path, "note,y,b,a\nhello,3,2,1\n\nx,4,2,2\n,5,2,3\n")
    assert rows == [
        {"a": 1.0, "b": 2.0, "y": 3.0},
        {"a": 2.0, "b": 2.0, "y": 4.0},
        {"a": 3.0, "b": 2.0, "y": 5.0},
    ]
    assert table(tmp_path, "A [m],b,y\n" + ROWS, columns={"a": "A [m]"})[0]["a"] == 1.0
    assert table(tmp_path, "\ufeff" + HEADER + ROWS)[0]["a"] == 1.0
    assert table(tmp_path, HEADER + "1,flat,3\n2,bump,4\n1,bump,9\n", words=("b",))[1]["b"] == "bump"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,y\n1,3\n", r"runs.csv has no column 'b'; it has a, y. Rename"),
        (
            "a;b;y\n1;2;3\n",
            r"runs.csv separates its columns by ';', a table does so by commas. Save it as CSV",
        ),
        ("a\tb\ty\n1\t2\t3\n", r"runs.csv separates its columns by '.t', a table does so by commas"),
        (HEADER + "1,two,3\n" + ROWS, "runs.csv, line 2: column 'b' needs a number, got 'two'"),
        (
            HEADER + ROWS + "4,3.5 MPa,3\n",
            r"line 5: column 'b' needs a number, got '3.5 MPa'. Write the number alone, 3.5; the unit 'MPa' ",
        ),
        (
            HEADER + ROWS + '4,3,"1,234.5"\n',
            r"column 'y' needs a number, got '1,234.5'. Write it without commas and with a decimal point, su",
        ),
        (
            HEADER + ROWS + '4,3,"0,25"\n',
            r"got '0,25'. Write it without commas and with a decimal point, such as 0.25",
        ),
        (HEADER + ROWS + "4,,3\n", "line 5: column 'b' needs a number, got an empty cell. Fill it in or rem"),
        (HEADER + "1,nan,3\n" + ROWS, "line 2: column 'b' needs a finite number, got nan. Remove the row"),
        (HEADER + "4,2,n/a\n" + ROWS, "line 2: column 'y' needs a number, got 'n/a'. Leave the cell empty"),
        (HEADER + "1,2\n" + ROWS, "line 2: 2 cells where the header has 3"),
        (HEADER + ROWS + "1,2,9\n", r"lines 2 and 5 hold the same parameters\. .* put the mean of the resp"),
        (HEADER + ROWS + ROWS, "lines 2 and 5 hold the same parameters, and 2 more pairs"),
        (
            HEADER + "1,2,3\n2,2,3\n3,2,3\n",
            r"is 3 in every row; .*\. Leave that \[\[response\]\] out, or add",
        ),
        ("a,b,b,y\n", "has the column 'b' twice"),
        ("", "is empty; its first line names the columns"),
    ],
)
def test_what_a_table_refuses(tmp_path, text, words):
    with pytest.raises(StudyError, match=words):
        table(tmp_path, text)


def test_points_that_repeat_need_no_mean(tmp_path):
    (tmp_path / "points.csv").write_text("a,b\n1,2\n2,2\n3,2\n1,2\n")
    with pytest.raises(StudyError, match=r"lines 2 and 5 hold the same parameters\. Remove one$"):
        read_table(tmp_path / "points.csv", ("a", "b"), ())


def test_a_response_without_a_number_is_a_failed_run(tmp_path):
    rows = table(tmp_path, HEADER + ROWS + "4,2,\n5,2,NaN\n6,2,-inf\n")
    assert rows[3] == {"a": 4.0, "b": 2.0, "y": None}
    assert not any(np.isfinite(row["y"]) for row in rows[4:])


def test_tables_need_three_runs_and_a_file(tmp_path):
    with pytest.raises(NotEnoughRuns, match=r"runs.csv has 4 runs, 2 of them failed; at least 3 are needed"):
        table(tmp_path, HEADER + "1,2,3\n2,2,4\n3,2,\n4,2,nan\n")
    with pytest.raises(NotEnoughRuns, match=r"runs.csv has 2 runs; at least 3 are needed"):
        table(tmp_path, HEADER + "1,2,3\n2,2,4\n")
    with pytest.raises(StudyError, match=r"no table .*gone.csv"):
        read_table(tmp_path / "gone.csv", ("a",), ("y",))
    (tmp_path / "latin.csv").write_bytes(b"a,y\n\xff,1\n")
    with pytest.raises(StudyError, match="not text in UTF-8"):
        read_table(tmp_path / "latin.csv", ("a",), ("y",))
    (tmp_path / "zero.csv").write_bytes(b"a,y\n\0,1\n")
    with pytest.raises(StudyError, match=r"column 'a' needs a number|cannot read the table"):
        read_table(tmp_path / "zero.csv", ("a",), ("y",))


def test_a_table_runs_nothing_new(tmp_path):
    (tmp_path / "runs.csv").write_text(HEADER + ROWS)
    spec = ModelSpec(
        kind="table",
        options={"file": "runs.csv"},
        folder=str(tmp_path),
        names=("a", "b"),
        responses=NUMBERS,
        identity="t",
        version="1",
    )
    model = TableModel.opened(spec)
    assert call(model, spec, {"a": 2.0, "b": 2.0}).outputs == {"y": 4.0}
    assert "a table cannot run anything new" in call(model, spec, {"a": 2.5, "b": 2.0}).error


def test_numbers_as_fortran_writes_them_stand_in_a_table(tmp_path):
    rows = table(tmp_path, HEADER + ROWS + "4,1.5D+00,-.25d-1\n")
    assert (rows[3]["b"], rows[3]["y"]) == (1.5, -0.025)
