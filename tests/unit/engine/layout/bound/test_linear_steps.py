"""Many further limits: trusses with limited stresses against the linear programme, feasibility."""

from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from workbench.engine.layout.bound.linear_steps import linear_steps
from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.history import Recorder
from workbench.engine.layout.outcome.result import LayoutStatus


def truss(seed, cases):
    """A small ground structure of random size under random loads."""
    rng = np.random.default_rng(seed)
    columns, rows = (int(k) for k in rng.integers((3, 2), (6, 5)))
    width, height = rng.uniform(1, 5, 2)
    loads = []
    for _ in range(cases):
        i, j, angle = rng.integers(1, columns), rng.integers(0, rows), rng.uniform(0, 2 * np.pi)
        place = (i * width / (columns - 1), j * height / (rows - 1))
        loads.append((((np.cos(angle), np.sin(angle)), place),))
    return trusses.ground_structure(columns=columns, rows=rows, width=width, height=height, loads=loads)


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(s, marks=pytest.mark.slow) for s in range(3, 8))])
def test_one_load_case_reaches_the_linear_programme(seed):
    one = truss(seed, 1)
    result = optimise_layout(trusses.stress_limited(one), max_evaluations=100)
    assert "linear programmes" in result.strategy
    assert result.excess <= 1e-9
    assert 1 - 1e-9 <= result.value / trusses.least_volume(one) <= 1.01


@pytest.mark.parametrize("seed", range(3))
def test_several_load_cases_do_no_worse_than_stress_ratio_resizing(seed):
    one = truss(20 + seed, 3)
    problem, floor = trusses.stress_limited(one), trusses.least_volume(one)
    result = optimise_layout(problem, max_evaluations=100)
    areas, resized = problem.start, np.inf
    for _ in range(100):
        ratio = (problem.evaluate(areas).constraints + 1).reshape(3, -1).max(axis=0)
        resized = min(resized, float(one.lengths @ areas) * ratio.max())
        areas = np.clip(areas * ratio, problem.lower, problem.upper)
    assert floor * (1 - 1e-9) <= result.value <= 1.02 * resized
    assert result.excess <= 1e-9


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(s, marks=pytest.mark.slow) for s in range(3, 40))])
def test_feasible_limits_are_met_from_random_starts(seed):
    rng = np.random.default_rng(seed)
    one = truss(seed, int(rng.integers(1, 5)))
    problem = trusses.stress_limited(one)
    start = problem.start * 10.0 ** rng.uniform(-3, 0.5, problem.members)
    problem = replace(problem, start=np.clip(start, problem.lower, problem.upper))
    result = optimise_layout(problem, max_evaluations=60)
    assert result.status not in (LayoutStatus.INFEASIBLE, LayoutStatus.NONE_FOUND)
    assert result.excess <= 1e-9


def test_a_few_limits_go_on_from_where_approximations_leave_off():
    one = truss(3, 2)
    limit = 2 * trusses.problem(one).evaluate(np.ones(len(one.ends))).values.ravel()

    def compliances(a):
        values, gradients, _ = one.compliances(a)
        return values / limit - 1, gradients / limit[:, None]

    problem = static_problem(
        lambda a: (float(one.lengths @ a), one.lengths.copy()), start=np.full(len(one.ends), 0.2), lower=1e-4,
        upper=10.0, constraints=compliances,
    )  # fmt: skip
    result = optimise_layout(problem, max_evaluations=100)
    assert result.excess <= 1e-9
    assert result.value < 0.6 * one.lengths.sum() / 2  # half of the equal areas meets the limits


def test_a_failing_trial_shortens_the_step():
    def fragile(a):
        if a.min() < 0.05:
            raise InvalidLayout("too thin")
        return 1 - a, -np.eye(3)

    problem = static_problem(
        lambda a: (float(a @ a), 2 * a), start=np.full(3, 1.9), lower=1e-3, upper=2.0, constraints=fragile
    )
    result = optimise_layout(problem, "linear_steps", max_evaluations=60)
    assert result.value == pytest.approx(3.0, rel=1e-6)
    assert result.status is LayoutStatus.CONVERGED


def test_poor_steps_are_corrected_and_nothing_is_hidden():
    # 200 bars: stresses of light members bend strongly
    one = trusses.ground_structure(
        columns=6, rows=4, width=3.0, height=2.0, loads=((((0.0, -1.0), (3.0, 2.0)),),)
    )
    problem, seen = trusses.stress_limited(one), []
    inner = problem.evaluate
    problem = replace(problem, evaluate=lambda x: (seen.append(x.copy()), inner(x))[1])
    recorder = Recorder(problem, keep=True)
    linear_steps(problem, recorder, max_evaluations=60, tolerance=1e-6)
    assert recorder.best <= 1.005 * trusses.least_volume(one)
    assert recorder.evaluations <= 60
    assert len(recorder.history) == recorder.evaluations == len(seen)
    refused = [entry for entry in recorder.history if not entry.accepted]
    assert len(refused) >= 2
