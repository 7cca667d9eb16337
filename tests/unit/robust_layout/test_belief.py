"""Cases that break a layout at the model's step alone: they end no attack and hide no other case."""

import numpy as np
import pytest

from tests.sample_layout import ROBUST, TwoMembers, value
from workbench.models.evaluator import FunctionEvaluator, Outcome
from workbench.robust_layout.oracle import LayoutOracle
from workbench.search.evidence.attack.belief import Believing
from workbench.space.box import Space
from workbench.space.parameter import Parameter

SPACE = Space((Parameter("u", lower=-1, upper=1), Parameter("v", lower=0, upper=1)))
LAYOUT = np.array([0.86, 0.14])
CASES = [{"u": 0.9, "v": 0.0}]
LIMIT = 1.02 * ROBUST


class Stepwise(TwoMembers):
    """A spike near an end, which is there at half the step if it is real."""

    def __init__(self, *, real):
        super().__init__()
        self.real, self.finer_runs = real, 0

    def responses(self, density, uncertain):
        spike = 5.0 if uncertain["u"] < -0.95 else 0.0
        return {"push": value(density, **uncertain) + spike}

    def refined(self, density, uncertain):
        self.finer_runs += 1
        spike = 5.0 if uncertain["u"] < -0.95 and self.real else 0.0
        return {"push": value(density, **uncertain) + spike}


def attacked(folder, *, real):
    model = Stepwise(real=real)
    oracle = LayoutOracle(
        model=model, space=SPACE, folder=folder, identity="stepwise", budget=60, corners=16, seed=1,
        going_on=0, evaluator=lambda density: FunctionEvaluator(lambda **u: model.responses(density, u)),
    )  # fmt: skip
    return model, oracle.attack(LAYOUT, CASES, limit=LIMIT, turn=1)


def test_an_attack_goes_on_where_its_raid_broke_the_layout_at_the_model_s_step_alone(tmp_path):
    _, found = attacked(tmp_path, real=False)
    assert found.disbelieved
    assert found.value <= LIMIT
    assert found.runs == 60  # 24 of them are its raid
    assert found.attack["excess"] == 0.0
    assert "nothing beyond" in found.status


def test_a_layout_that_is_broken_is_run_at_half_the_step_a_few_times_only(tmp_path):
    model, found = attacked(tmp_path, real=True)
    assert found.value > LIMIT
    assert found.runs == 24
    assert not found.disbelieved
    assert model.finer_runs <= 13  # the first, and those that are told


def test_what_is_not_believed_hides_no_worse_case_beside_it(tmp_path):
    """The worst known case lies beside a spike: without that it is still the worst."""
    model = Stepwise(real=False)
    oracle = LayoutOracle(
        model=model, space=SPACE, folder=tmp_path, identity="stepwise", budget=60, corners=16, seed=1,
        evaluator=lambda density: FunctionEvaluator(lambda **u: model.responses(density, u)),
    )  # fmt: skip
    beside = {"u": -0.949, "v": 1.0}
    found = oracle.look(LAYOUT, [beside, {"u": 0.2, "v": 0.0}], limit=LIMIT, turn=1)
    told = [found.case, *(one["case"] for one in found.others)]
    assert beside in told
    assert all(case["u"] >= -0.95 for case in told)
    assert all(case["case"]["u"] < -0.95 for case in found.disbelieved)


@pytest.mark.parametrize("finer", [None, 9.0])
def test_without_a_smaller_value_at_half_the_step_a_case_is_believed(finer):
    outcome = Outcome(parameters={"u": 1.0}, status="ok", outputs={"push": 8.0})
    belief = Believing(
        evaluate=lambda rows, purpose: [outcome], response="push", limit=5.0, finer=lambda case: finer
    )
    assert belief([{"u": 1.0}], purpose="study") == [outcome]
    assert belief.is_broken
    assert not belief.disbelieved


def test_a_run_that_failed_is_answered_as_it_is():
    outcome = Outcome(parameters={"u": 1.0}, status="failed", error="no")
    belief = Believing(
        evaluate=lambda rows, purpose: [outcome], response="push", limit=5.0, finer=lambda case: 0.0
    )
    assert belief([{"u": 1.0}], purpose="study") == [outcome]
    assert belief.believes(outcome)
