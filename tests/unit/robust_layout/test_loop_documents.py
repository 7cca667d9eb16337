"""Which cases of a loop are shown, and their motion."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from tests.sample_layout import TwoMembers
from tests.sample_motion import sample_motion
from workbench.engine.layout.formulation.problem import MemberGeometry
from workbench.report.layout.section import improvement_sentence
from workbench.robust_layout.loop_documents import (
    best_layout_document,
    shown_cases,
    shown_motion,
    shown_name,
)
from workbench.robust_layout.oracle import Found
from workbench.stages import robust_layout as robust_layout_stage


def found_with(*, robust, others=(), nominal_only):
    """As much of a loop's result as these functions read: cases are numbers."""
    worst = {
        "nominal only": Found(value=2.0, case={"x": nominal_only}, runs=5, status=""),
        "round 2": Found(
            value=1.0, case={"x": robust}, runs=5, status="", others=[{"case": {"x": x}} for x in others]
        ),
    }
    layouts = {"none": np.zeros(2), "nominal only": np.ones(2), "round 2": np.array([0.5, 1.0])}
    return SimpleNamespace(worst=worst, robust="round 2", cases=[{"x": 0}], layouts=layouts)


class Moving:
    """A model of two members whose motion is the sample's; where x is 7 nobody without members can be run."""

    def motion(self, layouts, uncertain):
        if uncertain["x"] == 7 and not all(density.any() for density in layouts.values()):
            raise ValueError("he has left")
        one = sample_motion().runs[0]
        runs = tuple(replace(one, label=label) for label in layouts)
        return replace(sample_motion(), runs=runs, histories=())


def test_the_worst_of_either_layout_comes_first_and_the_nominal_case_last():
    cases = shown_cases(found_with(robust=3, others=(4, 9, 5, 6), nominal_only=9))
    assert list(cases.items()) == [
        ("the worst case of 'nominal only'", {"x": 9}),
        ("the worst case of the robust layout", {"x": 3}),
        ("the second worst case of the robust layout", {"x": 4}),
        ("the fourth worst case of the robust layout", {"x": 5}),  # its third is that of 'nominal only'
        ("the nominal case", {"x": 0}),
    ]
    assert list(shown_cases(found_with(robust=0, nominal_only=0))) == ["the worst case of 'nominal only'"]


def test_a_case_without_a_run_of_no_members_keeps_the_others():
    found = found_with(robust=7, nominal_only=1)
    motion = shown_motion(Moving(), found, shown_cases(found))
    labels = {case: [run.label for run in motion.runs if run.case == case] for case in motion.cases}
    assert labels == {
        "the worst case of 'nominal only'": ["without", "nominal only", "robust"],
        "the worst case of the robust layout": ["nominal only", "robust"],
        "the nominal case": ["without", "nominal only", "robust"],
    }
    assert shown_motion(object(), found, shown_cases(found)) is None


def trivial(name, density):
    """A loop whose best layout is one that nobody searched for."""
    found = found_with(robust=3, others=(4,), nominal_only=9)
    found.robust, found.bound, found.document = name, 4.0, {}
    found.layouts[name], found.worst[name] = np.array(density), found.worst["round 2"]
    found.cases, found.values = [{"u": 0.0, "v": 0.0}, {"u": 0.0, "v": 1.0}], {name: [3.0, 4.0]}
    return found


class Tied(TwoMembers):
    """Two members with ends."""

    def problem(self, scenarios):
        ends = {"body_a": np.zeros(2, int), "body_b": np.ones(2, int)}
        points = {"point_a": np.zeros((2, 2)), "point_b": np.eye(2)}
        geometry = MemberGeometry(**ends, **points, kind=("belt", "belt"))
        return replace(super().problem(scenarios), geometry=geometry)


def test_a_trivial_layout_that_is_returned_has_its_members_and_one_name():
    found = trivial("uniform", [0.5, 0.25])
    document = best_layout_document(Tied(), found)
    assert [(m["kind"], m["density"]) for m in document["members"]] == [("belt", 0.5), ("belt", 0.25)]
    assert document["trivial"] == "uniform"
    assert [s["parameters"] for s in document["scenarios"]] == found.cases  # with what is nominal in them
    assert improvement_sentence(document) == "It is the layout 'uniform' itself."
    assert shown_name(found) == "uniform"
    assert list(shown_cases(found)) == [
        "the worst case of 'nominal only'",
        "the worst case of 'uniform'",
        "the second worst case of 'uniform'",
        "the nominal case",
    ]
    found.robust = "round 2"
    assert shown_name(found) == "robust"


def test_a_history_has_no_value_where_the_search_could_not_run_a_layout():
    """`as_response` takes numbers: it is the user's."""
    found = trivial("round 2", [0.5, 0.25])
    history = [{"evaluation": 1, "value": 4.0, "best": 4.0}, {"evaluation": 2, "value": None, "best": 4.0}]
    found.document = {
        "value": 4.0, "kkt": 0.0, "history": history, "shadow_prices": {}, "verdicts": [], "status": "",
    }  # fmt: skip

    class Rooted(Tied):
        def as_response(self, objective):
            return objective**0.5

    document = best_layout_document(Rooted(), found)
    assert [(h["value"], h["best"]) for h in document["history"]] == [(2.0, 2.0), (None, 2.0)]


def test_samples_call_a_trivial_layout_what_it_is(monkeypatch):
    monkeypatch.setattr(robust_layout_stage, "re_evaluate", lambda run, designs, *a, **others: list(designs))
    campaign = SimpleNamespace(study=SimpleNamespace(space=None, seed=1))
    runs, model = SimpleNamespace(of=lambda density: None), TwoMembers()
    found = trivial("uniform", [0.5, 0.5])
    compared = robust_layout_stage._compared(campaign, {"samples": 5}, model, found, runs, {})
    assert compared == ["nominal only", "uniform"]
    found.robust = "round 2"
    compared = robust_layout_stage._compared(campaign, {"samples": 5}, model, found, runs, {})
    assert compared == ["nominal only", "uniform", "robust"]


def test_a_motion_calls_a_trivial_layout_what_it_is():
    for name, density, labels in (
        ("uniform", [0.5, 0.5], ["without", "nominal only", "uniform"]),
        ("nominal only", [1.0, 1.0], ["without", "nominal only"]),
        ("none", [0.0, 0.0], ["without", "nominal only"]),
    ):
        found = trivial(name, density)
        motion = shown_motion(Moving(), found, {"some case": {"x": 1}})
        assert [run.label for run in motion.runs] == labels
