"""Derivatives that the model of a study file brings: stored with their runs, climbed by in the worst case."""

import pytest

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.gradients import checked_gradients
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage

EXACT = 1e-8  # a quasi-Newton climb on a smooth peak of height one
STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
{gradient}
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = -1
upper = 1
[[response]]
name = "y"
[evaluate]
engine = "{engine}"
[worst_case]
response = "y"
budget = 24
"""
CODE = """
from math import exp
def f(a, b): return exp(-(a - 0.3) ** 2 - 2 * (b - 0.1) ** 2)
def slopes(a, b): return {"a": -2 * (a - 0.3) * f(a, b), "b": -4 * (b - 0.1) * f(a, b)}
def pair(a, b): return f(a, b), slopes(a, b)
def broken(a, b): return {"a": 1 / 0}
def misspelt(a, b): return {"a": 0.0, "c": 0.0}
def wrong(a): return {"a": 0.0}
"""


def open_study(folder, *, gradient='gradient = "m.py:slopes"', engine="inline", code=CODE, function="f"):
    (folder / "m.py").write_text(code)
    text = STUDY.format(gradient=gradient, engine=engine).replace("m.py:f", f"m.py:{function}")
    (folder / "s.toml").write_text(text)
    return Campaign.from_file(folder / "s.toml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "gradient", "engine"),
    [("f", 'gradient = "m.py:slopes"', "processes"), ("pair", "", "inline")],
)
def test_the_worst_case_climbs_by_declared_gradients(tmp_path, function, gradient, engine):
    with open_study(tmp_path, function=function, gradient=gradient, engine=engine) as campaign:
        found = run_stage(campaign, "worst_case")
        assert 1 - found["value"] < EXACT
        assert any(run["proposal"] == "gradient" for run in found["history"])
        assert found["audit"]["gradient_runs"] == found["evaluations"]
        runs = campaign.runs()
        a, b = runs[0].inputs["a"], runs[0].inputs["b"]
        slopes = runs[0].gradients["y"]
        assert slopes == {
            "a": -2 * (a - 0.3) * runs[0].outputs["y"],
            "b": -4 * (b - 0.1) * runs[0].outputs["y"],
        }
    with open_study(tmp_path, function=function, gradient=gradient, engine=engine) as campaign:
        assert run_stage(campaign, "worst_case") == found  # from the store: the same search, no new run
        assert len(campaign.runs()) == len(runs)


def test_runs_made_without_a_gradient_stay_valid(tmp_path):
    with open_study(tmp_path, gradient="") as campaign:
        keys = [run.key for run in campaign.evaluate([{"a": 0.5, "b": 0.5}])]
    with open_study(tmp_path) as campaign:
        assert [run.key for run in campaign.evaluate([{"a": 0.5, "b": 0.5}])] == keys


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("broken", "of no use: no gradient: ZeroDivisionError: division by zero"),
        ("misspelt", "of no use: no gradient: a derivative by 'c' came; the parameters are a, b"),
    ],
)
def test_a_gradient_that_fails_costs_no_run_and_is_told(tmp_path, name, words):
    notes = []
    with open_study(tmp_path, gradient=f'gradient = "m.py:{name}"') as campaign:
        campaign.progress.note = notes.append
        found = run_stage(campaign, "worst_case")
        assert campaign.failures() == {}
    assert found["value"] > 1 - 1e-2
    assert words in notes[-1]


def test_a_gradient_that_does_not_fit_is_refused_before_any_run(tmp_path):
    with (
        open_study(tmp_path, gradient='gradient = "m.py:wrong"') as campaign,
        pytest.raises(StudyError, match=r"wrong\(a\) cannot be called with the study's parameters a, b"),
    ):
        run_stage(campaign, "worst_case")
    with (
        open_study(tmp_path, gradient='gradient = "m.py:slope"') as campaign,
        pytest.raises(StudyError, match=r"has no 'slope'\. Did you mean 'slopes'"),
    ):
        run_stage(campaign, "worst_case")


def test_a_changed_gradient_in_a_file_of_its_own_is_noticed(tmp_path):
    (tmp_path / "g.py").write_text("def slopes(a, b): return {'a': 0.0, 'b': 0.0}")
    with open_study(tmp_path, gradient='gradient = "g.py:slopes"') as campaign:
        campaign.evaluate([{"a": 0.5, "b": 0.5}])
    (tmp_path / "g.py").write_text("def slopes(a, b): return {'a': 1.0, 'b': 1.0}")
    with pytest.raises(StudyError, match="the source of the model changed after 1 run "):
        open_study(tmp_path, gradient='gradient = "g.py:slopes"')


@pytest.mark.parametrize(
    ("slopes", "words"),
    [
        (3.0, "a mapping of parameters to derivatives is needed, got 3.0"),
        ({"y": {"a": 1.0}, "w": {"a": 1.0}}, "derivatives of 'w' came; the responses are y, z"),
        ({"y": 1.0}, "derivatives of 'y' need a mapping by parameter, got 1.0"),
        ({"y": {"a": "up"}}, "derivatives of 'y' need numbers"),
    ],
)
def test_what_is_no_gradient(slopes, words):
    with pytest.raises(EvaluationFailed, match=words):
        checked_gradients(slopes, ("a", "b"), ("y", "z"))


def test_derivatives_that_are_not_finite_are_left_out():
    slopes = {"y": {"a": float("nan"), "b": 1.0}, "z": {"a": 2.0}}
    assert checked_gradients(slopes, ("a", "b"), ("y", "z")) == {"z": {"a": 2.0}}
    assert checked_gradients({}, ("a", "b"), ("y",)) == {}
