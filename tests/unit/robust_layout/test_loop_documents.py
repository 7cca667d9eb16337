"""Which cases of a loop are shown, and their motion."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from tests.sample_motion import sample_motion
from workbench.robust_layout.loop_documents import shown_cases, shown_motion
from workbench.robust_layout.oracle import Found


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
        ("its second worst", {"x": 4}),
        ("its third worst", {"x": 5}),
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
