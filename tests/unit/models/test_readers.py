"""The table of readers: what each finds in a file, what it refuses, and its rule in a study."""

import pytest

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.histories import History
from workbench.models.readers import KEYS, READERS, checked_rule, read_response

REQUESTS = """! comment
REQUEST belt
TIME FX FM
0.0 1 2
1.0 -5.5D+00 7

REQUEST head
TIME DX
0.0 3
"""

READ = [
    ({"kind": "json", "key": "a.0.b"}, '{"a": [{"b": 3.5}]}', False, 3.5),
    ({"kind": "json", "key": "h"}, '{"h": {"time": [0, 1], "values": [2, 3]}}', True, ([0, 1], [2, 3])),
    ({"kind": "csv", "column": "F"}, "t,F\n0.5,3\n", False, 3.0),
    ({"kind": "csv", "column": "F"}, "t,G,F,G\n0,1,3,2\n", False, 3.0),
    ({"kind": "csv", "column": "F"}, "t, F\n0,3\n1,4\n", True, History([0.0, 1.0], [3.0, 4.0])),
    ({"kind": "csv", "column": "t", "time": "F"}, "t,F\n0,3\n1,4\n", True, History([3.0, 4.0], [0.0, 1.0])),
    ({"kind": "columns", "column": 2, "skip": 1}, "a header\n 0 7.5\n", False, 7.5),
    ({"kind": "columns", "column": 2, "time": 1}, "0 7\n1 8\n", True, History([0.0, 1.0], [7.0, 8.0])),
    ({"kind": "columns", "characters": [3, 6]}, "ab12.5cd\n", False, 12.5),
    (
        {"kind": "columns", "characters": [2, 3], "time_characters": [1, 1]},
        "011\n122",
        True,
        History([0, 1], [11, 22]),
    ),
    ({"kind": "columns", "characters": [2, 3]}, "011\n122\n", True, History([0, 1], [11, 22])),
    ({"kind": "regex", "pattern": r"peak = (\S+)"}, "peak = 1\npeak = 2e3\n", False, 2000.0),
    ({"kind": "regex", "pattern": r"peak = (\S+)", "which": "first"}, "peak = 1\npeak = 2\n", False, 1.0),
    ({"kind": "request", "request": "belt", "column": "FX"}, REQUESTS, True, History([0, 1], [1, -5.5])),
    ({"kind": "request", "request": "head", "column": "DX"}, REQUESTS, False, 3.0),
]  # fmt: skip


@pytest.mark.parametrize(("rule", "text", "history", "found"), READ)
def test_readers(tmp_path, rule, text, history, found):
    (tmp_path / "out").write_text(text)
    got = read_response({**rule, "file": "out"}, tmp_path, tmp_path, history=history)
    assert (tuple(got) if isinstance(found, tuple) else got) == found


WRONG = [
    ({"kind": "json", "key": "a.c"}, '{"a": {"b": 1}}', False, r"out has no 'a.c' \(at 'c'\)"),
    ({"kind": "json", "key": "a"}, "{", False, "out is not JSON"),
    ({"kind": "json", "key": "a"}, "[" * 100_000, False, "out is not JSON"),
    ({"kind": "csv", "column": "F"}, "t,G\n0,1\n", False, "out has no column 'F'; it has t, G"),
    ({"kind": "csv", "column": "F"}, "t,F\n0,1\n1,2\n", False, "out holds 2 values; say which with reduce"),
    ({"kind": "csv", "column": "F"}, "t,F\n0\n", True, "a row of 1 cell under 2 columns; was it cut off"),
    (
        {"kind": "csv", "column": "F"},
        "t,F,F\n0,1,2\n",
        False,
        "out has 2 columns 'F'; give each a name of its",
    ),
    (
        {"kind": "csv", "column": "F"},
        "t,t,F\n0,1,2\n",
        True,
        "out has 2 columns 't'; give each a name of its",
    ),
    ({"kind": "csv", "column": "F"}, "t,F\n0,1_000\n", False, "out: '1_000' is no number"),
    (
        {"kind": "csv", "column": "F"},
        "t;F\n0,5;1,5\n",
        False,
        "out separates its columns by ';', kind = 'csv' reads them by commas; have them written so, or",
    ),
    ({"kind": "csv", "column": "F"}, "t\tF\n0\t1\n", False, r"out separates its columns by '\\t'"),
    (
        {"kind": "request", "request": "belt", "column": "FX"},
        REQUESTS.replace("FM", "FX"),
        True,
        "out has 2 columns 'FX'",
    ),
    ({"kind": "csv", "column": "F"}, "t,F\n0,abc\n", True, "out: 'abc' is no number"),
    ({"kind": "csv", "column": "F"}, "", True, "out is empty"),
    ({"kind": "columns", "column": 3}, "1 2\n", False, "out has lines without a column 3"),
    ({"kind": "columns", "characters": [9, 12]}, "1 2\n", False, "out: '' is no number"),
    ({"kind": "regex", "pattern": "peak (.*)"}, "nothing", False, "out: nothing matches 'peak "),
    (
        {"kind": "request", "request": "x", "column": "y"},
        REQUESTS,
        True,
        "has no request 'x'; it has belt, head",
    ),
    (
        {"kind": "request", "request": "q", "column": "y"},
        "REQUEST q\nFX\n",
        True,
        "names that begins with TIME",
    ),
]


