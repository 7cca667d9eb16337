"""A law of the user's as machine code, in every kind of system: as the engine's own, with all gradients."""

import numpy as np
import pytest

from workbench.engine import (
    Body,
    CompiledLaw,
    Coordinate,
    Floating,
    IndependentAlpha,
    Maximum,
    Member,
    NaturalPoint,
    NaturalSystem,
    PointCoordinate,
    PointMember,
    RungeKutta8,
    SpatialBody,
    SpatialMember,
    Spring,
    System,
    TreeSystem,
    gradient,
    parameter_gradient,
    parameter_slopes,
    simulate,
)

ANCHORS = ((0.9, 0.2, 0.1), (-0.7, 0.4, -0.2), (0.1, -0.8, 0.5))
DENSITY = np.array([1.0, 0.6, 0.3])


def linear(delta, rate, t, k, c):
    return k * delta + c * rate


def damper(delta, rate, t, k, cubic, c, v0):
    """A stiffening spring beside a damper that saturates, both fading with time."""
    return (k * delta + cubic * delta**3 + c * v0 * np.tanh(rate / v0)) * np.exp(-0.5 * t)


def one_sided(delta, rate, t, k, c):
    return k * max(delta, 0.0) ** 3 + c * abs(rate) * rate


def one_sided_slopes(delta, rate, t, k, c):
    return 3.0 * k * max(delta, 0.0) ** 2, 2.0 * c * abs(rate)


SPRING = Spring(k=300.0, c=2.0)
LINEAR = CompiledLaw(force=linear, constants={"k": 300.0, "c": 2.0})
DAMPER = CompiledLaw(force=damper, constants={"c": 8.0, "cubic": -400.0, "k": 250.0, "v0": 0.3})
GIVEN = CompiledLaw(force=one_sided, slopes=one_sided_slopes, constants={"k": 2e3, "c": 1.5})


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


def objective(system):
    if system is natural:
        return Maximum(quantity=PointCoordinate(point="m", direction=(1.0, 0.0, 0.0)))
    return Maximum(
        quantity=Coordinate(bodies=("m",), direction=(1.0, 0.0, 0.0)[: 2 if system is planar else 3])
    )


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_a_linear_law_is_a_spring(system):
    one, two = (simulate(system(law), DENSITY, 0.6, 300) for law in (LINEAR, SPRING))
    np.testing.assert_allclose(one.position, two.position, rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("law", [DAMPER, GIVEN], ids=["complex step", "given slopes"])
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_gradients_by_densities_hold(system, law):
    seen, made = objective(system), system(law)

    def value(density):
        return seen.value(simulate(made, density, 0.6, 300))

    slopes = gradient(made, DENSITY, simulate(made, DENSITY, 0.6, 300), seen)
    step = 1e-5
    for k in range(3):
        away = step * np.eye(3)[k]
        difference = (value(DENSITY + away) - value(DENSITY - away)) / (2 * step)
        assert slopes[k] == pytest.approx(difference, rel=1e-6, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_slopes_by_constants_hold(system):
    seen, made = objective(system), system(DAMPER)
    run = simulate(made, DENSITY, 0.6, 300)

    def of(name):
        return lambda value: system(DAMPER.changed(**{name: value}))

    chosen = {name: (value, of(name)) for name, value in DAMPER.constants.items()}
    by_name = parameter_slopes(run, seen, chosen)
    for name, value in DAMPER.constants.items():
        step = 1e-5 * abs(value)
        larger, smaller = (
            seen.value(simulate(of(name)(value + sign * step), DENSITY, 0.6, 300)) for sign in (1, -1)
        )
        assert by_name[name] == pytest.approx((larger - smaller) / (2 * step), rel=1e-6, abs=1e-10)
        if system is not natural:
            row = DAMPER.names.index(name)
            assert parameter_gradient(run, seen).law[row].sum() == pytest.approx(by_name[name], rel=1e-7)


@pytest.mark.parametrize(
    "scheme", [RungeKutta8(), IndependentAlpha()], ids=lambda scheme: type(scheme).__name__
)
def test_every_scheme_of_the_plane_runs_it(scheme):
    made = planar(DAMPER)
    usual, other = simulate(made, DENSITY, 0.4, 800), simulate(made, DENSITY, 0.4, 800, scheme=scheme)
    np.testing.assert_allclose(other.position[-1], usual.position[-1], rtol=0, atol=2e-6)
