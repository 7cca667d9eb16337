"""Equivalent static loads: a structure at rest stands as the run did; slopes, the method, refusals."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from studies import trusses
from studies.three_body_layout import problem as three_body
from studies.whole_members import random_scenarios
from workbench.engine import Belt, Member, RevoluteJoint, StoredEnergy
from workbench.engine.layout.formulation.limits import Limit
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.engine.layout.formulation.static_loads import static_evaluation, static_loads
from workbench.engine.layout.formulation.transient import transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.objectives.reductions import Maximum


def springs(seed=1, **options):
    scenarios, _ = random_scenarios(seed, most=1500)
    n = len(scenarios[0].system.members)
    return scenarios, transient_problem(
        scenarios, start=0.4, budgets=[(np.ones(n), 0.4 * n)], lower=1e-3, **options
    )


@pytest.mark.parametrize("difference", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_static_structure_stands_as_the_run_did(seed, difference):
    scenarios, problem = springs(seed)
    r = np.random.default_rng(seed)
    density = r.uniform(0.2, 0.9, problem.members)
    evaluation = problem.evaluate(density)
    cases = [static_loads(run, difference=difference) for run in evaluation.runs]
    found = static_evaluation(cases, density)
    assert found.values.shape == (len(scenarios), scenarios[0].steps)  # every node but the start
    assert found.values == pytest.approx(evaluation.values[:, 1:], rel=1e-9, abs=1e-12)
    # and its slopes are its own
    at = np.clip(density + 0.05 * r.normal(size=len(density)), 0.01, 1.0)
    here, rows = static_evaluation(cases, at), np.array([20, 44, 57])
    step = 1e-6
    for i in range(problem.members):
        e = step * np.eye(problem.members)[i]
        up, down = (static_evaluation(cases, at + s * e).values.ravel()[rows] for s in (1, -1))
        slopes = here.gradients(rows)
        assert (up - down) / (2 * step) == pytest.approx(slopes[:, i], abs=2e-7 * np.abs(slopes).max())


def test_for_small_slow_motion_the_two_variants_and_the_transient_slopes_agree():
    """Slow loads on springs that hardly move: inertia and large motion do not matter, so ESL is exact."""
    scenarios, _ = springs()
    gentle = []
    for scenario in scenarios[:1]:
        system = scenario.system
        loads = tuple(
            replace(
                load, body="1", force=lambda t, f=load.force: tuple(1e-3 * x * t**2 for x in f), torque=0.0
            )
            for load in system.loads
        )
        bodies = (system.bodies[0], replace(system.bodies[1], mass=1e6, inertia=1e6))
        damped = tuple(replace(m, law=replace(m.law, c=600.0)) for m in system.members)
        gentle.append(
            replace(
                scenario, t_end=3.0, steps=300,
                system=replace(system, loads=loads, bodies=bodies, members=damped, gravity=(0.0, 0.0)),
            )
        )  # fmt: skip
    n = len(gentle[0].system.members)
    problem = transient_problem(gentle, start=0.4, budgets=[(np.ones(n), 0.4 * n)], lower=1e-3)
    evaluation = problem.evaluate(problem.start)
    last = np.array([evaluation.values.size - 1])
    true = evaluation.gradients(last)[0]
    for difference in (False, True):
        case = static_loads(evaluation.runs[0], difference=difference)
        slope = static_evaluation([case], problem.start).gradients(np.array([len(case.displacement) - 1]))[0]
        cosine = slope @ true / np.linalg.norm(slope) / np.linalg.norm(true)
        assert cosine > 0.97


@pytest.mark.parametrize("method", ["esl", "esl_difference"])
def test_the_method_improves_a_layout_and_never_loses_the_best(method):
    _, problem = springs()
    found = optimise_layout(problem, method, max_evaluations=12)
    best = [entry.best for entry in found.history]
    assert found.value < 0.9 * found.start_value
    assert all(after <= before for before, after in pairwise(best))
    assert found.excess <= 1e-9
    assert found.evaluations <= 12
    assert found.strategy.startswith("equivalent static loads")
    assert float(problem.evaluate(found.density).values.max()) == found.value


@pytest.mark.slow
def test_joints_are_kept_by_the_static_structure():
    problem = three_body()
    evaluation = problem.evaluate(problem.start)
    for difference in (False, True):
        (run,) = evaluation.runs
        case = static_loads(run, difference=difference)
        assert case.jacobian.shape[1] == 2
        found = static_evaluation([case], problem.start)
        assert found.values.max() == pytest.approx(evaluation.values.max(), rel=1e-6)


def test_what_has_no_static_counterpart_is_refused():
    scenarios, problem = springs()
    one = scenarios[0]
    with pytest.raises(InvalidLayout, match="need the runs of moving systems"):
        optimise_layout(trusses.cantilever(), "esl")
    moved = Maximum(quantity=one.objective.quantity)
    _, limited = springs(limits=[Limit(name="moved", objective=moved, at_most=1.0)])
    with pytest.raises(InvalidLayout, match="budgets only"):
        optimise_layout(limited, "esl")

    def changed(**changes):
        n = len(changes.get("system", one.system).members)
        return transient_problem([replace(one, **changes)], start=0.4, budgets=[(np.ones(n), 0.4 * n)])

    with pytest.raises(InvalidLayout, match="the maximum of a Deviation"):
        optimise_layout(changed(objective=Maximum(quantity=StoredEnergy())), "esl")
    tied = Member(a="1", b="ground", point_b=(1.0, 0.0), law=Belt())
    with pytest.raises(InvalidLayout, match="ends at another body"):
        optimise_layout(changed(system=replace(one.system, members=(*one.system.members, tied))), "esl")
    pinned = replace(one.system, joints=(RevoluteJoint(a="1", b="ground"),))
    with pytest.raises(InvalidLayout, match="RevoluteJoint 1-ground ends at another body"):
        optimise_layout(changed(system=pinned), "esl")
    powered = tuple(replace(m, power=2.0) for m in one.system.members)
    with pytest.raises(InvalidLayout, match="members of power 1"):
        optimise_layout(changed(system=replace(one.system, members=powered)), "esl")
    assert problem.members > 0
