"""Limits along the runs: their rows, exact gradients, prices, and the sentences on them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.limited_layouts import DEVIATION, limited, scenarios
from workbench.engine import (
    ClipLevel,
    HeadInjury,
    Maximum,
    MemberElongation,
    MemberForce,
    Minimum,
    PlaneClearance,
    PointAcceleration,
    PointDistance,
    PointSpeed,
    Terminal,
)
from workbench.engine.layout.formulation.limits import Limit
from workbench.engine.layout.formulation.material import least_material
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.engine.layout.formulation.transient import transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.result import LayoutStatus

DIFFERENCES = 1e-6  # relative to the largest slope of a row
STEP = 1e-4
PRICE = 0.02  # the second order of a change of 0.2 %

HEAD = {"body": "1", "point": (0.1, 0.1)}
ACCELERATION = PointAcceleration(**HEAD)
PUSH, STROKE = MemberForce(member=2, sense="compression"), MemberElongation(member=0, sense="shorter")
ROOM = PointDistance(a="1", b="2", point_a=(0.3, 0.0), point_b=(1.0, 0.2))
EVERY = (
    Limit(name="speed", objective=Maximum(quantity=PointSpeed(**HEAD)), at_most=2.0, unit="m/s"),
    Limit(name="acceleration", objective=Maximum(quantity=ACCELERATION), at_most=20.0, unit="m/s^2"),
    Limit(name="clip", objective=ClipLevel(quantity=ACCELERATION, duration=0.03), at_most=20.0),
    Limit(name="injury", objective=HeadInjury(quantity=ACCELERATION, duration=0.1), at_most=2.0),
    Limit(name="force", objective=Maximum(quantity=MemberForce(member=1)), at_most=500.0, unit="N"),
    Limit(name="push", objective=Maximum(quantity=PUSH), at_most=500.0, unit="N"),
    Limit(name="stroke", objective=Maximum(quantity=STROKE), at_most=0.1, unit="m"),
    Limit(name="room", objective=Minimum(quantity=ROOM), at_least=0.5, unit="m"),
    Limit(
        name="wall", objective=Minimum(quantity=PlaneClearance(**HEAD, normal=(1.0, 0.5))), at_least=0.0,
        scale=0.1,
    ),
    Limit(name="end", objective=Terminal(quantity=DEVIATION), at_most=0.01),
)  # fmt: skip


def test_gradients_of_every_limit_are_those_of_differences():
    some = scenarios(2)
    members = len(some[0].system.members)
    problem = transient_problem(some, start=0.5, budgets=[], lower=1e-3, limits=EVERY)
    density = np.random.default_rng(3).uniform(0.3, 0.8, members)
    found = problem.evaluate(density)
    assert {row.name for row in found.limit_rows} == {limit.name for limit in EVERY}
    assert {row.scenario for row in found.limit_rows} == set(range(len(some)))
    slopes = found.constraint_gradients
    for i in (0, 3):
        e = STEP * np.eye(members)[i]
        near, far = (
            problem.evaluate(density + k * e).constraints - problem.evaluate(density - k * e).constraints
            for k in (1, 2)
        )
        np.testing.assert_allclose(
            slopes[:, i], (8 * near - far) / (12 * STEP), rtol=0,
            atol=DIFFERENCES * np.abs(slopes).max(axis=1).max(),
        )  # fmt: skip


def test_a_power_of_the_density_reaches_the_limits():
    some = scenarios(2)
    plain, cubed = (
        transient_problem(some, start=0.5, budgets=[], lower=1e-3, limits=EVERY[:1], power=p)
        for p in (1.0, 3.0)
    )
    density = np.linspace(0.3, 0.8, plain.members)
    slopes = cubed.evaluate(density).constraint_gradients
    expected = plain.evaluate(density**3).constraint_gradients * 3 * density**2
    np.testing.assert_allclose(slopes, expected, rtol=1e-9)


def test_prices_are_what_loosening_a_limit_brings():
    problem, limits, some = limited(1, "material")
    found = optimise_layout(problem, max_evaluations=60)
    assert found.status is LayoutStatus.CONVERGED
    assert found.excess <= 1e-9
    by_name = {limit.name: limit for limit in found.limits}
    binding = by_name["displacement"]
    assert binding.value == pytest.approx(binding.bound, rel=1e-6)
    looser = [replace(limits[0], at_most=limits[0].at_most * 1.002), limits[1]]
    again = least_material(transient_problem(some, start=0.6, budgets=[], lower=1e-3, limits=looser))
    gain = found.value - optimise_layout(replace(again, start=found.density), max_evaluations=60).value
    assert binding.price * 0.002 * binding.bound == pytest.approx(gain, rel=PRICE)
    said = " ".join(found.verdicts)
    assert "'displacement' (at most " in said
    assert "loosening it by 1 % would lower the objective by about" in said


def test_a_limit_that_does_not_bind_costs_nothing():
    problem, limits, some = limited(1, "material")
    wide = [limits[0], replace(limits[1], at_most=1e3 * limits[1].at_most)]
    problem = least_material(transient_problem(some, start=0.6, budgets=[], lower=1e-3, limits=wide))
    found = optimise_layout(problem, max_evaluations=40)
    assert any("'speed' (at most " in text and "costs nothing" in text for text in found.verdicts)
    assert found.limits[1].price == 0.0


def test_what_cannot_be_met_is_not_called_found():
    _, limits, some = limited(1, "material")
    problem = least_material(
        transient_problem(some, start=0.6, budgets=[], lower=1e-3, limits=[replace(limits[0], at_most=1e-9)])
    )
    found = optimise_layout(problem, max_evaluations=10)
    assert found.status is LayoutStatus.NONE_FOUND
    assert "1 is the size of the limit" in found.verdicts[1]


def test_messages():
    speed = Maximum(quantity=PointSpeed(body="1"))
    with pytest.raises(InvalidLayout, match="'v' needs either at_most or at_least"):
        Limit(name="v", objective=speed)
    with pytest.raises(InvalidLayout, match="'v' needs a finite bound, got inf"):
        Limit(name="v", objective=speed, at_most=np.inf)
    with pytest.raises(InvalidLayout, match="'v' needs scale > 0 where its bound is 0"):
        Limit(name="v", objective=speed, at_most=0.0)
    with pytest.raises(InvalidLayout, match="least_material needs a problem with limits"):
        optimise_layout(least_material(transient_problem(scenarios(2), start=0.5, budgets=[])))
