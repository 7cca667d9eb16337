"""Layouts for given cases are made once."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.sample_layout import TwoMembers
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.errors import StudyError
from workbench.models.evaluator import Outcome
from workbench.robust_layout import cases as cases_of
from workbench.robust_layout.cases import (
    GIVEN,
    Optimised,
    failing,
    optimise_for_cases,
    trivial_layouts,
)
from workbench.robust_layout.judged import JudgedLayouts


def test_a_layout_is_found_again_whatever_the_order_of_a_cases_parameters(tmp_path, monkeypatch):
    """A case that an attack found has another order once it was read from the attack's file."""
    made = []
    real = cases_of.optimise_layout
    monkeypatch.setattr(cases_of, "optimise_layout", lambda *a, **o: made.append(1) or real(*a, **o))

    def layout(*cases):
        found = optimise_for_cases(
            TwoMembers(), cases, start=None, folder=tmp_path, evaluations=5, identity="two"
        )
        assert isinstance(found, Optimised)
        return found.density

    first = layout({"u": 1.0, "v": 0.0}, {"u": -1.0, "v": 0.5})
    again = layout({"v": 0.0, "u": 1.0}, {"v": 0.5, "u": -1.0})
    assert np.array_equal(first, again)
    assert len(made) == 1
    layout({"u": 1.0, "v": 0.1}, {"u": -1.0, "v": 0.5})
    assert len(made) == 2


class OneSided(TwoMembers):
    """Its code knows no case to the left."""

    def problem(self, scenarios):
        if any(case["u"] == 0.5 for case in scenarios):
            raise np.linalg.LinAlgError("singular matrix")
        return super().problem([{}[case["u"]] if case["u"] == "left" else case for case in scenarios])


def test_an_error_of_the_models_own_code_names_its_case_and_line(tmp_path):
    def made(*cases):
        return optimise_for_cases(
            OneSided(), cases, start=None, folder=tmp_path, evaluations=5, identity="one"
        )

    right, left = {"u": 1.0, "v": 0.0}, {"u": "left", "v": 0.0}
    said = (
        r"the layout model 'two members' makes no problem of the case \{'u': 'left', 'v': 0.0\}: KeyError: "
        r"'left' \(test_cases.py, line \d+"
    )
    with pytest.raises(StudyError, match=said):
        made(right, left)
    assert "LinAlgError in 2 cases" in made(right, {"u": 0.5, "v": 0.0})  # an answer: it cannot be run
    assert failing(OneSided(), [right, {"u": 0.5, "v": 0.0}, right], None) == [1]


class Slack(TwoMembers):
    """A case to the left cannot be run where the second member holds almost nothing."""

    def problem(self, scenarios):
        problem = super().problem(scenarios)
        if all(case["u"] > 0 for case in scenarios):
            return problem

        def evaluate(density):
            if density[1] < 0.1:
                raise InvalidLayout("nothing holds to the left")
            return problem.evaluate(density)

        return replace(problem, evaluate=evaluate)


def test_a_case_that_fails_where_a_search_begins_is_told_from_those_that_run_there():
    left, right = {"u": -1.0, "v": 0.0}, {"u": 1.0, "v": 0.0}
    assert failing(Slack(), [left, right], np.array([0.95, 0.05])) == [0]
    assert failing(Slack(), [left, right], None) == [1]  # each runs at the problem's own start: the last one


def test_a_search_goes_on_from_densities_that_cannot_be_run(tmp_path):
    """Its history, which is kept, has no value there."""
    left, right = {"u": -0.5, "v": 0.0}, {"u": 1.0, "v": 0.0}
    found = optimise_for_cases(
        Slack(), [left, right], start=np.array([0.5, 0.5]), folder=tmp_path, evaluations=8, identity="slack"
    )
    assert isinstance(found, Optimised)
    values = [entry["value"] for entry in found.document["history"]]
    assert None in values
    assert found.document["value"] == min(v for v in values if v is not None)


def test_a_layout_is_kept_where_its_gradient_cannot_be_checked(tmp_path):
    """The problem's own start, where it is checked, need not be one that can be run."""

    class Narrow(Slack):
        def problem(self, scenarios):
            return replace(super().problem(scenarios), start=np.array([0.95, 0.05]))

    left, right = {"u": -1.0, "v": 0.0}, {"u": 1.0, "v": 0.0}
    given = {"folder": tmp_path, "evaluations": 5, "identity": "narrow"}
    found = optimise_for_cases(Narrow(), [left, right], start=np.array([0.8, 0.2]), **given)
    assert isinstance(found, Optimised)
    assert found.document["gradient_check"] == {}


