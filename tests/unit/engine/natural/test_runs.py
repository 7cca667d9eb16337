"""Natural coordinates: mass matrices, added directions, conditions, members, quantities, clear refusals."""

import logging

import numpy as np
import pytest

from tests.sample_spatial import bricard
from workbench.engine import (
    BDF2,
    Angle,
    AssemblyError,
    Distance,
    IndependentAlpha,
    InvalidSystem,
    Maximum,
    NaturalPoint,
    NaturalSystem,
    NotConverged,
    NotSupported,
    PointCoordinate,
    PointMember,
    PointOnLine3,
    PointOnPlane,
    RigidElement,
    RungeKutta8,
    Spring,
    Terminal,
    UnitVector,
    gradient,
    moving,
    simulate,
)
from workbench.engine.natural.compiled import compiled


def body(**changes):
    """A free brick turning about its own centre, known by three points."""
    points = [
        NaturalPoint(name="A", position=(0.2, 0.1, 0.0)),
        NaturalPoint(name="B", position=(1.2, 0.3, 0.1)),
        NaturalPoint(name="C", position=(0.1, 1.0, -0.4)),
    ]
    part = {"mass": 2.0, "centre": (0.5, 0.5, 0.1), "inertia": np.diag([0.4, 0.5, 0.6]), **changes}
    brick = RigidElement(name="brick", points=("A", "B", "C"), **part)
    return NaturalSystem(points=points, elements=(brick,), gravity=(0.0, 0.0, 0.0))


def test_the_mass_matrix_has_the_kinetic_energy_of_a_rigid_body():
    omega, drift, centre = np.array([0.3, -1.0, 0.7]), np.array([0.1, 0.2, -0.3]), np.array([0.5, 0.5, 0.1])
    system = body()
    parts = compiled(system)
    nodes = {**{p.name: np.array(p.position) for p in parts.full.points}}
    v = np.zeros(len(parts.start[0]))
    for name, at in parts.index.items():
        if name in nodes:
            v[at : at + 3] = drift + np.cross(omega, nodes[name] - centre)
        else:
            v[at : at + 3] = np.cross(omega, parts.start[0][at : at + 3])
    assert len(parts.index) == 4  # three points leave one direction to add
    energy = 0.5 * v @ parts.arrays["mass"] @ v
    assert energy == pytest.approx(0.5 * 2.0 * drift @ drift + 0.5 * omega @ np.diag([0.4, 0.5, 0.6]) @ omega)


def test_a_slender_rod_needs_its_two_points_alone():
    ends = [NaturalPoint(name="A", position=(0, 0, 0)), NaturalPoint(name="B", position=(0, 2, 0))]
    rod = RigidElement(name="rod", points=("A", "B"), mass=3.0, inertia=np.diag([1.0, 0.0, 1.0]))
    system = NaturalSystem(points=ends, elements=(rod,))
    parts = compiled(system)
    np.testing.assert_allclose(parts.arrays["mass"], np.kron([[1.0, 0.5], [0.5, 1.0]], np.eye(3)), atol=1e-12)


def test_conical_pendulum_turns_at_its_closed_form_rate():
    angle, g = 0.6, 9.81
    rate = np.sqrt(g / np.cos(angle))
    bob = (np.sin(angle), 0.0, -np.cos(angle))
    system = NaturalSystem(
        points=(
            NaturalPoint(name="O", position=(0, 0, 0), fixed=True),
            NaturalPoint(name="P", position=bob, velocity=(0.0, rate * np.sin(angle), 0.0), mass=2.0),
        ),
        conditions=(Distance(a="O", b="P"),),
    )
    run = simulate(system, [], 2.0, 200, scheme=RungeKutta8())
    want = np.sin(angle) * np.stack([np.cos(rate * run.times), np.sin(rate * run.times)], axis=1)
    np.testing.assert_allclose(run.of("P")[:, :2], want, atol=1e-11)
    np.testing.assert_allclose(run.multiplier[:, 0] * 1.0, run.multiplier[0, 0], rtol=1e-9)
    assert abs(run.multiplier[0, 0]) == pytest.approx(2.0 * g / np.cos(angle))  # the rod's tension, N


def test_driven_conditions_follow_their_functions():
    system = NaturalSystem(
        points=(
            NaturalPoint(name="O", position=(0, 0, 0), fixed=True),
            NaturalPoint(name="P", position=(1, 0, 0), mass=1.0, velocity=(0, 0, 0)),
        ),
        vectors=(UnitVector(name="z", direction=(0, 0, 1), fixed=True),),
        conditions=(
            Distance(a="O", b="P", length=lambda t: 1.0 + 0.1 * t**2),
            PointOnPlane(point="P", origin="O", normal="z", height=lambda t: 0.2 * np.sin(t) ** 2),
        ),
        gravity=(0.0, 0.0, 0.0),
    )
    run = simulate(system, [], 1.0, 100)
    np.testing.assert_allclose(np.linalg.norm(run.of("P"), axis=1), 1.0 + 0.1 * run.times**2, atol=1e-9)
    np.testing.assert_allclose(run.of("P")[:, 2], 0.2 * np.sin(run.times) ** 2, atol=1e-9)


