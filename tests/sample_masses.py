"""One mass on three members of a law, as every kind of system has it, and what its gradients must be."""

import numpy as np
import pytest

from workbench.engine import (
    Body,
    Coordinate,
    Floating,
    Maximum,
    Member,
    NaturalPoint,
    NaturalSystem,
    PointCoordinate,
    PointMember,
    SpatialBody,
    SpatialMember,
    System,
    TreeSystem,
    gradient,
    simulate,
)

ANCHORS = ((0.9, 0.2, 0.1), (-0.7, 0.4, -0.2), (0.1, -0.8, 0.5))
DENSITY = np.array([1.0, 0.6, 0.3])


def planar(law):
    mass = Body(name="m", mass=2.0, inertia=0.1, velocity=(1.5, 0.4, 0.0))
    members = tuple(Member(a="m", b="ground", point_b=at[:2], law=law) for at in ANCHORS)
    return System(bodies=(mass,), members=members)


def tree(law):
    mass = SpatialBody(
        name="m", joint=Floating(velocity=(1.5, 0.4, -0.3)), mass=2.0, inertia=(0.1, 0.1, 0.1)
    )  # fmt: skip
    members = tuple(SpatialMember(a="m", point_b=at, law=law) for at in ANCHORS)
    return TreeSystem(bodies=(mass,), members=members)


def natural(law):
    points = (
        NaturalPoint(name="m", position=(0.0, 0.0, 0.0), mass=2.0, velocity=(1.5, 0.4, -0.3)),
        *(NaturalPoint(name=f"p{k}", position=at, fixed=True) for k, at in enumerate(ANCHORS)),
    )
    members = tuple(PointMember(a="m", b=f"p{k}", law=law) for k in range(len(ANCHORS)))
    return NaturalSystem(points=points, members=members)


def along_x(system):
    """The place of the mass, of a kind of system."""
    if system is natural:
        return PointCoordinate(point="m", direction=(1.0, 0.0, 0.0))
    return Coordinate(bodies=("m",), direction=(1.0, 0.0, 0.0)[: 2 if system is planar else 3])


def farthest(system):
    return Maximum(quantity=along_x(system))


def run_of(system, law, density=DENSITY):
    return simulate(system(law), density, 0.6, 300)


def check_gradients_by_densities(system, law):
    """The discrete adjoint within 1e-6 of differences of runs."""
    objective, made = farthest(system), system(law)

    def value(density):
        return objective.value(simulate(made, density, 0.6, 300))

    slopes = gradient(made, DENSITY, simulate(made, DENSITY, 0.6, 300), objective)
    step = 1e-5
    for k in range(3):
        away = step * np.eye(3)[k]
        difference = (value(DENSITY + away) - value(DENSITY - away)) / (2 * step)
        assert slopes[k] == pytest.approx(difference, rel=1e-6, abs=1e-8)
