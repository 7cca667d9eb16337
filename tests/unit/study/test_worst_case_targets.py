"""What a study file may ask the worst of: one response, several, a sum, one within limits of others."""

import json

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.report.lines.worst_case import worst_case_lines
from workbench.report.writing import report_numbers, write_report
from workbench.search.arguments import Arguments
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.planning import plan_study
from workbench.stages.run_all import run_all, run_stage
from workbench.study.loading import parse_study
from workbench.study.worst_case_targets import targets

STUDY = """
[study]
name = "s"
[model]
{model}
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "load"
unit = "N"
[[response]]
name = "travel"
unit = "m"
[evaluate]
engine = "inline"
[worst_case]
{worst}
"""
CALLED = 'kind = "python"\nfunction = "m.py:f"'
MODEL = "def f(a, b):\n    return {'load': a + 0.2 * b, 'travel': a * a - b}\n"


def found(tmp_path, worst, *, model=CALLED):
    """The folder and the document of the stage."""
    (tmp_path / "m.py").write_text(MODEL)
    (tmp_path / "s.toml").write_text(STUDY.format(model=model, worst=worst))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        if campaign.study.has_points:
            run_stage(campaign, "design")
            evaluate(campaign)
        document = run_stage(campaign, "worst_case")
        return campaign.folder, json.loads(json.dumps(document, allow_nan=False))


def test_the_worst_of_each_of_several_responses(tmp_path):
    _, document = found(tmp_path, 'responses = { load = "max", travel = "min" }\nbudget = 24')
    (other,) = document["others"]
    assert (document["response"], document["unit"], document["sense"]) == ("load", "N", "max")
    assert (other["response"], other["unit"], other["sense"]) == ("travel", "m", "min")
    assert document["value"] == pytest.approx(1.2, abs=1e-3)
    assert other["value"] == pytest.approx(-1.0, abs=1e-3)
    assert document["evaluations"] + other["evaluations"] <= 24
    assert other["history"][0]["iteration"] == 0  # the runs of the first search are given to the second
    text = "\n".join(worst_case_lines(document))
    assert "Worst case (largest load): 1.2 N" in text
    assert "Worst case (smallest travel): -1 m" in text


def test_every_response_has_a_section_a_card_and_tables(tmp_path):
    folder, document = found(tmp_path, 'responses = { load = "max", travel = "min" }\nbudget = 24')
    page = write_report(folder).read_text()
    assert "How small can travel get?" in page
    assert '<section id="worst-case-travel"' in page
    assert page.count('href="#worst-case-travel"') >= 1
    assert (folder / "tables" / "search-travel.csv").exists()
    numbers = report_numbers(folder)["sections"]
    assert numbers["worst-case-travel"]["value"] == document["others"][0]["value"]
    assert numbers["worst-case"]["response"] == "load"


def test_the_worst_of_a_weighted_sum(tmp_path):
    folder, document = found(tmp_path, "weights = { load = 1.0, travel = -2.0 }\nbudget = 14")
    assert (document["response"], document["weights"]) == ("load - 2 travel", {"load": 1.0, "travel": -2.0})
    run = document["parameters"]
    a, b = run["a"], run["b"]
    assert document["value"] == pytest.approx(a + 0.2 * b - 2 * (a * a - b))
    assert document["value"] == pytest.approx(2.325, abs=0.02)
    page = write_report(folder).read_text()
    assert "How large can load - 2 travel get?" in page
    assert 'id="figure-parallel"' in page


@pytest.mark.slow
def test_the_worst_within_limits_of_another_response(tmp_path):
    limited = 'response = "load"\nwithin = { travel = [-inf, 0.0] }\nbudget = 20'
    folder, document = found(tmp_path, limited + '\n[design]\nkind = "sobol"\nruns = 8')
    assert document["within"] == {"travel": [None, 0.0]}
    assert document["failures"]["excluded"] > 0
    a, b = document["parameters"]["a"], document["parameters"]["b"]
    assert a * a - b <= 0
    assert document["value"] == pytest.approx(1.2, abs=0.03)
    assert "  of the runs with travel <= 0" in worst_case_lines(document)
    assert "Only runs with travel &lt;= 0 count" in write_report(folder).read_text()


def test_the_quantile_beside_the_worst_case(tmp_path):
    worst = 'response = "load"\nbudget = 8\nquantile = 0.9\nquantile_budget = 6'
    folder, document = found(tmp_path, worst)
    quantile = document["quantile"]
    # P(a + 0.2 b > t) = 0.1 for uniform a, b: t = 1 lies there exactly
    assert quantile["value"] == pytest.approx(1.0, abs=0.01)
    assert quantile["lower"] <= quantile["value"] <= quantile["upper"] < document["value"]
    assert quantile["evaluations"] <= 6
    lines = worst_case_lines(document)
    start = next(
        k for k, line in enumerate(lines) if line.startswith("  in 10 % of all cases load lies above")
    )
    assert "by the" in lines[start] + lines[start + 1]
    assert max(map(len, lines)) < 80
    page = write_report(folder).read_text()
    assert "In 10 % of all cases load lies above" in page
    assert (
        (folder / "tables" / "quantile.csv").read_text().startswith("chance of no worse,load [N],lower [N]")
    )
    assert report_numbers(folder)["sections"]["worst-case"]["quantile"] == quantile


def test_limits_that_nothing_keeps_are_named(tmp_path):
    with pytest.raises(
        NotEnoughRuns, match=r"10 excluded\. Loosen the limits of `within`, which exclude runs"
    ):
        found(tmp_path, 'response = "load"\nwithin = { travel = [5, inf] }\nbudget = 10')