def universal():
    """A yoke that turns about a fixed axis, and a cross whose own axis stays square to the yoke's."""
    return NaturalSystem(
        points=(NaturalPoint(name="O", position=(0, 0, 0), fixed=True),),
        vectors=(
            UnitVector(name="a", direction=(1, 0, 0)),
            UnitVector(name="b", direction=(0, 1, 0)),
            UnitVector(name="c", direction=(0, 0, 1), fixed=True),
        ),
        elements=(
            RigidElement(name="yoke", points=("O",), vectors=("a", "c"), mass=1.0, inertia=np.eye(3)),
            RigidElement(name="cross", points=("O",), vectors=("b",), mass=1.0, inertia=np.eye(3) * 0.1),
        ),
        conditions=(Angle(a="a", b="b"),),
    )


def test_an_angle_between_vectors_is_kept():
    system = moving(universal(), {"a": (0.0, 1.0, 0.0)})
    run = simulate(system, [], 1.0, 100)
    assert np.abs(np.sum(run.of("a") * run.of("b"), axis=1)).max() < 1e-13
    assert np.abs(run.joint_residuals()).max() < 1e-13
    np.testing.assert_allclose(run.of("a")[-1], (np.cos(1.0), np.sin(1.0), 0.0), atol=1e-4)


def sprung():
    """Bricard's mechanism with two springs and a damper to the ground."""
    plain = bricard()
    anchors = (
        NaturalPoint(name="G", position=(1.5, 0.5, 1.5), fixed=True),
        NaturalPoint(name="H", position=(-0.5, -2.0, 0.5), fixed=True),
    )
    return NaturalSystem(
        points=(*plain.points, *anchors), vectors=plain.vectors, elements=plain.elements,
        members=(
            PointMember(a="P3", b="G", law=Spring(k=30.0, c=1.0)),
            PointMember(a="P2", b="H", law=Spring(k=50.0), natural_length=0.8),
            PointMember(a="P1", b="P4", law=Spring(k=20.0, c=0.5), power=2.0),
        ),
        gravity=plain.gravity,
    )  # fmt: skip


@pytest.mark.parametrize("scheme", [IndependentAlpha(rho=0.8), RungeKutta8()], ids=["alpha", "order 8"])
def test_gradients_of_spatial_systems_equal_differences(scheme):
    system, density = sprung(), np.array([0.7, 1.2, 0.9])
    for objective in (
        Terminal(quantity=PointCoordinate(point="P3", direction=(0.3, 1.0, -0.2))),
        Maximum(quantity=PointCoordinate(point="P2", direction=(1.0, 0.0, 1.0), relative=True)),
    ):
        run = simulate(system, density, 0.5, 60, scheme=scheme)
        found = gradient(system, density, run, objective)
        for i in range(3):
            step = 1e-5 * np.eye(3)[i]
            g = [
                objective.value(simulate(system, density + k * step, 0.5, 60, scheme=scheme))
                for k in (-2, -1, 1, 2)
            ]
            difference = (8 * (g[2] - g[1]) - (g[3] - g[0])) / 12e-5
            assert found[i] == pytest.approx(difference, rel=1e-6, abs=1e-10)


def test_energy_with_springs_is_kept():
    system = sprung()
    still = NaturalSystem(
        points=system.points, vectors=system.vectors, elements=system.elements, gravity=system.gravity,
        members=(PointMember(a="P3", b="G", law=Spring(k=30.0)),),
    )  # fmt: skip
    run = simulate(still, [1.5], 2.0, 200, scheme=RungeKutta8())
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-9
    assert run.stored_energy().max() > 1.0


def test_redundant_conditions_are_told(caplog):
    with caplog.at_level(logging.WARNING, logger="workbench.engine"):
        run = simulate(bricard(), [], 0.05, 10)
    assert "redundant joint rows are set aside" in caplog.text
    assert run.diagnosis.redundant_rows[0] in caplog.text


def test_conditions_redundant_at_the_start_only_are_refused_by_name():
    # two rods pull the same point along one line at the start, but their circles part
    system = NaturalSystem(
        points=(
            NaturalPoint(name="O", position=(0, 0, 0), fixed=True),
            NaturalPoint(name="Q", position=(0, 0, 1), fixed=True),
            NaturalPoint(name="P", position=(0, 0, 2), velocity=(1.0, 0, 0), mass=1.0),
        ),
        conditions=(Distance(a="O", b="P", name="long"), Distance(a="Q", b="P", name="short")),
    )
    with pytest.raises(NotConverged, match=r"redundant rows do not agree|could not be closed|not determined"):
        simulate(system, [], 1.0, 100)