def test_cases_near_a_worst_that_is_below_zero_are_those_in_the_upper_part_of_the_values():
    """A share of the worst would lie above it, and no case be near."""

    class Clearance(TwoMembers):
        def responses(self, density, uncertain):
            return {"push": uncertain["u"] - 2.0}

    def evaluate(rows, *, purpose):
        outputs = [Clearance().responses(None, row) for row in rows]
        return [Outcome(parameters=row, status="ok", outputs=o) for row, o in zip(rows, outputs, strict=True)]

    cases = [{"u": u, "v": 0.0} for u in (-1.0, 0.0, 0.9, 1.0)]
    judged = JudgedLayouts(evaluator=lambda density: evaluate, model=Clearance(), cases=cases)
    judged.layouts["one"] = np.zeros(2)
    assert judged.near(["one"], share=0.6, since=4) == [2, 3]  # of -3 to -1 those from -1.8 on


def test_the_start_of_the_problem_is_a_trivial_layout_of_its_own_where_it_is_another():
    problem = TwoMembers().problem([{"u": 0.0, "v": 0.0}])
    assert list(trivial_layouts(problem)) == ["uniform", "none"]
    for start, expected in (([0.2, 0.6], [0.2, 0.6]), ([0.5, 1.5], [1 / 3, 2 / 3])):
        found = trivial_layouts(replace(problem, start=np.array(start)))
        assert list(found) == ["uniform", "none", GIVEN]
        np.testing.assert_allclose(found[GIVEN], expected, rtol=1e-12)  # brought within bounds and budgets
        assert problem.excess(found[GIVEN]) <= 1e-12
    nearly = replace(problem, start=problem.start * (1 - 1e-12))
    assert list(trivial_layouts(nearly)) == ["uniform", "none"]


@dataclass
class ByCase:
    """An objective that can be evaluated in some of its cases."""

    model: TwoMembers
    cases: list

    def __call__(self, design):
        return self.model.problem(self.cases).evaluate(design)

    def of_scenarios(self, chosen):
        return ByCase(self.model, [self.cases[k] for k in chosen])


class TwoMembersByCase(TwoMembers):
    def problem(self, scenarios):
        return replace(super().problem(scenarios), evaluate=ByCase(TwoMembers(), list(scenarios)))


@pytest.mark.parametrize(
    ("model", "number", "search", "expected"),
    [
        (TwoMembersByCase(), 12, "all cases", ("all", False, 6)),
        (TwoMembersByCase(), 12, "binding cases", ("binding", False, 6)),
        (TwoMembersByCase(), 12, "several starts", ("binding", True, 12)),
        (TwoMembersByCase(), 12, "one start", ("binding", False, 12)),
        (TwoMembersByCase(), 10, "several starts", ("all", False, 6)),
        (TwoMembersByCase(), 10, "one start", ("all", False, 6)),
        (TwoMembers(), 12, "several starts", ("all", False, 6)),
    ],
)
def test_many_cases_that_can_be_run_alone_are_searched_by_those_that_bind(
    tmp_path, monkeypatch, model, number, search, expected
):
    asked, real = [], cases_of.optimise_layout

    def optimise(problem, *, scenarios, multi_start, max_evaluations, **others):
        asked.append((scenarios, multi_start, max_evaluations))
        return real(problem, max_evaluations=max_evaluations, **others)

    monkeypatch.setattr(cases_of, "optimise_layout", optimise)
    cases = [{"u": u, "v": 0.0} for u in np.linspace(-1, 1, number)]
    given = {"start": np.full(2, 0.4), "folder": tmp_path, "evaluations": 6, "identity": "two"}
    assert isinstance(optimise_for_cases(model, cases, search=search, **given), Optimised)
    optimise_for_cases(model, cases, search=search, **given)
    assert asked == [expected]
    other = "binding cases" if search == "all cases" else "all cases"
    optimise_for_cases(model, cases, search=other, **given)
    assert len(asked) == 2  # another search is another layout
