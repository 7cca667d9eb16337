"""Study files: what is read, and which words a wrong one meets."""

import json
from typing import get_args

import pytest

from workbench.errors import StudyError
from workbench.study.loading import json_schema, load_study, parse_study
from workbench.study.messages import ELSEWHERE, key_path
from workbench.study.schema import PATTERNS, StudySchema
from workbench.study.toml_lines import find_line

GOOD = """\
[study]
name = "spring"
seed = 7

[model]
kind = "python"
function = "model.py:peak"

[[parameter]]
name = "k"
baseline = 100.0
factor = [0.5, 2.0]
unit = "N/m"

[[parameter]]
name = "road"
kind = "categorical"
levels = ["flat", "bump"]

[[response]]
name = "x"
unit = "m"
reduce = "at"
at = 0.5

[design]
kind = "ihs"
runs = 20

[evaluate]
memory = "1.5 GB"

[screen]
response = "x"
"""


def test_a_study_is_read_with_defaults_resolved(tmp_path):
    path = tmp_path / "spring.toml"
    path.write_text(GOOD)
    study = load_study(path)
    assert (study.name, study.seed, study.space.names) == ("spring", 7, ("k", "road"))
    assert study.campaign_folder == tmp_path / "spring.holdfast"
    assert study.reductions["x"].at == 0.5
    assert study.evaluate == {"engine": "processes", "workers": 1, "retries": 0, "memory": "1.5 GB"}
    assert study.memory_bytes == 1_500_000_000
    assert study.worst_case is None
    json.dumps(study.to_dict())
    assert len(study.hash) == 32


def test_the_identity_of_a_model_does_not_hold_its_place(tmp_path):
    specs = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "s.toml").write_text(GOOD)
        specs.append(load_study(tmp_path / name / "s.toml").spec(version="1"))
    assert specs[0].identity == specs[1].identity
    assert specs[0].folder != specs[1].folder


