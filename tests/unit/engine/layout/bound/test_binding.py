"""A search by the scenarios that bind: every design is judged by all, few are run, and none is forgotten."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from studies.whole_members import random_scenarios
from workbench.engine import Load
from workbench.engine.layout.bound.binding import ByScenario, is_by_scenario
from workbench.engine.layout.formulation.problem import InvalidLayout, TabulatedRows, static_problem
from workbench.engine.layout.formulation.remembered import remembering
from workbench.engine.layout.formulation.transient import transient_problem
from workbench.engine.layout.optimise import optimise_layout

SCENARIOS = 12
SAME = 1e-12  # rows of the same runs
SETTLED = 1e-6


def many_cases(seed, *, scenarios=SCENARIOS):
    """The springs of a random problem under so many pushes, gradients by sweeps."""
    rng = np.random.default_rng([seed, 7])
    some, _ = random_scenarios(seed, most=1500)
    cases = []
    for k in range(scenarios):
        angle, size = rng.uniform(0, 2 * np.pi), rng.uniform(0.6, 1.0)
        load = Load(
            body="2", torque=6000.0 * rng.uniform(-20, 20),
            force=(19600.0 * size * np.cos(angle), 19600.0 * size * np.sin(angle)),
        )  # fmt: skip
        cases.append(replace(some[0], system=replace(some[0].system, loads=(load,)), name=f"case {k}"))
    n = len(cases[0].system.members)
    return transient_problem(
        cases, start=0.4, lower=1e-3, budgets=[(np.ones(n), 0.4 * n)], sensitivities="adjoint"
    )


def search(problem, scenarios="binding", evaluations=12):
    return optimise_layout(
        problem, max_evaluations=evaluations, compare=False, multi_start=False, scenarios=scenarios
    )


def test_some_scenarios_of_an_objective_are_rows_of_the_whole():
    problem = many_cases(3, scenarios=5)
    density = problem.into_budgets(np.linspace(0.1, 0.9, problem.members))
    whole, part = problem.evaluate(density), problem.evaluate.of_scenarios([3, 1])(density)
    np.testing.assert_allclose(part.values, whole.values[[3, 1]], rtol=SAME)
    nodes = whole.values.shape[1]
    np.testing.assert_allclose(
        part.gradients(np.array([nodes + 40])), whole.gradients(np.array([nodes + 40])), rtol=SAME
    )


def test_who_remembers_the_last_evaluation_remembers_that_of_some_scenarios_too():
    problem = many_cases(3, scenarios=5)
    kept = remembering(problem.evaluate)
    assert isinstance(kept, ByScenario)
    part = kept.of_scenarios([2])
    assert part(problem.start) is part(problem.start)
    assert kept(problem.start) is kept(problem.start)
    assert not isinstance(remembering(lambda x: kept(x)), ByScenario)


def test_a_layout_is_judged_in_every_scenario_and_most_runs_are_of_a_few():
    problem, runs = many_cases(5), []
    objective = problem.evaluate
    monitored = type(objective)._evaluation

    class Counting(type(objective)):
        def _evaluation(self, design):
            runs.append(len(self.scenarios))
            return monitored(self, design)

    objective.__class__ = Counting
    result = search(problem)
    objective.__class__ = Counting.__base__
    assert result.value == pytest.approx(problem.evaluate(result.density).values.max(), rel=SAME)
    assert result.value == min(entry.value for entry in result.history)
    assert "scenarios that bind" in result.strategy
    few = [count for count in runs if count < SCENARIOS]
    assert len(few) > 2 * (len(runs) - len(few))
    assert max(few) <= SCENARIOS / 2
    assert result.evaluations <= 13  # a step and a check may end beyond the twelfth


def test_few_scenarios_lead_to_the_same_optimum_at_less_cost():
    together = {"binding": [], "all": []}
    for seed in (5, 8):
        problem = many_cases(seed)
        found = {way: search(problem, way, evaluations=40) for way in together}
        for way, result in found.items():
            together[way].append(result.evaluations)
        assert found["binding"].value <= found["all"].value * (1 + 1e-3)
    assert sum(together["binding"]) < sum(together["all"])


@dataclass
class Bowls:
    """Histories of two nodes, 1 + |x - centre|^2 and half of it, for every scenario.

    fails: where not empty, several scenarios at once cannot be run where x is small.
    """

    centres: np.ndarray
    fails: tuple[int, ...] = ()

    def __call__(self, x):
        if len(self.centres) > 1 and self.fails and x[0] < 0.2:
            raise ArithmeticError("the run stopped")
        rows = np.repeat(1.0 + ((x - self.centres) ** 2).sum(axis=1), 2).reshape(-1, 2) * [1.0, 0.5]
        slopes = np.repeat(2 * (x - self.centres), 2, axis=0) * np.tile([1.0, 0.5], len(rows))[:, None]
        return TabulatedRows(values=rows, gradient_table=slopes, constraint_gradients=np.zeros((0, len(x))))

    def of_scenarios(self, chosen):
        return Bowls(self.centres[list(chosen)], self.fails)


def bowls(fails=(), scenarios=12):
    rng = np.random.default_rng(2)
    centres = np.vstack([[0.0, 0.0, 0.0], rng.uniform(0.4, 0.6, (scenarios - 1, 3))])
    base = static_problem(lambda x: (float(x @ x), 2 * x), start=np.full(3, 0.9), budgets=[(np.ones(3), 3.0)])
    return replace(base, evaluate=Bowls(centres, tuple(fails)))


def test_the_search_ends_by_itself_at_the_optimum_of_all():
    few, whole = search(bowls(), evaluations=60), search(bowls(), "all", evaluations=60)
    assert few.kkt <= 1e-3
    assert few.evaluations < 60
    assert few.value == pytest.approx(whole.value, rel=SETTLED)


def test_a_design_that_another_scenario_cannot_stand_sends_the_search_back_to_all():
    problem = bowls(fails=(4,))
    result = search(problem, evaluations=40)
    assert np.isfinite(result.value)
    assert any(not np.isfinite(entry.value) for entry in result.history)
    assert result.density[0] >= 0.2
    assert result.value <= search(problem, "all", evaluations=40).value * (1 + SETTLED)


def test_few_scenarios_static_rows_and_other_objectives_are_searched_as_ever():
    few = many_cases(5, scenarios=10)
    assert not is_by_scenario(few, few.evaluate(few.start))
    assert search(few).value == search(few, "all").value
    many = many_cases(5)
    plain = replace(many, evaluate=lambda x: many.evaluate(x))
    assert "scenarios that bind" not in search(plain, evaluations=4).strategy


def test_other_words_are_refused():
    with pytest.raises(InvalidLayout, match="scenarios needs to be 'all' or 'binding', got 'some'"):
        search(many_cases(5, scenarios=2), "some")
