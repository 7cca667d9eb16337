"""Predictions of histories and peaks from runs, and what is kept of a run."""

import numpy as np
import pytest

from studies.whole_members import random_problem, random_scenarios
from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.formulation.transient import transient_problem
from workbench.engine.layout.whole.prediction import KINDS, predicted
from workbench.engine.layout.whole.runs import Runs


def runs_of(problem, count, *, seed=0, limit=300):
    kept = Runs(problem=problem, limit=limit)
    rng = np.random.default_rng(seed)
    for _ in range(count):
        density = problem.lower + rng.random(problem.members) * (problem.upper - problem.lower)
        kept.add(density, problem.evaluate(density))
    return kept


@pytest.mark.parametrize("kind", KINDS)
def test_designs_near_those_that_were_simulated_are_foretold(kind):
    problem, _ = random_problem(1, most=1500)
    kept = runs_of(problem, 30)
    fit = predicted(kept, kind)
    place = int(np.argmin([h.max() for h in kept.histories]))
    beside = np.clip(kept.shares[place] + 0.02 * np.random.default_rng(1).normal(size=problem.members), 0, 1)
    truth = problem.evaluate(problem.lower + beside * (problem.upper - problem.lower)).values.max()
    at = fit.features(beside[None], np.eye(problem.members))
    expected = fit.unit * np.sinh(fit.values(at))[0]
    assert expected == pytest.approx(truth, rel=0.02)
    again = predicted(kept, kind, fit.setting)
    assert again.values(at) == pytest.approx(fit.values(at))
    assert abs(fit.error(at, truth)) < 4


def test_nothing_is_expected_of_what_is_known_and_much_of_what_looks_better():
    roots = np.random.default_rng(0).normal(size=(3, 8))

    def bowl(x):
        bent = roots @ (x - 0.3)
        return 1 + float(bent @ bent), 2 * bent @ roots

    problem = static_problem(bowl, start=np.full(8, 0.5))
    kept = runs_of(problem, 20)
    best = min(h.max() for h in kept.histories)
    fit = predicted(kept, "peaks")
    at_best = kept.shares[int(np.argmin([h.max() for h in kept.histories]))]
    at = fit.features(np.array([at_best, np.full(8, 0.3)]), np.eye(8))
    known, better = fit.improvement(at, best)
    assert (fit.improvement(at, best, doubt=3.0) > (known, better)).all()
    assert known < 0.05 * better
    assert 0.1 < better < 1 - 0.5 / best  # the optimum is 1


def test_slopes_of_histories_are_kept_where_they_come_with_the_run():
    scenarios, _ = random_scenarios(1, most=1500)
    forward, _ = random_problem(1, most=1500)
    backward = transient_problem(scenarios, start=0.2, budgets=[], lower=1e-4, sensitivities="adjoint")
    density = np.full(forward.members, 0.4)
    kept, swept = (Runs(problem=p, limit=300) for p in (forward, backward))
    tops, slopes = kept.add(density, forward.evaluate(density))
    same, swept_slopes = swept.add(density, backward.evaluate(density))
    assert tops == pytest.approx(same)
    assert slopes == pytest.approx(swept_slopes, rel=1e-6, abs=1e-9 * np.abs(slopes).max())
    assert swept.slopes is None
    step = 1e-5 * np.random.default_rng(2).normal(size=forward.members)
    kept.add(density + step, forward.evaluate(density + step))
    width = forward.upper - forward.lower
    change = (kept.histories[1] - kept.histories[0]).ravel()
    assert kept.slopes is not None
    assert change == pytest.approx(kept.slopes[0] @ (step / width), rel=1e-2, abs=1e-7)


def test_long_histories_are_kept_by_the_largest_value_of_each_block():
    problem, _ = random_problem(1, most=1500)
    density = np.full(problem.members, 0.4)
    values = problem.evaluate(density).values
    few = Runs(problem=problem, limit=int(2e7 / (problem.members * 20 * len(values))))
    few.add(density, problem.evaluate(density))
    assert few.slopes is not None
    assert few.histories[0].shape == (len(values), 20)
    assert few.histories[0].max(axis=1) == pytest.approx(values.max(axis=1))
    assert few.slopes[0].shape == (20 * len(values), problem.members)


def test_histories_are_foretold_without_their_slopes():
    scenarios, _ = random_scenarios(1, most=1500)
    problem = transient_problem(scenarios, start=0.2, budgets=[], lower=1e-4, sensitivities="adjoint")
    kept = runs_of(problem, 40)
    fit = predicted(kept, "histories")
    best = min(h.max() for h in kept.histories)
    at = fit.features(np.array(kept.shares), np.eye(problem.members))
    assert fit.improvement(at, best).max() < 0.05
