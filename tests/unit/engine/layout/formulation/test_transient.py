"""Transient objectives: forward sensitivities, adjoint and an independent numpy twin agree."""

from dataclasses import replace

import numpy as np
import pytest

from studies.sensitivity_comparison import storyboards
from studies.three_body_layout import problem as three_body
from studies.two_body import layout_problem
from studies.two_body_layout import compare_sensitivities, plot_sensitivities
from studies.two_body_layout import problem as two_body
from workbench.engine import Bushing, NotSupported, simulate
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.engine.layout.formulation.transient import (
    Scenario,
    TransientObjective,
    member_geometry,
    transient_problem,
)

SAME = 1e-10  # two exact derivatives of one computed history: rounding of 400 steps
DIFFERENCE = 1e-6  # central differences


def verlet_twin(record, density):
    """Squared displacement of body 1 seen from body 2 by velocity Verlet, with sensitivities, in numpy."""
    geometry = member_geometry(record.system)
    p1, p2 = geometry.point_a, geometry.point_b
    length = np.linalg.norm(p1 - p2, axis=1)
    k = np.array([m.law.k for m in record.system.members])
    mass = np.array([60, 60, 10, 2000, 2000, 6000.0])
    external = np.array([0, -60 * 9.8, 0, 2000 * 9.8, -2000 * 9.8, 6000 * 20.0])

    def force(q):
        turn = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in q[[2, 5]]]
        u, w = p1 @ turn[0].T, p2 @ turn[1].T
        d = q[:2] + u - q[3:5] - w
        now = np.linalg.norm(d, axis=1)
        n = d / now[:, None]
        b = np.column_stack(
            [n, u[:, 0] * n[:, 1] - u[:, 1] * n[:, 0], -n, w[:, 1] * n[:, 0] - w[:, 0] * n[:, 1]]
        )
        by_alpha = -(k * (now - length))[:, None] * b
        return external + density @ by_alpha, by_alpha.T

    def tangent(q):
        h = 1e-7
        return np.column_stack([(force(q + h * e)[0] - force(q - h * e)[0]) / (2 * h) for e in np.eye(6)])

    h = record.t_end / record.steps
    q, v = np.zeros(6), np.zeros(6)
    f, fa = force(q)
    a, A = f / mass, fa / mass[:, None]
    X = np.zeros_like(A)
    V = np.zeros_like(A)
    values, gradients = [0.0], [np.zeros(len(density))]
    for _ in range(record.steps):
        q = q + h * v + 0.5 * h * h * a
        X = X + h * V + 0.5 * h * h * A
        f, fa = force(q)
        new, New = f / mass, (fa + tangent(q) @ X) / mass[:, None]
        v, V = v + 0.5 * h * (a + new), V + 0.5 * h * (A + New)
        a, A = new, New
        e = q[:2] - q[3:5]  # |A2^T e| = |e|
        values.append(e @ e)
        gradients.append(2 * e @ (X[:2] - X[3:5]))
    return np.array(values), np.array(gradients)


def perturbed(problem, seed=0):
    return np.clip(problem.start * np.random.default_rng(seed).uniform(0.5, 1.5, problem.members), 1e-4, 1)


def test_the_history_and_its_gradients_agree_with_a_numpy_twin():
    record = layout_problem("short")
    problem = two_body("short", sensitivities="forward")
    density = perturbed(problem)
    evaluation = problem.evaluate(density)
    values, gradients = verlet_twin(record, density)
    assert evaluation.values[0] == pytest.approx(values, rel=1e-9, abs=1e-15)
    rows = np.array([40, 112, 200])
    found = evaluation.gradients(rows)
    # the twin's tangent is a difference quotient
    assert np.abs(found - gradients[rows]).max() <= DIFFERENCE * np.abs(gradients[rows]).max()


@pytest.mark.parametrize(
    "make",
    [
        lambda way: two_body("short", sensitivities=way),
        lambda way: two_body("short", peak="refined", sensitivities=way),
        lambda way: two_body("energy", peak="refined", sensitivities=way),
        lambda way: two_body("short", power=3.0, sensitivities=way),
        lambda way: three_body(sensitivities=way),
    ],
    ids=["displacement", "refined", "energy", "power", "joint"],
)
def test_forward_and_adjoint_agree_at_every_time(make):
    forward, adjoint = make("forward"), make("adjoint")
    density = perturbed(forward)
    one, two = forward.evaluate(density), adjoint.evaluate(density)
    assert one.values == pytest.approx(two.values, rel=1e-13)
    top = int(np.argmax(one.values))
    rows = np.unique([20, 60, 100, top, min(top + 1, one.values.size - 1)])  # five rows: more than "few"
    first, second = one.gradients(rows), two.gradients(rows)
    assert np.abs(first - second).max() <= SAME * np.abs(second).max()


def test_gradients_agree_with_differences_through_the_joint():
    problem = three_body()
    density = perturbed(problem)
    rng = np.random.default_rng(1)
    direction = rng.normal(size=problem.members)
    row = np.array([int(np.argmax(problem.evaluate(density).values))])
    slope = problem.evaluate(density).gradients(row)[0] @ direction
    h = 1e-6
    ahead, behind = (problem.evaluate(density + s * h * direction).values.ravel()[row] for s in (1, -1))
    assert slope == pytest.approx(float((ahead - behind)[0]) / (2 * h), rel=DIFFERENCE)


