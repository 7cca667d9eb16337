"""Firing times and other numbers of laws as design variables: gradients, smoothness in time, layouts."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.engine import (
    Airbag,
    Belt,
    Body,
    Deviation,
    Integral,
    Load,
    LockingRetractor,
    Maximum,
    Member,
    MemberForce,
    PointSpeed,
    Retractor,
    Revolute,
    SpatialBody,
    SpatialLoad,
    SpatialMember,
    Spring,
    System,
    Timed,
    TreeSystem,
    VentedAirbag,
    Webbing,
)
from workbench.engine.layout.formulation.law_variables import LawVariable, variables_held
from workbench.engine.layout.formulation.limits import Limit
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.bill_of_materials import bill_of_materials
from workbench.engine.layout.outcome.purify import purify
from workbench.engine.tree.joints import Floating

SAME = 1e-6  # against central differences of fourth order
T, STEPS = 0.3, 120  # 2.5 ms a step


def laws():
    return (
        Spring(k=4e3, c=20.0),
        Timed(law=Belt(width=0.01, c=5.0), start=0.05, end=0.16, rise=0.02),
        Retractor(f0=400.0, sigma=3e3, t0=0.1),
        Timed(law=Airbag(width=0.01), start=0.08, rise=0.03),
        Airbag(c0=60.0, width=0.01, deploy=0.11, rise=0.02),
    )


def planar(seed):
    r = np.random.default_rng(seed)
    body = Body(name="torso", mass=40.0, inertia=2.0, velocity=(1.5, 0.2, r.uniform(-2, 2)), gravity=True)
    members = tuple(
        Member(
            a="torso", b="ground", law=law, point_a=tuple(r.uniform(-0.2, 0.2, 2)),
            point_b=tuple(r.uniform(-0.7, 0.7, 2)),
        )
        for law in laws() * 2
    )  # fmt: skip
    load = Load(body="torso", force=(2500.0, 800.0), torque=r.uniform(-60, 60))
    return System(bodies=(body,), members=members, loads=(load,)), Deviation(bodies=("torso",))


def tree(seed):
    r = np.random.default_rng(seed)
    bodies = (
        SpatialBody(name="torso", mass=40.0, inertia=np.diag([2.0, 1.5, 1.0]), joint=Floating()),
        SpatialBody(
            name="head", parent="torso", mass=5.0, inertia=np.eye(3) * 0.05, at=(0.0, 0.0, 0.4),
            centre=(0.0, 0.0, 0.1), joint=Revolute(axis=(0.0, 1.0, 0.0)),
        ),
    )  # fmt: skip
    members = tuple(
        SpatialMember(
            a=("torso", "head")[i % 3 == 2], law=law, point_a=tuple(r.uniform(-0.2, 0.2, 3)),
            point_b=tuple(r.uniform(-0.7, 0.7, 3)),
        )
        for i, law in enumerate(laws() * 2)
    )  # fmt: skip
    load = SpatialLoad(body="torso", point=(0.0, 0.05, 0.1), force=(2500.0, 800.0, -300.0))
    return TreeSystem(bodies=bodies, members=members, loads=(load,)), Deviation(
        bodies=("head",), weights=(1.0, 1.0, 1.0)
    )


VARIABLES = (
    LawVariable(name="belts", members=(1, 6), lower=0.02, upper=0.1),
    LawVariable(name="belts end", members=(1, 6), parameter="end", lower=0.13, upper=0.25),
    LawVariable(name="retractor", members=(2,), lower=0.03, upper=0.2),
    LawVariable(name="other retractor", members=(7,), lower=0.03, upper=0.2, start=0.05),
    LawVariable(name="bags", members=(4, 9), lower=0.02, upper=0.2),
    LawVariable(name="pull", members=(2, 7), parameter="f0", lower=100.0, upper=900.0, unit="N"),
    LawVariable(name="stiffness", members=(0,), parameter="k", lower=1e3, upper=9e3, unit="N/m"),
)


def limited(make, seed, **options):
    system, quantity = make(seed)
    body = "torso" if make is planar else "head"
    point = (0.1, 0.05) if make is planar else (0.0, 0.1, 0.1)
    limits = (
        Limit(name="speed", objective=Maximum(quantity=PointSpeed(body=body, point=point)), at_most=2.0),
        Limit(name="pull", objective=Maximum(quantity=MemberForce(member=2)), at_most=250.0, unit="N"),
        Limit(name="belt", objective=Integral(quantity=MemberForce(member=6)), at_most=40.0),
    )
    scenario = Scenario(system=system, objective=Maximum(quantity=quantity), t_end=T, steps=STEPS)
    n = len(system.members)
    return transient_problem(
        [scenario], start=0.4, budgets=[(np.ones(n), 0.4 * n)], lower=1e-3, variables=VARIABLES,
        limits=limits, **options,
    )  # fmt: skip


def by_differences(f, x, h):
    table = []
    for i in range(len(x)):
        e = h * np.eye(len(x))[i]
        table.append((8 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12 * h))
    return np.array(table).T


@pytest.mark.parametrize("power", [1.0, 2.0])
@pytest.mark.parametrize("make", [planar, pytest.param(tree, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", [3, 4])
def test_gradients_agree_with_differences_of_runs(make, seed, power):
    problem = limited(make, seed, power=power)
    r = np.random.default_rng(seed)
    x = np.r_[r.uniform(0.2, 0.8, problem.densities), r.uniform(0.2, 0.8, len(VARIABLES))]
    evaluation = problem.evaluate(x)
    peak = int(evaluation.values.argmax())
    rows = np.array([peak, 40, 77])
    found = evaluation.gradients(rows)

    def looked(y):  # a refined peak may move to the next node
        values = problem.evaluate(y).values
        return np.r_[values.max(), values.ravel()[rows[1:]]]

    quotients = by_differences(looked, x, 5e-5)
    for one, other in zip(found, quotients, strict=True):
        assert np.abs(one - other).max() <= SAME * np.abs(other).max()
        assert np.abs(one[problem.densities :]).max() > 0.0
    count = evaluation.constraints.size
    slopes = by_differences(lambda y: problem.evaluate(y).constraints[:count], x, 5e-5)
    for one, other in zip(evaluation.constraint_gradients, slopes, strict=True):
        assert np.abs(one - other).max() <= SAME * np.abs(other).max()


@pytest.mark.parametrize("make", [planar, pytest.param(tree, marks=pytest.mark.slow)])
def test_a_firing_time_between_two_steps_is_as_good_as_one_on_a_step(make):
    problem, k = limited(make, 5), 12  # the retractor
    x = problem.start.copy()
    step = T / STEPS / (VARIABLES[2].upper - VARIABLES[2].lower)

    def look(s):
        x[k] = s
        evaluation = problem.evaluate(x)
        row = np.array([90])
        return evaluation.values.ravel()[90], evaluation.gradients(row)[0, k]

    shares = 0.4 + step * np.linspace(0.0, 2.0, 65)
    values, slopes = np.array([look(s) for s in shares]).T
    # Simpson's rule over slopes gives the change of the value, through two steps
    width = shares[1] - shares[0]
    rise = width / 3 * (slopes[0] + slopes[-1] + 4 * slopes[1:-1:2].sum() + 2 * slopes[2:-2:2].sum())
    assert values[-1] - values[0] == pytest.approx(rise, rel=1e-7)


def test_restraints_fire_and_lock_at_times_that_can_be_designed():
    body = Body(name="torso", mass=40.0, inertia=2.0, velocity=(1.5, 0.2, 0.5), gravity=False)
    laws = (
        Webbing(k=4e3, slack=0.01, limit=600.0, pull=0.06, rise=0.04, speed=0.4, width=0.02),
        LockingRetractor(k=4e3, locks=0.1, limit=600.0, rise=0.04, speed=0.4, width=0.02),
        VentedAirbag(c0=60.0, width=0.01, rise=0.04, speed=0.4),
    )
    members = tuple(
        Member(a="torso", b="ground", law=law, point_a=(0.0, 0.1 * i), point_b=(place, 0.1))
        for i, (law, place) in enumerate(zip(laws, (-0.5, -0.6, 0.5), strict=True))
    )
    variables = tuple(
        LawVariable(name=name, members=(i,), lower=0.02, upper=0.2) for i, name in enumerate("abc")
    )
    problem = transient_problem(
        [
            Scenario(
                system=System(bodies=(body,), members=members), t_end=T, steps=STEPS,
                objective=Maximum(quantity=Deviation(bodies=("torso",))),
            )
        ],
        start=0.4, budgets=[(np.ones(3), 3.0)], variables=variables,
    )  # fmt: skip
    x, row = np.r_[0.7, 0.6, 0.8, 0.2, 0.4, 0.3], np.array([90])
    found = problem.evaluate(x).gradients(row)[0]
    (quotients,) = by_differences(lambda y: problem.evaluate(y).values.ravel()[row], x, 5e-5)
    assert np.abs(found - quotients).max() <= SAME * np.abs(quotients).max()
    assert np.abs(found[3:]).min() > 1e-6


def test_a_layout_finds_when_to_fire():
    """One retractor pulls a mass back that a push drives off; too early and too late are both worse."""
    mass = Body(name="mass", mass=10.0, inertia=1.0, gravity=False)
    pull = Member(
        a="mass", b="ground", point_b=(-5.0, 0.0), law=Retractor(f0=900.0, sigma=2e3, t0=0.1)
    )  # fmt: skip
    hold = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=50.0, c=5.0))
    push = Load(body="mass", force=lambda t: (400.0 if 0.1 < t < 0.2 else 0.0, 0.0))
    scenario = Scenario(
        system=System(bodies=(mass,), members=(pull, hold), loads=(push,)), t_end=0.5, steps=250,
        objective=Maximum(quantity=Deviation(bodies=("mass",))),
    )  # fmt: skip
    variable = LawVariable(name="retractor", members=(0,), lower=0.02, upper=0.48, start=0.3)
    problem = transient_problem(
        [scenario], start=[0.5, 0.5], budgets=[(np.ones(2), 1.2)], lower=1e-3, variables=(variable,)
    )
    found = optimise_layout(problem, max_evaluations=60)
    times = np.linspace(0.02, 0.48, 47)
    held = [
        optimise_layout(
            variables_held(problem, np.r_[problem.start[:2], (t - 0.02) / 0.46]), max_evaluations=25
        ).value
        for t in times[::4]
    ]
    assert found.value <= min(held) * (1 + 1e-3)
    assert 0.05 < found.variables["retractor"] < 0.25
    assert any("'retractor' is 0." in said and "s, of 0.02 to 0.48" in said for said in found.verdicts)
    assert any("of 2 members" in said for said in found.verdicts)
    bill = bill_of_materials(problem, found.density)
    assert len(bill.entries) + bill.left_out == 2
    assert {entry.kind for entry in bill.entries} <= {"impulse", "spring"}
    clean = purify(problem, found.density)
    assert clean.density[-1] == found.density[-1]


def test_what_cannot_be_a_variable_is_refused():
    system, quantity = planar(1)
    scenario = Scenario(system=system, objective=Maximum(quantity=quantity), t_end=T, steps=STEPS)

    def problem(*variables, **changes):
        return transient_problem([replace(scenario, **changes)], start=0.5, budgets=[], variables=variables)

    one = LawVariable(name="v", members=(2,), lower=0.05, upper=0.2)
    with pytest.raises(InvalidLayout, match="lower < upper"):
        replace(one, upper=0.0)
    with pytest.raises(InvalidLayout, match="lower <= start <= upper"):
        replace(one, start=0.4)
    with pytest.raises(InvalidLayout, match="members from 0 to 9, got 11"):
        problem(replace(one, members=(11,)))
    with pytest.raises(InvalidLayout, match="needs a parameter of its Spring, one of k, c"):
        problem(replace(one, members=(0,)))
    with pytest.raises(InvalidLayout, match="both set members"):
        problem(one, replace(one, name="w"))
    with pytest.raises(InvalidLayout, match="a name each"):
        problem(one, replace(one, members=(7,)))
    with pytest.raises(InvalidLayout, match="do not see when"):
        problem(one, steps=20)
    with pytest.raises(InvalidLayout, match="moves other numbers of the law too"):
        problem(replace(one, members=(4,), parameter="c0", lower=20.0, upper=40.0))
    with pytest.raises(InvalidLayout, match=r"cannot be 0\.3 s"):
        problem(replace(one, members=(1,), upper=0.3))
