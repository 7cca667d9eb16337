"""Constraints of a comparison of designs: on the uncertainty, on the designs, and on both together."""

import pytest

from tests.unit.stages.test_late_stages import ROBUST, STUDY
from workbench.campaign.results.failures import failure_document
from workbench.errors import StudyError
from workbench.report.lines.robust import robust_lines
from workbench.robust.re_evaluation import re_evaluate
from workbench.space.box import Parameter, Space
from workbench.space.expression import Condition
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage

U = Space([Parameter("f", lower=0.0, upper=1.0, unit="N"), Parameter("g", lower=0.0, upper=1.0)])
DESIGNS = {"soft": {"k": 1.0}, "stiff": {"k": 2.0}}


def response(x, u):
    return x["k"] * u["f"]


def test_a_point_that_one_design_may_not_meet_is_left_out_for_all():
    result = re_evaluate(response, DESIGNS, U, samples=100, constraints=["k + f <= 2.8"])
    assert result.drawn == 80
    assert result.inadmissible == {"soft": 0, "stiff": 20}
    assert all(row["f"] <= 0.8 for row in result.scenarios)
    assert [s.failed for s in result.summaries] == [0, 0]
    assert result.to_dict()["inadmissible"] == {"soft": 0, "stiff": 20}


def test_a_constraint_on_the_uncertainty_counts_for_every_design():
    space = Space(U.parameters, ("f + g <= 1",))
    result = re_evaluate(response, DESIGNS, space, samples=100)
    assert result.inadmissible["soft"] == result.inadmissible["stiff"] == 100 - result.drawn
    assert 40 < result.drawn < 60


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"constraints": ["k + z <= 3"]}, "with design 'soft', constraint 'k \\+ z <= 3' names 'z'"),
        (
            {"constraints": ["k + f <= 2.05"]},
            r"only 5 of 100 samples meet the constraints with every design \(soft breaks one in 0, stiff "
            r"breaks one in 95\); at least 10 are needed. Draw more",
        ),
        (
            {
                "constraints": ["k + f <= 2.8"],
                "extra_scenarios": [{"f": 0.1, "g": 0.0}, {"f": 0.9, "g": 0.0}],
            },
            r"scenario 2 of 2 breaks the constraint 'k \+ f <= 2.8' with design 'stiff'; give one that all",
        ),
        (
            {"constraints": ["k + f <= 2.8"], "nominal": {"f": 0.9, "g": 0.0}},
            "the nominal scenario breaks the constraint .* with design 'stiff'",
        ),
        ({"nominal": {"f": 7.0, "g": 0.0}}, "the nominal scenario is not in the uncertainty: .*'f' lies"),
    ],
)
def test_what_breaks_a_constraint_is_refused(arguments, words):
    with pytest.raises(StudyError, match=words):
        re_evaluate(response, DESIGNS, U, samples=100, **arguments)


def test_a_name_on_both_sides_is_refused_with_constraints():
    designs = {"a": {"f": 0.5}}
    assert re_evaluate(lambda x, u: x["f"] + u["f"], designs, U, samples=10).drawn == 10
    with pytest.raises(
        StudyError, match=r"design 'a' sets 'f', which is uncertain, too, .* rename one of them"
    ):
        re_evaluate(lambda x, u: x["f"], designs, U, samples=10, constraints=["f <= 1"])


def test_a_condition_knows_what_it_is_about():
    names = ("a", "b", "max")
    assert Condition("max(a, 2) <= 1", names=names).used == {"a"}
    assert Condition("max + b <= 1 or a > 2", names=names).used == set(names)


def open_study(folder, constraint, more=ROBUST, *, baseline=""):
    (folder / "m.py").write_text("def f(k, u):\n    if u > 0.9: raise ValueError('no')\n    return u / k")
    text = "constraint = [" + constraint + "]\n" + STUDY.format(more=more, baseline=baseline)
    (folder / "s.toml").write_text(text)
    return Campaign.from_file(folder / "s.toml")


def test_a_study_keeps_its_constraints_and_does_not_call_them_failures(tmp_path):
    with open_study(tmp_path, '"u >= 0.1", "k + u <= 2.8"') as campaign:
        document = run_stage(campaign, "robust")
        failed = failure_document(campaign.runs(), campaign.study.space)
        statuses = {row.status for row in campaign.runs()}
    # of 40 samples 4 lie below 0.1 and 8 beyond 0.8; of the others none fails
    assert document["inadmissible"] == {"soft": 4, "stiff": 12}
    assert document["drawn"] == 28
    assert [s["failed"] for s in document["summaries"]] == [0, 0]
    assert statuses == {"ok"}
    assert failed["counts"] == {"ok": 56}
    assert "points that break a constraint, run for no design: soft 4, stiff 12" in robust_lines(document)


def test_a_failure_is_one_in_the_table_and_in_the_list_of_failures(tmp_path):
    with open_study(tmp_path, '"u >= 0.1"') as campaign:
        document = run_stage(campaign, "robust")
        bad = [row for row in campaign.runs() if row.status != "ok"]
    assert sum(s["failed"] for s in document["summaries"]) == len(bad) == 8


def test_a_design_that_breaks_a_constraint_is_refused_where_it_stands(tmp_path):
    with pytest.raises(StudyError, match=r"line 31: \[robust\] design 'stiff' breaks the constraint 'k < 2'"):
        open_study(tmp_path, '"k < 2"')


def test_a_nominal_scenario_that_a_design_may_not_meet_is_refused_and_baselines_are_left_out(tmp_path):
    more = ROBUST.replace("limit = 0.6", "nominal = { u = 0.85 }")
    with pytest.raises(
        StudyError, match=r"line 27: .* nominal scenario breaks the constraint 'k \+ u <= 2.8'"
    ):
        open_study(tmp_path, '"k + u <= 2.8"', more)
    with open_study(tmp_path, '"k + u <= 2.8"', baseline="baseline = 0.85") as campaign:
        document = run_stage(campaign, "robust")
    assert document["nominal"] is None
    assert "breaks the constraint 'k + u <= 2.8' with design 'stiff'" in document["warnings"][-1]