BALL = NaturalPoint(name="P", position=(1, 0, 0), mass=1.0)
PIVOT = NaturalPoint(name="O", position=(0, 0, 0), fixed=True)


def element(*, points=("P",), **rest):
    """An element of one point."""
    return RigidElement(name="e", points=points, **rest)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: NaturalSystem(points=(BALL, BALL)), "two points or vectors are called 'P'"),
        (lambda: NaturalSystem(points=(PIVOT,)), "at least one point or vector that moves"),
        (
            lambda: NaturalSystem(points=(BALL,), conditions=(Distance(a="P", b="Z"),)),
            r"conditions\[0\] \(Distance\) refers to point 'Z', which the system does not have; points are P",
        ),
        (
            lambda: NaturalSystem(points=(BALL,), elements=(element(vectors=("u",)),)),
            r"elements\[0\] 'e' refers to unit vector 'u'.*unit vectors are none",
        ),
        (
            lambda: NaturalSystem(points=(BALL,), members=(PointMember(a="P", b="P", law=Spring(k=1.0)),)),
            r"members\[0\] joins point 'P' to itself",
        ),
        (
            lambda: NaturalSystem(points=(BALL,), elements=(element(mass=-1.0),)),
            r"needs mass >= 0 kg, got mass=-1.0",
        ),
        (lambda: NaturalSystem(points=(BALL,), elements=(element(points=()),)), "at least one point"),
        (
            lambda: NaturalSystem(points=(BALL,), vectors=(UnitVector(name="u", direction=(0, 0, 0)),)),
            "unit vector 'u' needs a direction",
        ),
        (lambda: compiled(body(inertia=np.diag([1.0, 0.1, 0.1]))), "no body can have"),
        (lambda: compiled(body(inertia=np.ones((2, 2)))), r"symmetric inertia of shape \(3, 3\)"),
    ],
    ids=range(10),
)  # fmt: skip
def test_bad_systems_are_refused_in_words(build, message):
    with pytest.raises(InvalidSystem, match=message):
        build()


def test_bad_starts_are_refused_with_what_would_fit():
    apart = NaturalSystem(points=(BALL, PIVOT), conditions=(Distance(a="P", b="O", length=1.1),))
    with pytest.raises(
        AssemblyError, match=r"'Distance 0' is off by 0.0955.*move a coordinate by up to 0.1"
    ) as found:
        simulate(apart, [], 0.1, 10)
    assert found.value.position[0] == pytest.approx(1.1)
    leaving = NaturalPoint(name="P", position=(1, 0, 0), velocity=(1.0, 0.0, 0.0), mass=1.0)
    pulled = NaturalSystem(points=(leaving, PIVOT), conditions=(Distance(a="P", b="O"),))
    with pytest.raises(AssemblyError, match=r"'Distance 0' changes at 1 per second.*take moving\(system"):
        simulate(pulled, [], 0.1, 10)
    with pytest.raises(AssemblyError, match="conditions do not allow the velocities of P"):
        moving(pulled, {"P": (1.0, 0.0, 0.0)})
    with pytest.raises(ValueError, match="'O' is fixed and cannot move"):
        moving(pulled, {"O": (1.0, 0.0, 0.0)})
    with pytest.raises(NotSupported, match=r"IndependentAlpha or RungeKutta8, not BDF2"):
        simulate(pulled, [], 0.1, 10, scheme=BDF2())
    contrary = NaturalSystem(
        points=(BALL, PIVOT, NaturalPoint(name="Q", position=(9, 0, 0), fixed=True)),
        conditions=(Distance(a="P", b="O", length=1.0), Distance(a="P", b="Q", length=1.0)),
    )
    with pytest.raises(AssemblyError, match="conditions contradict each other"):
        simulate(contrary, [], 0.1, 10)


def test_a_point_on_a_line_slides():
    system = NaturalSystem(
        points=(PIVOT, NaturalPoint(name="P", position=(0, 0, -1), mass=1.0)),
        vectors=(UnitVector(name="z", direction=(0, 0, 1), fixed=True),),
        conditions=(PointOnLine3(point="P", origin="O", axis="z"),),
    )
    run = simulate(system, [], 1.0, 50, scheme=RungeKutta8())
    np.testing.assert_allclose(run.of("P")[-1], (0, 0, -1 - 9.81 / 2), atol=1e-12)
    assert run.diagnosis.redundant_rows == ("PointOnLine3 0, z",)
