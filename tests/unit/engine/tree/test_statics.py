"""Equilibrium and small vibrations against closed forms."""

import numpy as np
import pytest

from tests.sample_trees import tree_run
from workbench.engine.elements.spring import Spring
from workbench.engine.errors import NotConverged
from workbench.engine.tree.elements import CoordinateSpring, SpatialBushing, SpatialMember, SphericalSpring
from workbench.engine.tree.joints import Floating, Prismatic, Revolute, Spherical
from workbench.engine.tree.restart import restarted
from workbench.engine.tree.statics import equilibrium, modes
from workbench.engine.tree.surfaces import Plane, SpatialContact
from workbench.engine.tree.system import SpatialBody, TreeSystem

NONE = np.zeros(0)


def hanging(angle):
    return SpatialBody(
        name="rod", joint=Revolute(axis=(0.0, 1.0, 0.0), angle=angle), mass=2.0, centre=(0.5, 0.0, 0.0),
        inertia=(0.0, 0.1, 0.1),
    )  # fmt: skip


def test_a_rod_on_a_torsion_spring_sags_to_its_angle():
    system = TreeSystem(bodies=(hanging(0.0),), springs=(CoordinateSpring(body="rod", k=30.0, c=0.5),))
    found = equilibrium(system, NONE)
    angle = found.system.bodies[0].joint.angle
    assert 30.0 * angle == pytest.approx(2.0 * 9.81 * 0.5 * np.cos(angle), rel=1e-9)
    assert found.residual < 1e-10
    assert found.system.springs[0].rest == 0.0
    run = tree_run(found.system, NONE, np.linspace(0.0, 0.5, 51))
    assert np.ptp(run.position) < 1e-10


def test_a_held_joint_is_balanced_by_a_torque():
    found = equilibrium(TreeSystem(bodies=(hanging(0.3),)), NONE, held=(("rod", 0),))
    assert found.torques[("rod", 0)] == pytest.approx(-2.0 * 9.81 * 0.5 * np.cos(0.3), rel=1e-12)
    run = tree_run(found.system, NONE, np.linspace(0.0, 0.2, 21))
    assert np.abs(run.velocity).max() < 1e-10


def test_a_seated_chain_settles_from_afar():
    """A floating body on four springs, a bushing and a contact, with a head on a ball joint."""
    seat = SpatialBody(
        name="seat", joint=Floating(position=(0.02, -0.05, 0.3), orientation=(1.0, 0.05, 0.02, 0.1)),
        mass=20.0, inertia=(1.0, 1.0, 1.0),
    )  # fmt: skip
    head = SpatialBody(name="head", parent="seat", joint=Spherical(), at=(0, 0, 0.5), mass=5.0,
                       centre=(0.05, 0, 0.1), inertia=(0.05,) * 3)  # fmt: skip
    legs = tuple(
        SpatialMember(
            a="seat", point_a=(x, y, 0.0), point_b=(1.2 * x, 1.2 * y, -0.5), law=Spring(k=8e3),
            natural_length=0.7,
        )
        for x in (-0.3, 0.3) for y in (-0.3, 0.3)
    )  # fmt: skip
    system = TreeSystem(
        bodies=(seat, head), members=legs, spherical_springs=(SphericalSpring(body="head", k=100.0, c=1.0),),
        bushings=(SpatialBushing(a="seat", k=(50.0, 50.0, 0.0), point_b=(0, 0, 0.2)),),
        contacts=(SpatialContact(a="seat", shape=Plane(offset=-1.0), k=1e4),),
    )  # fmt: skip
    found = equilibrium(system, np.ones(4))
    run = tree_run(found.system, np.ones(4), np.linspace(0.0, 0.2, 41))
    assert np.abs(run.acceleration).max() < 1e-6
    assert found.free == 0


def test_what_nothing_carries_is_named():
    loose = SpatialBody(name="loose", joint=Prismatic(axis=(0.0, 0.0, 1.0)), mass=3.0)
    with pytest.raises(NotConverged, match="out of balance stay 'loose'"):
        equilibrium(TreeSystem(bodies=(loose,)), NONE)


def test_modes_of_a_damped_oscillator_and_a_pendulum():
    k, c, m = 200.0, 3.0, 2.0
    slide = SpatialBody(name="slide", joint=Prismatic(), mass=m)
    system = TreeSystem(
        bodies=(slide, hanging(np.pi / 2)), springs=(CoordinateSpring(body="slide", k=k, c=c),)
    )
    found = modes(system, NONE)
    pendulum = np.sqrt(2.0 * 9.81 * 0.5 / (0.1 + 2.0 * 0.25)) / (2.0 * np.pi)
    expected = sorted([np.sqrt(k / m) / (2.0 * np.pi), pendulum])
    assert sorted(found.frequency) == pytest.approx(expected, rel=1e-9)
    assert max(found.damping) == pytest.approx(c / (2.0 * np.sqrt(k * m)), rel=1e-9)
    assert np.abs(found.shapes).max(axis=1) == pytest.approx(1.0)


def test_a_restart_goes_on_where_a_run_ended():
    ball = SpatialBody(
        name="ball", parent="rod", joint=Spherical(spin=(1.0, 2.0, 0.0)), at=(1, 0, 0), mass=1.0,
        centre=(0.1, 0, 0.2), inertia=(0.1, 0.2, 0.3),
    )  # fmt: skip
    spring = CoordinateSpring(body="rod", k=3.0)
    system = TreeSystem(bodies=(hanging(0.2), ball), springs=(spring,))
    whole = tree_run(system, NONE, np.linspace(0.0, 0.4, 4001))
    half = tree_run(system, NONE, np.linspace(0.0, 0.2, 2001))
    rest = tree_run(
        restarted(system, half.position[-1], half.velocity[-1]), NONE, np.linspace(0.0, 0.2, 2001)
    )
    assert rest.position[-1] == pytest.approx(whole.position[-1], abs=1e-7)
