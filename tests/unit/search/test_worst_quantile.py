"""Quantiles of a response over the uncertainty, from few runs."""

import numpy as np
import pytest
from scipy.stats import norm

from workbench.errors import StudyError
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.worst_quantile import worst_quantile
from workbench.space.box import Distribution, Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])


def test_the_quantile_of_a_sum_of_uniforms():
    found = worst_quantile(lambda a, b: a + b, BOX, share=0.9, budget=20, seed=3)
    assert found.value == pytest.approx(2 - np.sqrt(0.2), abs=0.01)  # 1 - (2 - t)^2 / 2 = 0.9
    assert found.lower <= 2 - np.sqrt(0.2) <= found.upper
    assert found.evaluations <= 20


@pytest.mark.slow
def test_the_interval_holds_the_quantile_of_a_curved_response():
    def response(a, b):
        return float(np.exp(2 * a) * np.sin(2.5 * b))

    sample = np.random.default_rng(9).random((200_000, 2))
    known = np.quantile(np.exp(2 * sample[:, 0]) * np.sin(2.5 * sample[:, 1]), 0.95)
    found = worst_quantile(response, BOX, share=0.95, budget=30, seed=0)
    assert found.lower <= known <= found.upper
    assert found.upper - found.lower < 0.15 * known
    assert found.value == pytest.approx(known, rel=0.02)


def test_distributions_are_respected_and_small_may_be_bad():
    law = Distribution("norm", {"loc": 10.0, "scale": 1.0})
    space = Space([Parameter("m", lower=5.0, upper=15.0, unit="kg", distribution=law), BOX.parameters[0]])
    found = worst_quantile(lambda m, a: m + 0 * a, space, share=0.95, sense="min", budget=15, seed=1)
    assert found.value == pytest.approx(10 + norm.ppf(0.05), abs=0.05)
    assert found.lower <= found.value <= found.upper
    assert "lies below" in found.sentence


def test_the_run_that_is_named_is_a_true_run():
    found = worst_quantile(lambda a, b: a * b, BOX, budget=15, seed=0)
    assert found.run_value == pytest.approx(found.parameters["a"] * found.parameters["b"])
    assert found.to_dict()["run_key"].startswith("run ")


def test_an_evaluator_takes_the_place_of_the_function():
    def total(a, b):
        return a + b

    plain = worst_quantile(total, BOX, budget=12, seed=3)
    assert worst_quantile(None, BOX, budget=12, seed=3, evaluator=FunctionEvaluator(total)) == plain
    with pytest.raises(StudyError, match="a search needs a function, or an evaluator"):
        worst_quantile(None, BOX)


def test_failing_runs_are_counted_and_gone_round():
    def brittle(a, b):
        if a + b > 1.8:
            raise RuntimeError("diverged")
        return a - b

    found = worst_quantile(brittle, BOX, share=0.9, budget=30, seed=2)
    assert found.value == pytest.approx(1 - np.sqrt(0.2), abs=0.03)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_where_the_worst_cases_fail_it_is_that_of_the_cases_that_give_a_value(seed):
    """A margin that is lost below 0.2: a Kriging goes on to -0.5 where there is nothing."""

    def margin(a, b):
        y = 1.0 - 1.2 * a - 0.3 * b
        if y < 0.2:
            raise RuntimeError("slipped off")
        return y

    sample = np.random.default_rng(0).random((200_000, 2))
    y = 1.0 - 1.2 * sample[:, 0] - 0.3 * sample[:, 1]
    known = np.quantile(y[y >= 0.2], 0.05)
    found = worst_quantile(margin, BOX, share=0.95, sense="min", budget=30, seed=seed)
    assert found.lower <= known <= found.upper
    assert found.value == pytest.approx(known, abs=0.06)
    assert found.answered == pytest.approx(float((y >= 0.2).mean()), abs=0.1)
    assert "of the cases that give a value (between" in found.sentence


def test_without_failures_all_cases_count():
    found = worst_quantile(lambda a, b: a + b, BOX, budget=15, seed=0)
    assert (found.answered, found.failed) == (1.0, 0)
    assert "of all cases" in found.sentence


@pytest.mark.parametrize("share", [0.3, 0.995])
def test_a_share_that_a_sample_cannot_tell_is_refused(share):
    with pytest.raises(StudyError, match=f"share needs a chance from 0.5 to 0.99, got {share}; beyond"):
        worst_quantile(lambda a, b: a, BOX, share=share)


def test_constraints_that_leave_too_little_are_named():
    space = Space(BOX.parameters, constraints=("a + b <= 0.2",))
    with pytest.raises(StudyError, match="of 4000 samples meet the constraints of the space"):
        worst_quantile(lambda a, b: a, space, budget=10)