CHANGES = [
    ("seed = 7", "sed = 7", r"study, line 3: unknown key study.sed. Did you mean 'seed'\?"),
    ("seed = 7", "seed = -1", "line 3: study.seed needs a number >= 0, got -1"),
    ("seed = 7", 'seed = "7"', "line 3: study.seed needs a whole number, got '7'"),
    ('name = "spring"', "", "line 1: study.name is missing"),
    ('name = "spring"', 'name = "../up"', "line 2: study.name needs 1 to 100 letters a to z, digits"),
    ('name = "spring"', 'name = "Pr\u00fcfung"', "a letter or digit first; a title holds others, got 'Pr"),
    ('kind = "python"', 'kind = "pyton"', r"line 6: model.kind is one of python, .*got 'pyton'"),
    ('kind = "python"\n', "", "line 5: model.kind is missing; it is one of python"),
    ('function = "model.py:peak"', 'fnction = "a"', "line 7: unknown key model.fnction. Did you mean 'fu"),
    ("factor = [0.5, 2.0]", "factor = [2.0, 0.5]", r"line 9: parameter 'k' needs factor\[0\] < factor\[1\]"),
    ("baseline = 100.0", "lower = 5\nupper = 1", "line 9: parameter 'k': factor goes with baseline"),
    ("baseline = 100.0\nfactor = [0.5, 2.0]", "lower = 5\nupper = 5",
     "line 9: parameter 'k' needs lower < upper, got lower=5 and upper=5 N/m"),
    ("baseline = 100.0", "baseline = nan", r"line 11: parameter\[1\].baseline needs"),
    ('name = "road"', 'name = "lambda"', "line 15: parameter name 'lambda' is a word of Python's own, which "
     "no argument can be called; take another, such as 'lambda_'"),
    ('name = "road"', 'name = "2k"', "line 15: parameter name '2k' needs letters, digits and underscores, n"),
    ('name = "road"', 'name = "k"', "parameter 'k' is given twice"),
    ('unit = "N/m"', "unit = 3", r"line 13: parameter\[1\].unit needs text in quotes, got 3"),
    ('unit = "m"\n', 'unt = "m"\n', r"line 22: unknown key response\[1\].unt. Did you mean 'unit'\?"),
    ('name = "x"', 'name = "k"', "line 20: response 'k' is given twice or has the name of a parameter"),
    ("at = 0.5\n", "", "line 20: response 'x': reduce = 'at' and the time at = ... go together"),
    ('reduce = "at"\n', "", "line 20: response 'x': at goes with reduce"),
    ('reduce = "at"\nat = 0.5', 'reduce = "max"\np = 3', "line 20: response 'x': p goes with reduce"),
    ("[screen]", "[screen]\nn_selected = 0", r"screen\.n_selected"),
    ("[screen]", "[screen]\nn_selected = 3", r"n_selected needs a number from 1 to 2, got 3"),
    ("[screen]", '[screen]\ngroups = [["k"]]', r"screen\.groups"),
    ("[screen]", '[screen]\ngroups = [["k", "rode"]]', r"groups name parameter 'rode', which the study"),
    ("[screen]", '[screen]\ngroups = [["k", "k"]]', r"groups name parameter 'k' twice; a parameter belongs"),
    ("[screen]", "[scren]", r"unknown key scren. Did you mean 'screen'\?"),
    ('response = "x"', 'response = "y"', "line 34: no response 'y'; the responses are x"),
    ('memory = "1.5 GB"', 'memory = "much"', "line 31: evaluate.memory needs a size such as '1.5 GB'"),
    ("runs = 20", "runs = 100000000000", "line 28: design.runs needs a number <= 10000000, got 100000000000"),
    ("runs = 20", "runs = 20\nup_to = 5", r"line 29: \[design\] up_to needs runs or more, at most 2000; got"),
    ('kind = "ihs"', 'kind = "lsh"', "line 27: design kind needs one of lhs, optimised_lhs, .*got 'lsh'"),
    ("runs = 20\n", "", "line 27: design kind 'ihs' needs runs >= 1, got None"),
    ("runs = 20", "runs = 20\nlevels = 3", "line 27: design kind 'ihs' does not take 'levels'; it takes d"),
    ('kind = "ihs"', 'file = "a.csv"', "line 26: design kind 'optimised_lhs' takes no file; a design in a C"),
    ('kind = "ihs"', 'kind = "table"', "line 27: design kind 'table' needs file, a CSV with a column per p"),
    ("baseline = 100.0\nfactor = [0.5, 2.0]", "lower = 1\nupper = 5\nbaseline = 9.0",
     "line 13: baseline = 9.0: parameter 'k' lies between 1 and 5 N/m, got 9. Correct it, or widen the bou"),
    ("baseline = 100.0\nfactor = [0.5, 2.0]", 'kind = "categorical"\nlevels = ["a", "b"]\nbaseline = "c"',
     r"line 13: parameter 'k': baseline is one of \['a', 'b'\], got 'c'"),
    ('kind = "python"\nfunction = "model.py:peak"', 'kind = "table"\nfile = "a.csv"\ncolumns = { X = "S" }',
     r"line 8: \[model\] columns names 'X', which is none of the study's parameters and responses: k, .*, x"),
    ('kind = "python"\nfunction = "model.py:peak"',
     'kind = "fmu"\nfile = "a.fmu"\nstop_time = 1\nvariables = { x = "S" }',
     r"line 9: \[model\] variables names 'x', which is none of the study's parameters: k, road"),
    ('kind = "python"\nfunction = "model.py:peak"',
     'kind = "fmu"\nfile = "a.fmu"\nstop_time = 1\nkeep = ["v"]\noutputs = { v = "V", xx = "S" }',
     r"line 10: \[model\] outputs names 'xx', which is none of the study's responses: x, v. Did you mean"),
    ("baseline = 100.0\nfactor = [0.5, 2.0]", "min = 1\nmax = 5", r"\[1\].min. Did you mean 'lower'\?"),
    ("runs = 20", "runs = 0", "line 28: design.runs needs a number >= 1, got 0"),
    ("[design]", "[design", r"study is not TOML: .*line 26, column 8\)$"),
    ("[[parameter]]", "[parameter]\nname = 'z'\n[parameter]",
     r"not TOML: .*line 11, column 11\). One of several has double brackets: \[\[parameter\]\]$"),
    ("baseline = 100.0", "baseline = 100,0", r"not TOML: .*\). Numbers have a decimal point: 100.0$"),
    ('kind = "python"', "kind = python  # ours", r'not TOML: .*\). Words stand in quotes: kind = "python"$'),
    ("runs = 20", "samples = 20", r"unknown key design.samples. Did you mean 'runs'\?"),
    ("runs = 20", "runs = 20\nbeans = 3", "unknown key design.beans. Known keys here: kind, runs"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), CHANGES, ids=[c[2][:45] for c in CHANGES])
