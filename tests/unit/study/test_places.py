"""The line of the study file in what an opened model refuses, wherever it is opened."""

import pytest

from workbench.errors import StudyError
from workbench.stages.campaign import Campaign
from workbench.stages.validation import check_study
from workbench.study.loading import load_study

STUDY = """[study]
name = "s"
[design]
runs = 4
[model]
kind = "python"
{model}
[[parameter]]
name = "a"
lower = 0.0
upper = 1.0
[[response]]
name = "y"
[evaluate]
engine = "{engine}"
"""


@pytest.mark.parametrize("engine", ["processes", "inline"])
@pytest.mark.parametrize(
    ("model", "words"),
    [
        ('function = "m.py"', "s.toml, line 7: function 'm.py' needs the form 'module:name'"),
        ('function = "gone.py:f"', "s.toml, line 7: no file .*gone.py: function 'gone.py:f' is looked up"),
        ('function = "m.py:g"', "s.toml, line 7: function 'm.py:g': m.py has no 'g'"),
        (
            'function = "m.py:other"',
            r"s.toml, line 7: other\(b\) cannot be called with the study's parameters",
        ),
        ('function = "nowhere:f"', "s.toml, line 7: no module 'nowhere': the function is said to stand in"),
        ('function = "m.py:f"\ngradient = "m.py:slope"', "s.toml, line 8: function 'm.py:slope': m.py has"),
    ],
)
def test_a_function_is_refused_at_its_line(tmp_path, engine, model, words):
    (tmp_path / "m.py").write_text("def f(a): return a\ndef other(b): return b\n")
    (tmp_path / "s.toml").write_text(STUDY.format(model=model, engine=engine))
    with pytest.raises(StudyError, match=words):
        check_study(load_study(tmp_path / "s.toml"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign, pytest.raises(StudyError, match=words):
        campaign.run()


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        (
            '[screen]\nresponse = "y"\nmethod = "welsh"',
            "s.toml, line 18: screening method needs one of default, forward, welch, got 'welsh'",
        ),
        (
            '[worst_case]\nresponse = "y"\nenclosure = "m.py"',
            r"s.toml, line 18: \[worst_case\] enclosure: function 'm.py' needs the form 'module:name'",
        ),
        (
            '[layout]\nproblem = "studies.trusses:cantilever"\nmethod = "gasao"',
            "s.toml, line 18: layout method needs to be one of .*, got 'gasao'",
        ),
        (
            '[layout]\nproblem = "studies.trusses"',
            "s.toml, line 17: layout problem needs the form 'module:func",
        ),
        (
            '[robust_layout]\nmodel = "studies.trusses"\nnominal = { a = 0.5 }',
            "s.toml, line 17: layout problem needs the form",
        ),
    ],
)
def test_what_a_stage_is_made_of_is_refused_at_its_line_before_any_run(tmp_path, tables, words):
    (tmp_path / "m.py").write_text("def f(a): return a\n")
    text = STUDY.format(model='function = "m.py:f"', engine="inline") + tables
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(StudyError, match=words):
        check_study(load_study(tmp_path / "s.toml"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'kind = "python"\nfunction = "m.py:f"',
            'kind = "table"\nfile = "gone.csv"',
            r"s.toml, line 7: no table .*gone.csv: \[model\] file is looked up beside the study file",
        ),
        (
            "runs = 4",
            'kind = "table"\nfile = "gone.csv"',
            r"s.toml, line 5: no table .*gone.csv: \[design\] file is looked up beside the study file",
        ),
    ],
)
def test_a_table_that_is_not_there_is_refused_at_its_line(tmp_path, old, new, words):
    (tmp_path / "m.py").write_text("def f(a): return a\n")
    text = STUDY.format(model='function = "m.py:f"', engine="inline")
    (tmp_path / "s.toml").write_text(text.replace(old, new))
    with pytest.raises(StudyError, match=words):
        check_study(load_study(tmp_path / "s.toml"))
    with pytest.raises(StudyError, match=words), Campaign.from_file(tmp_path / "s.toml") as campaign:
        campaign.run()
