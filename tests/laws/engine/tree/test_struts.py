"""Struts by laws with states of the user's: against another integrator, in the adjoint, in statics."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from workbench.engine import (
    Coordinate,
    Floating,
    GeneralisedAlpha,
    InvalidSystem,
    Maximum,
    Prismatic,
    Revolute,
    RungeKutta8,
    SpatialBody,
    SpatialMember,
    SpatialStrut,
    Spring,
    StateLaw,
    TreeSystem,
    gradient,
    parameter_slopes,
    simulate,
)
from workbench.engine.tree.statics import equilibrium, modes

pytestmark = pytest.mark.slow


def maxwell_force(delta, rate, t, pulled, k, c):
    return k * (delta - pulled)


def maxwell_growth(delta, rate, t, pulled, k, c):
    return k * (delta - pulled) / c


def friction_force(delta, rate, t, bent, warm, k, level, slow, heat):
    """Bristles that bend (Dahl's friction), losing grip as they warm, switched on over time."""
    return k * bent / (1.0 + warm) * np.tanh(3.0 * t) + 2.0 * rate


def friction_growth(delta, rate, t, bent, warm, k, level, slow, heat):
    size = np.sqrt(rate**2 + slow**2)
    return rate - k * bent * size / level, heat * k * bent * rate - 3.0 * warm


MAXWELL = StateLaw(
    force=maxwell_force, growth=maxwell_growth, states={"pulled": 0.01}, constants={"c": 40.0, "k": 900.0}
)
FRICTION = StateLaw(
    force=friction_force, growth=friction_growth, states={"bent": 0.0, "warm": 0.1},
    constants={"k": 4e3, "level": 30.0, "slow": 0.05, "heat": 0.02},
)  # fmt: skip


def slide(law):
    """A mass of 2 kg on a rail, a spring of 500 N/m and a strut to the ground."""
    mass = SpatialBody(name="m", joint=Prismatic(position=1.0, speed=-1.2), mass=2.0)
    spring = SpatialMember(a="m", law=Spring(k=500.0), natural_length=0.97)
    strut = SpatialStrut(a="ground", b="m", law=law, natural_length=0.98, name="strut")
    return TreeSystem(bodies=(mass,), members=(spring,), struts=(strut,), gravity=(0.0, 0.0, 0.0))


def arm(maxwell=MAXWELL, friction=FRICTION):
    """A floating body with an arm, on springs, with a strut between them and one to the ground."""
    body = SpatialBody(
        name="m", joint=Floating(velocity=(1.5, 0.4, -0.3)), mass=2.0, inertia=(0.1, 0.1, 0.1)
    )  # fmt: skip
    hand = SpatialBody(
        name="n", parent="m", at=(0.3, 0.0, 0.0), joint=Revolute(axis=(0.0, 1.0, 0.0), speed=1.0),
        mass=0.5, centre=(0.2, 0.0, 0.0), inertia=(0.01, 0.01, 0.01),
    )  # fmt: skip
    members = (
        SpatialMember(a="m", point_b=(0.9, 0.2, 0.1), law=Spring(k=300.0, c=1.0)),
        SpatialMember(a="n", point_b=(-0.9, 0.2, 0.1), law=Spring(k=200.0)),
    )
    struts = (
        SpatialStrut(a="m", b="n", point_a=(0.0, 0.2, 0.3), point_b=(0.2, 0.1, 0.1), law=maxwell),
        SpatialStrut(a="ground", b="n", point_a=(0.0, 0.9, 0.3), point_b=(0.2, 0.1, 0.1), law=friction),
    )
    return TreeSystem(bodies=(body, hand), members=members, struts=struts)


DENSITY = np.array([1.0, 0.5])
FARTHEST = Maximum(quantity=Coordinate(bodies=("n",), direction=(1.0, 0.2, -0.4)))


@pytest.mark.parametrize("law", [MAXWELL, FRICTION], ids=["one state", "two states"])
@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), RungeKutta8()], ids=lambda s: type(s).__name__)
def test_another_integrator_finds_the_same(law, scheme):
    def right(t, y):
        given = (y[0] - 0.98, y[1], t, *y[2:], *law.constants.values())
        pull = 500.0 * (y[0] - 0.97) + law.force(*given)
        return [y[1], -pull / 2.0, *np.atleast_1d(law.growth(*given))]

    times = np.linspace(0.0, 0.6, 7)
    known = solve_ivp(
        right, (0.0, 0.6), [1.0, -1.2, *law.states.values()], t_eval=times, rtol=1e-11, atol=1e-12
    ).y
    run = simulate(slide(law), [1.0], 0.6, 6000, scheme=scheme)
    exact = 1e-9 if isinstance(scheme, RungeKutta8) else 2e-6  # order 2 at h = 0.1 ms
    np.testing.assert_allclose(run.of("m")[::1000, 0], known[0], rtol=0, atol=exact)
    np.testing.assert_allclose(run.states[::1000], known[2:].T, rtol=0, atol=10.0 * exact)
    tension = [
        law.force(x - 0.98, v, t, *z, *law.constants.values())
        for x, v, t, *z in zip(known[0], known[1], times, *known[2:], strict=True)
    ]
    np.testing.assert_allclose(run.strut_force("strut")[::1000], tension, rtol=0, atol=4e4 * exact)


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(), RungeKutta8()], ids=lambda s: type(s).__name__)
def test_gradients_by_densities_hold(scheme):
    made = arm()

    def value(density):
        return FARTHEST.value(simulate(made, density, 0.5, 400, scheme=scheme))

    slopes = gradient(made, DENSITY, simulate(made, DENSITY, 0.5, 400, scheme=scheme), FARTHEST)
    step = 1e-5
    for k in range(2):
        away = step * np.eye(2)[k]
        difference = (value(DENSITY + away) - value(DENSITY - away)) / (2 * step)
        assert slopes[k] == pytest.approx(difference, rel=1e-6, abs=1e-9)