def test_what_a_study_refuses(old, new, words):
    assert old in GOOD
    with pytest.raises(StudyError, match=words):
        parse_study(GOOD.replace(old, new, 1))


def test_all_errors_are_told_at_once():
    with pytest.raises(StudyError) as info:
        parse_study(GOOD.replace("seed", "sed").replace("runs", "rns"))
    assert "study.sed" in str(info.value)
    assert "design.rns" in str(info.value)


def test_files_that_are_no_study(tmp_path):
    (tmp_path / "other.toml").write_text(GOOD)
    with pytest.raises(StudyError, match=r"no study file .*s.toml; in .* there are other.toml"):
        load_study(tmp_path / "s.toml")
    with pytest.raises(StudyError, match=r"^\S+ is a folder; give a study file"):
        load_study(tmp_path)
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(StudyError, match=r"not text in UTF-8 \(byte 0\)"):
        load_study(tmp_path / "b.toml")
    with pytest.raises(StudyError, match="is not TOML that can be read: nested too deeply"):
        parse_study("a = " + "[" * 100_000)


def test_unknown_constraints_and_names_are_placed():
    with pytest.raises(StudyError, match="line 1: constraint 'k < z' names 'z'"):
        parse_study('constraint = ["k < z"]\n' + GOOD)


def test_lines_are_found_through_arrays_of_tables_and_long_strings():
    text = 'a = """\n[b]\nx = 1\n"""\n[b]\nx.y = 1\n[[c]]\n[c.d]\nz = 1\n[[c]]\n[c.d]\nz = 2\n'
    assert find_line(text, ("b", "x", "y")) == 6
    assert find_line(text, ("c", 1, "d", "z")) == 12
    assert find_line(text, ("c", 0, "d", "nothing")) == 8
    assert find_line(text, ("q",)) is None
    assert key_path(("c", 0, "d", "z")) == "c[1].d.z"


def test_the_schema_is_offered_to_editors():
    schema = json_schema()
    assert {"study", "model", "parameter", "response"} <= set(schema["required"])


def test_the_options_of_a_design_are_those_of_the_designs():
    from workbench.sampling.kinds import DesignOptions
    from workbench.study.schema import DesignTable

    options = set(DesignOptions.__dataclass_fields__)
    assert options <= set(DesignTable.model_fields) - {"kind", "runs", "file"}


def test_every_pattern_of_the_schema_is_told_in_words():
    def patterns(part):
        inner = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
        own = part.get("pattern") if isinstance(part, dict) else None
        return set().union(*map(patterns, inner)) | ({own} if isinstance(own, str) else set())

    assert patterns(json_schema()) == set(PATTERNS)


def test_words_of_other_programs_lead_to_keys_that_there_are():
    known = {key for table in StudySchema.model_fields.values() for key in _keys(table.annotation)}
    assert {key for keys in ELSEWHERE.values() for key in keys} <= known


def _keys(annotation):
    fields = getattr(annotation, "model_fields", {})
    return {*fields, *(key for part in get_args(annotation) for key in _keys(part))}
