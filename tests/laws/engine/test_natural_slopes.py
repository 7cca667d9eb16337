"""Slopes by parameters of systems in natural coordinates equal differences of runs, under both schemes."""

from dataclasses import replace

import numpy as np
import pytest

from tests.laws.engine.test_parameter_slopes import EXACT, quotient
from workbench.engine import (
    Distance,
    IndependentAlpha,
    NaturalPoint,
    NaturalSystem,
    PointCoordinate,
    PointMember,
    RigidElement,
    RungeKutta8,
    Spring,
    Terminal,
    moving,
    parameter_slopes,
    simulate,
)

END = Terminal(quantity=PointCoordinate(point="C", direction=(1.0, 0.4, -0.7)))


def brick_on_a_rod(rng, *, rod=1.0, bob=1.5, mass=2.0, stiff=80.0, rest=0.7, anchor=0.3, push=0.5):
    """A bob on a massless rod carries a brick of three points on two springs, its start moved along."""
    direction = np.array([0.6, 0.0, -0.8])
    hang = rod * direction
    corners = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [0.1, -0.1, -0.6]]) + hang
    points = [
        NaturalPoint(name="O", position=(0.0, 0.0, 0.0), fixed=True),
        NaturalPoint(name="G", position=(anchor, 1.0, -0.5), fixed=True),
        *(NaturalPoint(name=n, position=tuple(x)) for n, x in zip("ABC", corners, strict=True)),
    ]
    points[2] = replace(points[2], mass=bob)
    brick = RigidElement(name="brick", points=("A", "B", "C"), mass=mass, inertia=np.diag([0.2, 0.3, 0.25]))
    ties = (
        PointMember(a="B", b="G", law=Spring(k=stiff, c=2.0)),
        PointMember(a="C", b="O", law=Spring(k=rng.uniform(20, 50), c=1.0), natural_length=rest, power=2.0),
    )
    system = NaturalSystem(
        points=points, elements=(brick,), members=ties, conditions=(Distance(a="O", b="A"),)
    )
    return moving(system, {"B": (0.0, push, 0.0), "C": (0.0, push, 0.0)})


@pytest.mark.slow
@pytest.mark.parametrize("scheme", [IndependentAlpha(rho=0.9), RungeKutta8()], ids=["alpha", "order 8"])
@pytest.mark.parametrize("seed", [1, 2])
def test_slopes_by_every_sort_of_parameter(scheme, seed):
    def system(**fields):
        return brick_on_a_rod(np.random.default_rng(seed), **fields)

    values = {
        "rod": 1.0, "bob": 1.5, "mass": 2.0, "stiff": 80.0, "rest": 0.7, "anchor": 0.3, "push": 0.5,
    }  # fmt: skip
    density = np.array([0.8, 0.6])
    run = simulate(system(), density, 0.3, 30, scheme=scheme)
    found = parameter_slopes(run, END, {n: (x, lambda y, n=n: system(**{n: y})) for n, x in values.items()})
    for name, x in values.items():

        def value(y, name=name):
            return END.value(simulate(system(**{name: y}), density, 0.3, 30, scheme=scheme))

        exact = quotient(value, x)
        assert abs(exact) > 1e-6, name
        assert found[name] == pytest.approx(exact, rel=EXACT, abs=1e-11), name


@pytest.mark.slow
def test_systems_of_another_structure_are_refused():
    system = brick_on_a_rod(np.random.default_rng(1))
    run = simulate(system, [0.8, 0.6], 0.05, 5)
    free = replace(system, conditions=())
    with pytest.raises(ValueError, match="same points, conditions and members at every value"):
        parameter_slopes(run, END, {"rod": (1.0, lambda x: free)})
