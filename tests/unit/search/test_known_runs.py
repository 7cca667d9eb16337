"""No worst case lies below a run that is known from elsewhere."""

import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.models.evaluator import Outcome
from workbench.search.arguments import Arguments
from workbench.search.evidence.grade import Grade
from workbench.search.known_runs import admitted, with_known_runs
from workbench.search.worst_case import worst_case
from workbench.search.worst_cases import worst_cases

SPACE = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])


def needle(a, b):
    return a + 3.0 * float(abs(a - 0.3) < 4e-4 and abs(b - 0.7) < 4e-4)


def known(a, b, *, key="elsewhere", status="ok"):
    return Outcome(parameters={"a": a, "b": b}, status=status, outputs={"y": needle(a, b)}, key=key)


@pytest.fixture(scope="module")
def found():
    return worst_case(needle, SPACE, budget=14, attack=1200)


def test_a_worse_known_run_is_the_worst_case(found):
    again = with_known_runs(
        found, SPACE, Arguments(budget=14), [known(0.1, 0.1, key="other"), known(0.3, 0.7)]
    )
    assert (found.value, again.value) == (1.0, 3.3)
    assert (again.run_key, again.confirmed, dict(again.parameters)) == (
        "elsewhere",
        True,
        {"a": 0.3, "b": 0.7},
    )
    assert again.gap.upper >= again.value
    assert again.runs == (*found.runs, again.runs[-1])
    assert (again.evaluations, again.budget) == (found.evaluations, found.budget)
    assert again.attack.value == 3.3
    # the attack had missed it, and no climb of it arrived there
    assert (found.grade, found.attack.arrived >= 2) == (Grade.ATTACKED, True)
    assert (again.grade, again.attack.arrived) == (Grade.SEARCHED, 0)
    assert [h["best"] for h in again.to_dict()["history"]][-1] == 3.3


def test_a_smaller_one_is_not(found):
    assert with_known_runs(found, SPACE, Arguments(budget=14), [known(0.9, 0.5)]) is found
    assert with_known_runs(found, SPACE, Arguments(budget=14), []) is found


def test_the_smallest_value_has_the_smallest_known_run():
    low = worst_case(lambda a, b: a, SPACE, sense="min", budget=10)
    again = with_known_runs(
        low,
        SPACE,
        Arguments(budget=10, sense="min"),
        [Outcome(parameters={"a": 0.5, "b": 0.5}, status="ok", outputs={"y": -2.0}, key="k")],
    )
    assert again.value == -2.0
    assert again.gap.upper <= -2.0


def test_runs_outside_the_space_and_failed_ones_do_not_count():
    outside = [known(1.5, 0.2), known(0.3, 0.7, status="failed")]
    other = Outcome(parameters={"a": 0.3}, status="ok", outputs={"y": 9.0}, key="other space")
    assert admitted(SPACE, [*outside, other]) == []
    half = Space(SPACE.parameters, constraints=["a <= 0.2"])
    assert admitted(half, [known(0.3, 0.7)]) == []


@pytest.mark.parametrize("seed", range(2))
def test_the_worst_of_one_response_may_be_a_run_made_for_another(seed):
    """Two responses that peak together at a place that only the second search is drawn to."""

    def both(a, b):
        pull = float(np.exp(-((a - 0.37) ** 2 + (b - 0.61) ** 2) / 0.02))
        return {"p": needle(a, b) + 2.0 * (pull > 0.8), "q": pull}

    made = []

    def counted(a, b):
        made.append(both(a, b))
        return made[-1]

    result = worst_cases(counted, SPACE, {"p": "max", "q": "max"}, budget=16, seed=seed)
    assert result["p"].value == max(answer["p"] for answer in made)
    assert result["q"].value == max(answer["q"] for answer in made)