def test_the_responses_of_a_table_of_runs(tmp_path):
    points = [(a / 3, b / 3) for a in range(4) for b in range(4)]
    rows = [f"{a},{b},{a + 0.2 * b},{a * a - b}" for a, b in points]
    (tmp_path / "runs.csv").write_text("\n".join(["a,b,load,travel", *rows]))
    _, document = found(
        tmp_path, 'responses = { travel = "max", load = "min" }', model='kind = "table"\nfile = "runs.csv"'
    )
    assert [document["response"], document["others"][0]["response"]] == ["travel", "load"]
    # the table holds both corners, and nothing beyond them is predicted: runs of the table are the answer
    assert [document["confirmed"], document["others"][0]["confirmed"]] == [True, True]
    assert [document["value"], document["others"][0]["value"]] == [1.0, 0.0]
    assert [document["parameters"], document["others"][0]["parameters"]] == [
        {"a": 1.0, "b": 0.0},
        {"a": 0.0, "b": 0.0},
    ]


@pytest.mark.slow
def test_the_order_of_the_responses_is_part_of_the_stage(tmp_path):
    worst = "responses = {{ {} }}\nbudget = 16"
    found(tmp_path, worst.format('load = "max", travel = "min"'))
    (tmp_path / "s.toml").write_text(
        STUDY.format(model=CALLED, worst=worst.format('travel = "min", load = "max"'))
    )
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        assert run_all(campaign)["worst_case"]["response"] == "travel"


def test_the_plan_counts_the_runs_of_the_quantile(tmp_path):
    for more, runs in (("", 50), ("quantile_budget = 6", 16)):
        worst = f'response = "load"\nbudget = 10\nquantile = 0.9\n{more}'
        study = parse_study(STUDY.format(model=CALLED, worst=worst))
        assert plan_study(study, tmp_path)["runs"] == {"worst_case": runs}


def test_a_table_has_no_quantile():
    with pytest.raises(
        StudyError, match=r"line 26: .* quantile needs a model that can be run; a table cannot"
    ):
        parse_study(
            STUDY.format(model='kind = "table"\nfile = "r.csv"', worst='response = "load"\n\nquantile = 0.9')
        )


@pytest.mark.parametrize(
    ("worst", "words"),
    [
        ("budget = 9", r"\[worst_case\] needs one of response = .*, got none"),
        ('response = "load"\nweights = { travel = 1.0 }', "got response and weights"),
        ('response = "lod"', "line 24: no response 'lod'; the responses are load, travel"),
        ('responses = { lod = "max" }', "line 24: no response 'lod'"),
        ("responses = {}", "worst_case.responses needs"),
        ('responses = { load = "big" }', "worst_case.responses.load needs 'max' or 'min', got 'big'"),
        ('responses = { load = "max" }\nsense = "min"', "responses does not go with sense: it gives every"),
        ('responses = { load = "max" }\nlipschitz = 3.0', "does not go with lipschitz: search that response"),
        ("weights = { lod = 1.0 }", "line 24: no response 'lod'"),
        ("weights = { load = 0.0 }", "weights.load needs a number other than 0, got 0. Leave it out"),
        ("weights = { load = inf }", "worst_case.weights.load needs a finite number, got inf"),
        ('response = "load"\nwithin = { trvl = [0, 1] }', "line 25: no response 'trvl'"),
        ('response = "load"\nwithin = { travel = [0] }', "within.travel needs"),
        ('response = "load"\nwithin = { travel = [nan, 1] }', "a number, -inf or inf, got nan"),
        (
            'response = "load"\nwithin = { travel = [2, -inf] }',
            r"within.travel needs \[low, high\] with -inf for no lower and inf for no upper limit, got \[2, ",
        ),
        ('response = "load"\nwithin = { travel = [inf, 2] }', r"inf for no upper limit, got \[inf, 2\]"),
        (
            'response = "load"\nwithin = { travel = [2, 1] }',
            r"within.travel needs \[low, high\], got \[2, 1\]",
        ),
        ('response = "load"\nquantile_budget = 6', "quantile_budget goes with quantile, such as"),
        (
            'response = "load"\nwithin = { load = [-inf, 1] }',
            "line 25: the limit load <= 1 is put on the response whose worst is searched: the largest load "
            "within it is 1 wherever the model comes that far. Leave the limit out and compare",
        ),
        (
            'response = "load"\nsense = "min"\nwithin = { load = [0.5, 9] }',
            "the limit load >= 0.5 is put on the response .*: the smallest load within it is 0.5 wherever",
        ),
        ('response = "load"\nwithin = { travel = [-inf, inf] }', "leaves both sides open. Leave it out"),
        (
            "weights = { load = 1.0 }\nwithin = { travel = [0, 1] }",
            "within goes with response, the one whose",
        ),
    ],
)
def test_what_a_worst_case_table_refuses(worst, words):
    with pytest.raises(StudyError, match=words):
        parse_study(STUDY.format(model=CALLED, worst=worst))


def test_a_response_may_be_limited_on_its_good_side():
    good = 'response = "load"\nwithin = { load = [-900, inf], travel = [-inf, 2] }'
    (target,) = targets(parse_study(STUDY.format(model=CALLED, worst=good)))
    read = target.reading
    assert read({"load": 3.0, "travel": 1.0}) == 3.0
    assert np.isnan(read({"load": -999.0, "travel": 1.0}))
    Arguments(response=read, sense="max")
    with pytest.raises(
        StudyError, match="the limit load >= -900 is put on the response whose worst is searched"
    ):
        Arguments(response=read, sense="min")