@pytest.mark.parametrize(("rule", "text", "history", "words"), WRONG)
def test_readers_say_what_is_wrong(tmp_path, rule, text, history, words):
    (tmp_path / "out").write_text(text)
    with pytest.raises(EvaluationFailed, match=words):
        read_response({**rule, "file": "out"}, tmp_path, tmp_path, history=history)


def test_readers_and_files_that_are_none(tmp_path, monkeypatch):
    rule = {"kind": "json", "key": "a", "file": "out"}
    with pytest.raises(EvaluationFailed, match="the run left no result file out"):
        read_response(rule, tmp_path, tmp_path, history=False)
    (tmp_path / "out").write_bytes(bytes(range(256)))
    with pytest.raises(EvaluationFailed, match="the result file out is not text in utf-8"):
        read_response(rule, tmp_path, tmp_path, history=False)
    monkeypatch.setattr("workbench.models.readers.LARGEST", 10)
    with pytest.raises(EvaluationFailed, match="has 256 bytes or is no file; at most 10 are read"):
        read_response(rule, tmp_path, tmp_path, history=False)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_byte_order_mark_says_what_a_file_is_written_in(tmp_path, encoding):
    (tmp_path / "out").write_bytes("Kräfte,y\n1,2.5\n".encode(encoding))
    rule = {"kind": "csv", "file": "out", "column": "Kräfte"}
    assert read_response(rule, tmp_path, tmp_path, history=False) == 1.0


def test_an_encoding_may_be_named(tmp_path):
    (tmp_path / "out").write_bytes("Kräfte,y\n1,2.5\n".encode("latin-1"))
    rule = {"kind": "csv", "file": "out", "column": "Kräfte"}
    with pytest.raises(EvaluationFailed, match=r'is not text in utf-8 \(byte 2\); .*encoding = "latin-1"'):
        read_response(rule, tmp_path, tmp_path, history=False)
    named = checked_rule("y", {**rule, "encoding": "latin-1"}, reduced=False)
    assert read_response(named, tmp_path, tmp_path, history=False) == 1.0
    with pytest.raises(StudyError, match="Python knows no encoding 'klingon'; give one such as utf-8"):
        checked_rule("y", {**rule, "encoding": "klingon"}, reduced=False)
    with pytest.raises(StudyError, match="takes no encoding"):
        checked_rule("y", {"kind": "python", "function": "m.py:f", "encoding": "utf-8"}, reduced=False)


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ({"kind": "json", "file": "o"}, "read of kind 'json' needs key; its keys are encoding, file, key"),
        ({"kind": "json", "file": "o", "key": "a", "column": 3}, "takes no column"),
        ({"kind": "columns", "file": "o"}, "needs column or characters"),
        ({"kind": "columns", "file": "o", "characters": [3, 1]}, r"needs first and last, such as \[11, 22\]"),
        (
            {"kind": "columns", "file": "o", "column": "F"},
            "column is the number of a column, from 1, got 'F'",
        ),
        ({"kind": "csv", "file": "o", "column": 3}, "column is the name of a column, got 3"),
        ({"kind": "regex", "file": "o", "pattern": "("}, "unterminated subpattern|missing"),
        (
            {"kind": "regex", "file": "o", "pattern": "y="},
            r"response 'y': pattern 'y=' needs parentheses around the number, such as 'peak = \(\\S\+\)'",
        ),
        (
            {"kind": "json", "file": "../../o", "key": "y"},
            r"response 'y': read.file '../../o' needs to be a path inside the run's folder, without '..' or",
        ),
        (
            {"kind": "csv", "file": "/elsewhere/o", "column": "y"},
            "read.file '/elsewhere/o' needs to be a path inside the",
        ),
    ],
)
def test_rules_are_checked_with_the_study(rule, words):
    with pytest.raises(StudyError, match=words):
        checked_rule("y", rule, reduced=False)
    with pytest.raises(StudyError, match="finds one number; leave reduce out"):
        checked_rule("y", {"kind": "regex", "file": "o", "pattern": "a"}, reduced=True)


@pytest.mark.parametrize("kind", READERS)
def test_the_keys_of_every_reader_are_known_and_tried(kind):
    reader = READERS[kind]
    assert {*reader.needs, *reader.may} <= set(KEYS)
    assert f"`{reader.needs[0]}" in reader.keys
    assert kind in {rule["kind"] for rule, *_ in READ} | {"python"}


def test_a_function_of_the_study_reads_the_folder_of_the_run(tmp_path):
    (tmp_path / "post.py").write_text("def size(work): return len((work / 'out').read_text())")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "out").write_text("seven..")
    rule = checked_rule("y", {"kind": "python", "function": "post.py:size"}, reduced=False)
    assert read_response(rule, tmp_path / "run", tmp_path, history=False) == 7
