"""The stage: layout.json, resuming, messages, figures."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure

from studies import trusses
from studies.whole_members import random_problem
from workbench.engine.layout.formulation.problem import static_problem
from workbench.errors import Interrupted, StudyError
from workbench.figures.layout import (
    plot_density,
    plot_front,
    plot_layout,
    plot_layout_history,
)
from workbench.report.lines.layout import layout_lines
from workbench.robust_layout.document import check_gradient
from workbench.robust_layout.model import load_problem
from workbench.stages.layout import run_layout

SHORT = {"problem": "studies.two_body_layout:problem", "options": {"case": "short"}, "evaluations": 12}


def test_the_document_holds_what_a_report_needs(tmp_path):
    heard = []
    document = run_layout(tmp_path, **SHORT, progress=lambda entry: heard.append(entry.evaluation))
    assert json.loads((tmp_path / "layout.json").read_text()) == document
    assert not (tmp_path / "layout.partial.json").exists()
    assert heard == [row["evaluation"] for row in document["history"]] == list(range(1, len(heard) + 1))
    assert document["value"] < 0.112 * document["start_value"]
    assert document["baselines"]["uniform"] == pytest.approx(document["start_value"])
    assert document["beyond_budget"]["all"] < document["value"]
    assert document["shadow_prices"]["material"] > 0
    assert document["budgets"][0]["used"] <= 102 * (1 + 1e-9)
    assert document["purified"]["fractional"] <= 7
    assert document["gradient_check"]["central difference"] < 1e-6
    assert len(document["members"]) == 1020
    member = document["members"][0]
    assert member["a"] == member["point_a"]
    assert member["kind"] == "spring"
    assert document["unit"] == "m^2"


def test_an_interrupted_layout_goes_on(tmp_path):
    def stop(entry):
        if entry.evaluation == 4:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="layout stopped after 4 evaluations"):
        run_layout(tmp_path, **SHORT, progress=stop)
    partial = json.loads((tmp_path / "layout.partial.json").read_text())
    assert len(partial["history"]) == 4
    document = run_layout(tmp_path, **SHORT)
    assert [row["evaluation"] for row in document["history"]] == list(range(1, len(document["history"]) + 1))
    assert document["history"][:4] == partial["history"]
    best = [row["best"] for row in document["history"]]
    assert best == sorted(best, reverse=True)
    assert document["value"] < 0.112 * document["start_value"]


def test_another_problem_does_not_resume(tmp_path):
    def stop(entry):
        raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        run_layout(tmp_path, problem="studies.trusses:cantilever", progress=stop)
    document = run_layout(tmp_path, problem="studies.trusses:two_bar")
    assert document["history"][0]["evaluation"] == 1
    assert document["value"] == pytest.approx(1.50865, rel=1e-4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"problem": "studies.trusses"}, "needs the form 'module:function'"),
        ({"problem": "studies.nowhere:f"}, "no module 'studies.nowhere'. Put it beside the study file"),
        ({"problem": "studies.trusses:nothing"}, "module has no 'nothing'"),
        ({"problem": "studies.trusses:cantilever", "options": {"x": 1}}, "unexpected keyword"),
        (
            {"problem": "studies.trusses:cantilever", "method": "best"},
            "layout method needs to be one of gsao",
        ),
        ({"problem": object()}, "layout problem 'object': problem needs to be a LayoutProblem"),
    ],
)
def test_unusable_tables_are_refused(tmp_path, arguments, message):
    with pytest.raises(StudyError, match=message):
        run_layout(tmp_path, **arguments)


def test_a_budget_that_counts_no_member_is_refused(tmp_path):
    """A misspelt kind leaves a row of zeros, and the members that it is meant for without a limit."""
    ropes = static_problem(
        lambda a: (float(a @ a), 2 * a), start=np.full(2, 0.5), budgets=[(np.zeros(2), 1.0)], names=("ropes",)
    )
    with pytest.raises(StudyError, match="the budget 'ropes' of 'layout' counts no member: all of its costs"):
        run_layout(tmp_path, problem=ropes)


def test_a_function_beside_the_study_file_is_found(tmp_path):
    (tmp_path / "my_layout_beside.py").write_text(
        "from studies.trusses import cantilever\ndef problem():\n    return cantilever()\n"
    )
    assert load_problem("my_layout_beside:problem", folder=tmp_path).members == 5


def test_a_wrong_gradient_is_seen():
    from dataclasses import replace

    from workbench.engine.layout.formulation.problem import static_problem

    right = static_problem(lambda a: (float((a**2).sum()), 2 * a), start=np.full(4, 0.5))
    wrong = static_problem(lambda a: (float((a**2).sum()), 3 * a), start=np.full(4, 0.5))
    assert check_gradient(right)["central difference"] < 1e-8
    assert check_gradient(replace(wrong))["central difference"] > 0.3


def test_figures_are_labelled():
    history = [
        {"evaluation": 1, "value": 9.0, "best": 9.0, "accepted": True},
        {"evaluation": 2, "value": 20.0, "best": 9.0, "accepted": False},
        {"evaluation": 3, "value": 0.5, "best": 0.5, "accepted": True},
    ]
    axes = Figure().subplots(1, 4)
    plot_layout_history(history, label="compliance", unit="J", ax=axes[0])
    assert axes[0].get_ylabel() == "compliance [J]"
    assert axes[0].get_yscale() == "log"
    plot_density([0.1, 1.0], ax=axes[1])
    assert axes[1].get_xlabel() == "member"
    members = [
        {"density": 1.0, "point_a": [0, 0], "point_b": [1, 0]},
        {"density": 0.25, "point_a": [0, 0], "point_b": [1, 1]},
    ]
    plot_layout(members, thickest=2.0, ax=axes[2])
    assert sorted(axes[2].collections[0].get_linewidths()) == [0.5, 2.0]
    plot_front([[1, 2], [0, 3]], knee=0, utopia=[0, 2], units=("mm", "1"), ax=axes[3])
    assert axes[3].get_xlabel() == "objective 1 [mm]"
    assert trusses.cantilever().title == "cantilever"


@pytest.mark.slow
def test_whole_members_stand_in_the_document_and_in_the_terminal(tmp_path):
    problem, count = random_problem(0, most=800)
    document = run_layout(tmp_path, problem=problem, evaluations=8, whole=count, whole_evaluations=40)
    whole = document["whole"]
    assert len(whole["members"]) <= count
    assert whole["evaluations"] <= 40
    assert whole["price_of_rounding"] == pytest.approx(whole["value"] / whole["relaxed"] - 1)
    assert any("The price of rounding is" in line for line in layout_lines(document))
    assert json.loads((tmp_path / "layout.json").read_text())["whole"] == whole
    sized = run_layout(
        tmp_path, problem=problem, evaluations=8, whole=count, whole_evaluations=40, whole_sizes=[0.5, 0.8]
    )
    assert {round(x, 3) for x in sized["whole"]["density"]} <= {0.0, 0.5, 0.8}
