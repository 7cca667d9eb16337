"""Every value that a study file may hold wrongly is refused in the words of a study file."""

import copy

import pytest

from workbench.errors import StudyError
from workbench.study.expectations import EXPECTED, expected
from workbench.study.messages import validated
from workbench.study.schema import StudySchema, Table

LIBRARY = ("Input", "should", "validation", "valid ", "dictionary", "string", "instance", "Error")
ODD = (
    "",
    "x" * 2000,
    0,
    -1,
    10**30,
    1.5,
    True,
    [],
    [1],
    [[]],
    ["a"] * 3,
    {},
    {"": 1},
    {"a": []},
    float("nan"),
)
TABLES = ("evaluate", "screen", "worst_case", "layout", "robust", "robust_layout", "report", "design")
GOOD = {
    "study": {"name": "s"},
    "model": {"kind": "command", "command": ["true"]},
    "parameter": [{"name": "a", "lower": 0.0, "upper": 1.0}],
    "response": [{"name": "y", "read": {"kind": "json", "file": "o", "key": "y"}}],
}
MODELS = (
    {"kind": "python", "function": "m.py:f"},
    {"kind": "fmu", "file": "a.fmu", "stop_time": 1.0},
    {"kind": "table", "file": "a.csv"},
    {"kind": "ask"},
    GOOD["model"],
)


def refusals(data):
    try:
        validated(data, "", "s")
    except StudyError as exc:
        return str(exc).splitlines()
    return []


def keys_of(name, classes):
    found = next(c for c in classes if c.__name__ == name)
    return [field.alias or key for key, field in found.model_fields.items()]


def wrong_studies():
    classes = Table.__subclasses__()
    for odd in ODD:
        for name in StudySchema.model_fields:
            yield {**GOOD, name: odd}
        for table in TABLES:
            kind = "".join(word.title() for word in table.split("_")) + "Table"
            for key in keys_of(kind, classes):
                yield {**GOOD, table: {key: odd}}
        for model in MODELS:
            for key in keys_of(f"{model['kind'].title()}Table", classes):
                yield {**GOOD, "model": {**model, key: odd}}
        for table, kind in (("parameter", "ParameterTable"), ("response", "ResponseTable")):
            for key in keys_of(kind, classes):
                yield {**GOOD, table: [{**GOOD[table][0], key: odd}]}
        for key in keys_of("ReadTable", classes):
            changed = copy.deepcopy(GOOD)
            changed["response"][0]["read"][key] = odd
            yield changed
        yield {**GOOD, "model": {**GOOD["model"], "templates": [{"from": odd, "to": odd, "style": odd}]}}
        yield {**GOOD, "model": {**GOOD["model"], "state": {"include": odd, "environment": odd}}}


def test_no_word_of_the_library_reaches_whoever_writes_a_study():
    lines = [line for data in wrong_studies() for line in refusals(data)]
    assert len(lines) > 1000
    # what came may be any text; what was expected stands before it
    told = {line.split(", got ")[0] for line in lines}
    assert [line for line in told if any(word in line for word in LIBRARY)] == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parameter": [{"name": ""}]}, r"parameter\[1\].name needs text of at least 1 character, got ''"),
        (
            {"screen": {"response": "y", "groups": [["a"]]}},
            r"groups\[1\] needs at least 2 items, got \['a'\]",
        ),
        ({"model": {"kind": "command", "command": []}}, r"s: model.command needs at least 1 item, got \[\]"),
        (
            {"model": {"kind": "command", "command": "run"}},
            "model.command needs a list in brackets, got 'run'",
        ),
        (
            {"parameter": {"a": {"lower": 1.0}}},
            r"s: parameter needs a table \[\[parameter\]\] for each, with its name inside, got \{'a'",
        ),
        (
            {"response": {"name": "y"}},
            r"s: response needs a table \[\[response\]\] for each, with its name inside, got",
        ),
        ({"worst_case": {"weights": {}}}, "worst_case.weights needs at least 1 entry, got {}"),
        ({"evaluate": {"workers": 1.5}}, "evaluate.workers needs a whole number, got 1.5"),
        ({"evaluate": {"timeout": 0.0}}, "evaluate.timeout needs a number > 0, got 0.0"),
        ({"layout": {"problem": "p", "scenarios": 1}}, "layout.scenarios needs true or false, got 1"),
        (
            {"parameter": [{"name": "a", "baseline": []}]},
            r"baseline needs a number or text in quotes, got \[\]",
        ),
        ({"report": 3}, "report needs a table such as { name = value }, got 3"),
        ({"study": {"name": "s", "seed": 2**63}}, "study.seed needs a number < 9223372036854775808, got 92"),
        ({"report": {"title": "x" * 2000}}, "report.title needs text of at most 1000 characters, got 'xx"),
        ({"worst_case": {"within": {"y": [1, 2, 3]}}}, r"within.y needs at most 2 items, got \[1, 2, 3\]"),
        ({"parameter": [{"name": "a", "lower": float("inf")}]}, "lower needs a finite number, got inf"),
    ],
)
def test_what_a_key_needs(change, words):
    with pytest.raises(StudyError, match=words):
        validated({**GOOD, **change}, "", "s")


def test_a_refusal_without_words_of_ours_keeps_those_of_the_library():
    assert "date_type" not in EXPECTED
    assert expected({"type": "date_type", "msg": "Input should be a valid date"}).endswith("a valid date")
