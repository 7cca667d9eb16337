"""A system without the members that do nothing: planar, of points, and as a tree."""

import numpy as np
import pytest

from workbench.engine import (
    Body,
    Floating,
    Member,
    Motion,
    NaturalPoint,
    NaturalSystem,
    PointMember,
    SpatialBody,
    SpatialMember,
    Spring,
    System,
    TreeSystem,
    acting_members,
    simulate,
)

PLACES = ((0.0, 1.0), (1.0, 0.0), (-1.0, 0.5), (0.3, -1.0))
DENSITY = np.array([1.0, 1e-8, 0.0, 0.4])


def planar():
    wall = Body(name="wall", motion=Motion(position=lambda t: (0.0, 0.0, 0.0)))
    members = (Member(a="ball", b="wall", point_b=place, law=Spring(k=300.0)) for place in PLACES)
    return System(bodies=(Body(name="ball", velocity=(1.0, 2.0, 0.0)), wall), members=tuple(members))


def test_what_is_left_moves_as_before_and_keeps_its_order():
    system = planar()
    few, density = acting_members(system, DENSITY)
    assert few.members == (system.members[0], system.members[3])
    assert density.tolist() == [1.0, 0.4]
    whole, part = (simulate(s, d, t_end=0.5, steps=100) for s, d in ((system, DENSITY), (few, density)))
    np.testing.assert_allclose(part.position, whole.position, rtol=0, atol=1e-6)
    exact, _ = acting_members(system, DENSITY, negligible=0.0)
    assert len(exact.members) == 3


def test_every_kind_of_system_is_taken():
    points = NaturalSystem(
        points=(
            NaturalPoint(name="ball", position=(1, 0, 0), mass=1.0),
            NaturalPoint(name="wall", position=(0, 0, 0), fixed=True),
        ),
        members=(PointMember(a="ball", b="wall", law=Spring(k=300.0)),) * 2,
    )
    tree = TreeSystem(
        bodies=(SpatialBody(name="ball", joint=Floating(), mass=1.0, inertia=(1, 1, 1)),),
        members=(SpatialMember(a="ball", b="ground", point_b=(0.0, 0.0, 1.0), law=Spring(k=300.0)),) * 2,
    )
    for system in (points, tree):
        few, density = acting_members(system, [0.0, 0.7])
        assert type(few) is type(system)
        assert (len(few.members), density.tolist()) == (1, [0.7])


def test_densities_that_are_none_are_refused():
    with pytest.raises(ValueError, match=r"one value per member, shape \(4,\), got shape \(3,\)"):
        acting_members(planar(), np.zeros(3))
    with pytest.raises(ValueError, match=r"finite values >= 0, got density\[1\]=nan"):
        acting_members(planar(), [0.0, np.nan, 0.0, 0.0])
