"""The bill of a mass between springs, whose motion is known, and of problems without runs."""

import numpy as np
import pytest

from studies import trusses
from workbench.engine import (
    Body,
    Coordinate,
    Floating,
    Maximum,
    Member,
    SpatialBody,
    SpatialMember,
    Spring,
    System,
    TreeSystem,
)
from workbench.engine.layout.formulation.problem import InvalidLayout
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.outcome.bill_of_materials import bill_of_materials
from workbench.robust_layout.document import layout_members

SPEED, MASS, K = 0.5, 2.0, 300.0
SECOND_ORDER = 2e-3  # 400 steps of a scheme and of trapezoids of second order


def mass_between_springs(speed):
    """A mass thrown along x between two springs of its axis; the third spring has no density to speak of."""
    mass = Body(name="mass", mass=MASS, inertia=1.0, velocity=(speed, 0.0, 0.0), gravity=False)
    return System(
        bodies=(mass,),
        members=tuple(
            Member(a="mass", b="ground", point_b=(x, 0.0), law=Spring(k=K), name=name)
            for x, name in ((-1.0, "left"), (1.0, "right"), (2.0, ""))
        ),
    )


def problem(*systems, members=3):
    quantity = Maximum(quantity=Coordinate(bodies=("mass",), direction=(1.0, 0.0)))
    scenarios = [
        Scenario(system=s, objective=quantity, t_end=0.5, steps=400, name=f"{k + 1} times as fast")
        for k, s in enumerate(systems)
    ]
    return transient_problem(
        scenarios, start=0.5, budgets=[(np.array([1.0, 2.0, 1.0]), 3.0)], names=("mass of springs",),
        sensitivities="adjoint",
    )  # fmt: skip


def test_what_the_members_of_an_oscillator_bear():
    density = np.array([0.4, 0.8, 1e-7])
    bill = bill_of_materials(problem(mass_between_springs(SPEED), mass_between_springs(2 * SPEED)), density)
    assert [e.name for e in bill.entries] == ["right", "left"]  # thickest first
    right, left = bill.entries
    omega = np.sqrt(K * density.sum() / MASS)
    largest = 2 * SPEED / omega
    assert left.stretch.value == pytest.approx(largest, rel=SECOND_ORDER)
    assert left.tension.value == pytest.approx(0.4 * K * largest, rel=SECOND_ORDER)
    assert left.tension.time == pytest.approx(np.pi / 2 / omega, abs=2 * 0.5 / 400)
    assert right.compression.value == pytest.approx(0.8 * K * largest, rel=SECOND_ORDER)
    assert left.force is max(left.tension, left.compression, key=lambda e: e.value)
    assert left.elongation.value >= left.shortening.value
    assert right.energy.value == pytest.approx(0.5 * 0.8 * K * largest**2, rel=SECOND_ORDER)
    assert {e.tension.scenario for e in bill.entries} == {1}
    assert bill.scenarios == ("1 times as fast", "2 times as fast")
    assert right.shares == pytest.approx([1.6 / 3])
    assert (bill.left_out, bill.left_out_share[0]) == (1, pytest.approx(1e-7 / 3))
    assert (left.length, left.body_a, left.body_b, left.kind) == (1.0, "mass", "ground", "spring")
    assert [body.name for body in bill.bodies] == ["mass"]


def test_a_member_has_one_name_in_the_bill_and_in_the_layout():
    """In the layout every member was its kind and a number, whatever name it had been given."""
    made, density = problem(mass_between_springs(SPEED)), np.array([0.4, 0.8, 0.3])
    assert [m["name"] for m in layout_members(made, density)] == ["left", "right", "spring 3"]
    assert [e.name for e in bill_of_materials(made, density).entries] == ["right", "left", "spring 3"]


@pytest.mark.slow
def test_a_tree_has_the_same_bill():
    density = np.array([0.4, 0.8, 0.1])
    tree = TreeSystem(
        bodies=(
            SpatialBody(
                name="mass", joint=Floating(velocity=(SPEED, 0.0, 0.0)), mass=MASS, inertia=(1.0, 1.0, 1.0)
            ),
        ),
        members=tuple(
            SpatialMember(a="mass", b="ground", point_b=(x, 0.0, 0.0), law=Spring(k=K))
            for x in (-1.0, 1.0, 2.0)
        ),
        gravity=(0.0, 0.0, 0.0),
    )
    quantity = Maximum(quantity=Coordinate(bodies=("mass",), direction=(1.0, 0.0, 0.0)))
    spatial = transient_problem(
        [Scenario(system=tree, objective=quantity, t_end=0.5, steps=400)], start=0.5, budgets=[]
    )
    found = bill_of_materials(spatial, density).entries
    planar = bill_of_materials(problem(mass_between_springs(SPEED)), density).entries
    for there, here in zip(found, planar, strict=True):
        assert there.point_b.tolist() == [*here.point_b, 0.0]
        for name in ("tension", "compression", "stretch", "shortening", "energy"):
            assert getattr(there, name).value == pytest.approx(getattr(here, name).value, rel=SECOND_ORDER)


def test_a_problem_without_runs_has_no_bill():
    with pytest.raises(InvalidLayout, match="needs the runs of moving systems"):
        bill_of_materials(trusses.two_bar(), np.ones(2))
    with pytest.raises(InvalidLayout, match="density needs one number for each of the 3 members"):
        bill_of_materials(problem(mass_between_springs(SPEED)), np.ones(2))