def test_slopes_by_constants_and_starts_of_states_hold():
    made = arm()
    run = simulate(made, DENSITY, 0.5, 400)
    chosen = {
        **{("maxwell", name): value for name, value in (*MAXWELL.constants.items(), *MAXWELL.states.items())},
        **{("friction", name): value for name, value in FRICTION.constants.items()},
        ("friction", "warm"): 0.1,
    }

    def of(which, name):
        law = MAXWELL if which == "maxwell" else FRICTION
        return lambda value: arm(**{which: law.changed(**{name: value})})

    found = parameter_slopes(run, FARTHEST, {str(key): (value, of(*key)) for key, value in chosen.items()})
    for key, value in chosen.items():
        step = 1e-4 * value
        up, down = (
            FARTHEST.value(simulate(of(*key)(value + sign * step), DENSITY, 0.5, 400)) for sign in (1, -1)
        )
        assert found[str(key)] == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-9), key


def test_modes_are_the_roots_of_the_linear_system():
    found = modes(slide(MAXWELL), np.ones(1)).eigenvalues
    # x, x', pulled: m x'' = -k1 x - k (x - z), z' = k (x - z)/c
    roots = np.linalg.eigvals(
        [[0, 1, 0], [-(500.0 + 900.0) / 2.0, 0, 900.0 / 2.0], [900.0 / 40.0, 0, -900.0 / 40.0]]
    )
    known = sorted(roots[roots.imag >= 0], key=abs)
    np.testing.assert_allclose(sorted(found, key=abs), known, rtol=1e-9)


def test_statics_take_states_as_they_start():
    rest = equilibrium(slide(MAXWELL), np.ones(1))
    run = simulate(rest.system, [1.0], 1e-6, 1)
    # 500 (x - 0.97) + 900 (x - 0.98 - 0.01) = 0
    assert run.of("m")[0, 0] == pytest.approx((500.0 * 0.97 + 900.0 * 0.99) / 1400.0, rel=1e-9)


def test_struts_of_one_name_and_strangers_are_refused():
    twice = (SpatialStrut(a="m", law=MAXWELL), SpatialStrut(a="m", point_a=(0.1, 0.0, 0.0), law=MAXWELL))
    with pytest.raises(InvalidSystem, match=r"struts\[1\] is called 'm-ground' as struts\[0\] is"):
        TreeSystem(bodies=slide(MAXWELL).bodies, struts=twice)
    with pytest.raises(InvalidSystem, match=r"struts\[0\] joins body 'm' to itself"):
        TreeSystem(bodies=slide(MAXWELL).bodies, struts=(SpatialStrut(a="m", b="m", law=MAXWELL),))
    run = simulate(slide(MAXWELL), [1.0], 0.01, 1)
    with pytest.raises(ValueError, match="system has no strut 'x'; it has strut"):
        run.strut_force("x")