def test_the_second_order_model_is_right_to_second_order():
    problem = two_body("short", sensitivities="forward")
    density = perturbed(problem)
    evaluation = problem.evaluate(density)
    direction = np.random.default_rng(2).normal(size=problem.members) * 1e-2
    errors = [
        np.abs(evaluation.model(h * direction) - problem.evaluate(density + h * direction).values).max()
        for h in (1.0, 0.5, 0.25)
    ]
    order = np.polyfit(np.log([1.0, 0.5, 0.25]), np.log(errors), 1)[0]
    assert order > 1.9
    rows = np.array([50, 112])
    change = evaluation.gradients(rows) @ direction + 0.5 * ((evaluation.factors(rows) @ direction) ** 2).sum(
        axis=1
    )
    assert evaluation.values.ravel()[rows] + change == pytest.approx(
        evaluation.model(direction).ravel()[rows], rel=1e-12
    )


def test_velocities_and_accelerations_are_differentiated_too():
    record = layout_problem("short")
    density = np.full(1020, 0.1)
    direction = np.random.default_rng(3).normal(size=1020)
    h = 1e-6
    runs = [
        simulate(record.system, density + s * h * direction, 0.1, 50, scheme=record.scheme) for s in (1, -1)
    ]
    run = simulate(record.system, density, 0.1, 50, scheme=record.scheme)
    found = run.state_sensitivities(with_rates=True)
    for table, name in (
        (found.position, "position"), (found.velocity, "velocity"), (found.acceleration, "acceleration")
    ):  # fmt: skip
        expected = (getattr(runs[0], name) - getattr(runs[1], name)) / (2 * h)
        assert table @ direction == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_one_scenario_that_cannot_go_forward_sends_all_backward():
    """A grip with a damage stands in the second case alone: the first one says nothing of it."""
    record = layout_problem("short")
    name = record.system.bodies[0].name
    held = replace(record.system, bushings=(Bushing(a=name, b="ground", k=100.0),))
    cases = [
        Scenario(system=system, objective=record.objective, t_end=0.1, steps=50, scheme=record.scheme)
        for system in (record.system, held)
    ]
    objective = TransientObjective(cases)
    evaluation = objective(np.full(1020, 0.1))
    rows = np.array([20, 30, 40, 50, 71, 81, 91, 101])  # more than "few" of either run
    alone = [TransientObjective([case], sensitivities="adjoint")(np.full(1020, 0.1)) for case in cases]
    expected = np.vstack([run.gradients(rows[:4]) for run in alone])
    assert "that of scenario 2 has internal states" in objective.reason
    assert evaluation.gradients(rows) == pytest.approx(expected, rel=1e-12)


def test_scenarios_stand_side_by_side():
    record = layout_problem("short")
    half = Scenario(
        system=replace(record.system, gravity=(0.0, 0.0)), objective=record.objective, t_end=0.2, steps=200,
        scheme=record.scheme, scale=2.0,
    )  # fmt: skip
    whole = Scenario(
        system=record.system, objective=record.objective, t_end=0.2, steps=200, scheme=record.scheme
    )
    problem = transient_problem([whole, half], start=0.1, budgets=[(np.ones(1020), 102.0)], lower=1e-4)
    evaluation = problem.evaluate(problem.start)
    assert evaluation.values.shape == (2, 201)
    alone = transient_problem([half], start=0.1, budgets=[(np.ones(1020), 102.0)], lower=1e-4)
    row = evaluation.gradients(np.array([301]))
    assert row == pytest.approx(alone.evaluate(problem.start).gradients(np.array([100])), rel=1e-12)


def test_the_choice_of_sensitivities_gives_its_reason():
    record = layout_problem("short")
    one = Scenario(
        system=record.system, objective=record.objective, t_end=0.2, steps=200, scheme=record.scheme
    )
    assert TransientObjective([one]).reason.startswith(
        "forward sensitivities: 6 coordinates and 1020 members"
    )
    long = replace(one, steps=20_000)
    assert "would take" in TransientObjective([long]).reason
    assert TransientObjective([one], sensitivities="adjoint").reason == "adjoint sensitivities: as asked"


def test_scenarios_must_fit_together():
    record = layout_problem("short")
    one = Scenario(system=record.system, objective=record.objective, t_end=0.2, steps=200)
    with pytest.raises(InvalidLayout, match="at least one scenario"):
        TransientObjective([])
    with pytest.raises(InvalidLayout, match="the same number of steps and of members"):
        TransientObjective([one, replace(one, steps=100)])


def test_forward_sensitivities_refuse_laws_in_python():
    from workbench.engine import Body, Load, Member, System, UserLaw

    law = UserLaw(force=lambda delta, rate, t: 10.0 * delta)
    system = System(
        bodies=(Body(name="1", mass=1.0, inertia=1.0),),
        members=(Member(a="1", b="ground", point_b=(1.0, 0.0), law=law),),
        loads=(Load(body="1", force=(1.0, 0.0)),),
    )  # fmt: skip
    with pytest.raises(NotSupported, match="use the adjoint"):
        simulate(system, np.ones(1), 0.1, 10).state_sensitivities()


def test_the_frozen_load_of_chapter_iv_ends_far_above_the_exact_gradient():
    ds = compare_sensitivities(("discrete_adjoint", "time_integration", "constant_load"), evaluations=12)
    exact, chapter_v, frozen = ds.best.values[:, -1]
    assert chapter_v == pytest.approx(exact, rel=1e-6)
    assert frozen > 1.5 * exact
    assert (np.diff(ds.best.values, axis=1) <= 0).all()
    (ax,) = plot_sensitivities(ds).axes
    assert len(ax.get_lines()) == 3


def test_the_studies_of_engine_runs_draw_every_still():
    boards = storyboards()
    assert sorted(boards) == ["three_body", "two_body"]
    for figure in boards.values():
        assert [text.get_text() for text in figure.axes[0].texts] == ["0 s", "0.1 s", "0.2 s"]
